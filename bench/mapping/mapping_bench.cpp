// Binding and mapping a surface of 1 M vertices on a lattice of about 100,000 elements: a ring of
// diameter 2.6 m, h = 28.5 mm. The counter per_vertex is what docs/measurements/performance.md quotes; the argument is the
// number of threads.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <numeric>
#include <string>

#include "base/parallel.h"
#include "formats/part/topology.h"
#include "mapping/anchors/nearest.h"
#include "mapping/methods/apply.h"
#include "mapping/methods/bind.h"
#include "mapping/methods/frame_methods.h"
#include "mapping/methods/map_surface.h"

namespace flexel::mapping {
namespace {

constexpr double kRing = 1.0, kTube = 0.3, kSpacing = 0.0285;
constexpr std::uint32_t kSide = 1000, kLargeSide = 3163;  // vertices around and across: 1 and 10 million

Surface ring_surface(std::uint32_t side) {
  Surface surface;
  for (std::uint32_t i = 0; i < side; ++i)
    for (std::uint32_t j = 0; j < side; ++j) {
      const double a = 2 * M_PI * i / side, b = 2 * M_PI * j / side, r = kRing + kTube * std::cos(b);
      surface.vertices.emplace_back(r * std::cos(a), r * std::sin(a), kTube * std::sin(b));
    }
  surface.polygon_offsets.push_back(0);
  for (std::uint32_t i = 0; i < side; ++i)
    for (std::uint32_t j = 0; j < side; ++j) {
      for (const auto& [s, t] : {std::pair{0u, 0u}, {1u, 0u}, {1u, 1u}, {0u, 1u}})
        surface.polygon_vertices.push_back((i + s) % side * side + (j + t) % side);
      surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    }
  surface.polygon_face.assign(surface.polygon_count(), 0);
  surface.faces.push_back({"ring", 0});
  surface.parts.push_back({"ring"});
  surface.sources.resize(1);
  surface.part_source.push_back(0);
  return surface;
}

bool inside(const Vec3& p) {
  const double r = std::hypot(p.x(), p.y()) - kRing;
  return r * r + p.z() * p.z() < kTube * kTube;
}

// Voxels of the ring, (k, j, i) ascending, and which number each has.
struct Voxels {
  std::array<std::int32_t, 3> count{};
  std::vector<std::uint32_t> number;  // dense; 0xffffffff: none
  [[nodiscard]] std::uint32_t& at(std::int32_t i, std::int32_t j, std::int32_t k) {
    return number[(static_cast<std::size_t>(k) * count[1] + j) * count[0] + i];
  }
};

Lattice ring_lattice() {
  Lattice lattice;
  lattice.spacing = Vec3::Constant(kSpacing);
  lattice.origin = Vec3(-kRing - kTube, -kRing - kTube, -kTube) - Vec3(1.37, 1.21, 1.43) * kSpacing;
  return lattice;
}

Voxels ring_voxels(const Surface& surface, const Lattice& lattice, Placement placement) {
  Voxels voxels;
  const Vec3 size = Vec3(kRing + kTube, kRing + kTube, kTube) * 2 / kSpacing;
  for (int axis = 0; axis < 3; ++axis) voxels.count[axis] = static_cast<std::int32_t>(size[axis]) + 4;
  voxels.number.assign(static_cast<std::size_t>(voxels.count[0]) * voxels.count[1] * voxels.count[2],
                       0xffffffffu);
  for (std::int32_t k = 0; k < voxels.count[2]; ++k)
    for (std::int32_t j = 0; j < voxels.count[1]; ++j)
      for (std::int32_t i = 0; i < voxels.count[0]; ++i)
        if (inside(lattice.to_world(Vec3(i + 0.5, j + 0.5, k + 0.5)))) voxels.at(i, j, k) = 0;
  if (placement == Placement::corner)
    for (const Vec3& vertex : surface.vertices) {
      const Vec3 u = lattice.to_lattice(vertex);
      voxels.at(static_cast<std::int32_t>(u.x()), static_cast<std::int32_t>(u.y()),
                static_cast<std::int32_t>(u.z())) = 0;
    }
  std::uint32_t next = 0;
  for (std::uint32_t& number : voxels.number)
    if (number == 0) number = next++;
  return voxels;
}

void add_corner_elements(Body& body, Voxels& voxels) {
  const auto corners = [&](std::int32_t i, std::int32_t j, std::int32_t k, const auto& visit) {
    for (int a = 0; a < 8; ++a) {
      const std::int32_t x = i - (a & 1), y = j - (a >> 1 & 1), z = k - (a >> 2);
      if (x >= 0 && y >= 0 && z >= 0 && x < voxels.count[0] && y < voxels.count[1] && z < voxels.count[2] &&
          voxels.at(x, y, z) != 0xffffffffu)
        visit(voxels.at(x, y, z), a);
    }
  };
  for (const std::uint32_t number : voxels.number)
    if (number != 0xffffffffu) body.cell_elements.push_back({});
  for (std::int32_t k = 0; k <= voxels.count[2]; ++k)
    for (std::int32_t j = 0; j <= voxels.count[1]; ++j)
      for (std::int32_t i = 0; i <= voxels.count[0]; ++i) {
        bool used = false;
        const auto number = static_cast<std::uint32_t>(body.rest.size());
        corners(i, j, k, [&](std::uint32_t cell, int a) {
          used = true;
          body.cell_elements[cell][a] = number;
        });
        if (!used) continue;
        body.lattice_index.push_back({i, j, k});
        body.rest.push_back(body.parts[0].lattice.to_world(Vec3(i, j, k)));
      }
}

void add_centre_elements(Body& body, Voxels& voxels) {
  for (std::int32_t k = 0; k < voxels.count[2]; ++k)
    for (std::int32_t j = 0; j < voxels.count[1]; ++j)
      for (std::int32_t i = 0; i < voxels.count[0]; ++i) {
        if (voxels.at(i, j, k) == 0xffffffffu) continue;
        body.lattice_index.push_back({i, j, k});
        body.rest.push_back(body.parts[0].lattice.to_world(Vec3(i + 0.5, j + 0.5, k + 0.5)));
        std::uint32_t bits = 0;
        for (std::size_t b = 0; b < half_neighbourhood.size(); ++b) {
          const Index3& step = half_neighbourhood[b];
          if (voxels.at(i + step[0], j + step[1], k + step[2]) != 0xffffffffu) bits |= 1u << b;
        }
        body.connections.push_back(bits);
      }
}

Body make_ring(Placement placement, std::uint32_t side) {
  Body body;
  body.surface = ring_surface(side);
  body.parts.resize(1);
  body.parts[0].name = "ring";
  body.parts[0].placement = placement;
  body.parts[0].lattice = ring_lattice();
  Voxels voxels = ring_voxels(body.surface, body.parts[0].lattice, placement);
  if (placement == Placement::corner) {
    add_corner_elements(body, voxels);
    body.connections.assign(body.rest.size(), 0);
    for (std::size_t p = 0; p < body.surface.polygon_count(); ++p) {
      body.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body.surface_cells.size()));
      const std::size_t begin = body.surface_cells.size();
      for (const std::uint32_t v : body.surface.polygon(p)) {
        const Vec3 u = body.parts[0].lattice.to_lattice(body.surface.vertices[v]);
        body.surface_cells.push_back(voxels.at(static_cast<std::int32_t>(u.x()),
                                               static_cast<std::int32_t>(u.y()),
                                               static_cast<std::int32_t>(u.z())));
      }
      std::sort(body.surface_cells.begin() + begin, body.surface_cells.end());
      body.surface_cells.erase(std::unique(body.surface_cells.begin() + begin, body.surface_cells.end()),
                               body.surface_cells.end());
    }
    body.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body.surface_cells.size()));
  } else {
    add_centre_elements(body, voxels);
  }
  body.fill.assign(body.cell_count(), 1);
  body.broken.assign(body.cell_count(), 0);
  body.piece.assign(body.rest.size(), 0);
  body.parts[0].element_end = static_cast<std::uint32_t>(body.rest.size());
  body.parts[0].cell_end = static_cast<std::uint32_t>(body.cell_count());
  for (const Vec3& x : body.rest)  // twisted about the ring's diameter
    body.position.emplace_back(x.x(), x.y() * std::cos(0.5 * x.x()) - x.z() * std::sin(0.5 * x.x()),
                               x.y() * std::sin(0.5 * x.x()) + x.z() * std::cos(0.5 * x.x()));
  check(body, "ring");
  return body;
}

const Body& ring(Placement placement) {
  static const Body corner = make_ring(Placement::corner, kSide),
                    centre = make_ring(Placement::centre, kSide);
  return placement == Placement::corner ? corner : centre;
}

void count(benchmark::State& state, const Body& body) {
  const auto vertices = static_cast<double>(body.surface.vertices.size());
  state.counters["elements"] = static_cast<double>(body.element_count());
  state.counters["per_vertex"] = benchmark::Counter(
      vertices, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

template <Placement placement, mapping::MapMethod method>
void bind_surface(benchmark::State& state) {
  const Body& body = ring(placement);
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(bind(body, method, 2).frame.data());
  count(state, body);
}

template <Placement placement, mapping::MapMethod method>
void apply_state(benchmark::State& state) {
  const Body& body = ring(placement);
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  const mapping::Binding binding = bind(body, method, 2);
  for (auto _ : state) benchmark::DoNotOptimize(apply(binding, body, body.position).data());
  count(state, body);
}

// Parts of binding that other people's code does.
void connections(benchmark::State& state) {
  const Body& body = ring(Placement::corner);
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(element_adjacency(body).neighbours.data());
  count(state, body);
}

void welding(benchmark::State& state) {
  const Body& body = ring(Placement::corner);
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(weld(body.surface.vertices).data());
  count(state, body);
}

// The least that gram-schmidt and affine can take: an index and coordinates read, a displacement written.
void traffic(benchmark::State& state) {
  const Body& body = ring(Placement::corner);
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  const mapping::Binding binding = bind(body, &mapping::kAffine);
  const auto& coordinates = dynamic_cast<const mapping::FrameCoordinates&>(*binding.kept).coordinates;
  std::vector<Vec3> out(body.surface.vertices.size());
  for (auto _ : state) {
    parallel_for_each(
        out.size(), [&](std::size_t v) { out[v] = coordinates[v] * binding.frame[v]; }, 8192);
    benchmark::DoNotOptimize(out.data());
  }
  count(state, body);
  state.counters["frames"] = static_cast<double>(binding.frames.size());
}

// The nearest element of every vertex, which centre placement needs.
void nearest(benchmark::State& state) {
  const Body& body = ring(Placement::centre);
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  const mapping::ElementGrid grid(body, 0);
  std::vector<std::uint32_t> found(body.surface.vertices.size());
  for (auto _ : state) {
    parallel_for_each(found.size(),
                      [&](std::size_t v) { found[v] = grid.nearest(body.surface.vertices[v]); });
    benchmark::DoNotOptimize(found.data());
  }
  count(state, body);
}

// What judging a mapped state costs: frames turned over, Voronoi cells left.
void judging(benchmark::State& state) {
  const Body& body = ring(Placement::corner);
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  const mapping::Binding binding = bind(body, &mapping::kAffine);
  const std::vector<Vec3> displacement = apply(binding, body, body.position);
  for (auto _ : state) benchmark::DoNotOptimize(judge(binding, body, body.position, displacement).data());
  count(state, body);
}

void register_all() {
  const auto add = [](const std::string& name, auto* function) {
    for (const int threads : {1, 2})
      benchmark::RegisterBenchmark(name.c_str(), function)
          ->Arg(threads)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
  };
  constexpr auto corner = Placement::corner, centre = Placement::centre;
  add("bind/corner/gram-schmidt", bind_surface<corner, &mapping::kGramSchmidt>);
  add("bind/corner/affine", bind_surface<corner, &mapping::kAffine>);
  add("bind/corner/blended", bind_surface<corner, &mapping::kBlended>);
  add("bind/corner/smooth", bind_surface<corner, &mapping::kSmooth>);
  add("bind/centre/gram-schmidt", bind_surface<centre, &mapping::kGramSchmidt>);
  add("bind/centre/blended", bind_surface<centre, &mapping::kBlended>);
  add("apply/corner/gram-schmidt", apply_state<corner, &mapping::kGramSchmidt>);
  add("apply/corner/affine", apply_state<corner, &mapping::kAffine>);
  add("apply/corner/blended", apply_state<corner, &mapping::kBlended>);
  add("apply/corner/smooth", apply_state<corner, &mapping::kSmooth>);
  add("apply/centre/gram-schmidt", apply_state<centre, &mapping::kGramSchmidt>);
  add("apply/centre/blended", apply_state<centre, &mapping::kBlended>);
  add("judge", judging);
  add("part/connections", connections);
  add("part/welding", welding);
  add("part/traffic", traffic);
  add("part/nearest", nearest);
}

// Peak resident memory of this process so far, MiB.
double peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// Maps 10 million vertices once, as flexel-map does, and says what the process took at most.
void print_memory(const std::string& method) {
  const Body body = make_ring(Placement::corner, kLargeSide);
  const double before = peak_memory();
  const auto began = std::chrono::steady_clock::now();
  const mapping::MapResult result = map_state(bind(body, map_method(method)), body);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  fmt::print(
      "{}: {} vertices, {} elements: peak {:.0f} MiB with the body ({:.0f} MiB before mapping), {:.1f} s\n",
      method, result.displacement.size(), body.element_count(), peak_memory(), before, took.count());
}

}  // namespace
}  // namespace flexel::mapping

int main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "--memory") {
    flexel::mapping::print_memory(argv[2]);
    return 0;
  }
  benchmark::Initialize(&argc, argv);
  flexel::mapping::register_all();
  benchmark::RunSpecifiedBenchmarks();
}
