// Whether error bars hold: cases whose answer is known, each with its error, its bar, and what the bar cost.
// Ends with 1 when fewer than nine of ten hold. docs/measurements/verification.md quotes it.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "tests/simulate/study_beam.h"
#include "voxelize/voxelize.h"

namespace {

using namespace flexel;

struct Found {
  simulate::ErrorBar bar;
  simulate::ErrorBars all;
  double seconds = 0;
  double reference = 0;
};

struct Case {
  std::string name;
  std::function<Found()> run;
};

// The bar of the first probe.
Found solve(Body& body, const simulate::Scene& scene, double reference) {
  const simulate::SimulateResult result = simulate::testing::simulate_quietly(body, scene);
  Found found;
  found.all = result.error_bars;
  found.seconds = result.seconds;
  found.reference = reference;
  if (!found.all.bars.empty()) found.bar = found.all.bars[0];
  return found;
}

void probe_at(simulate::Scene& scene, simulate::Selection where) {
  simulate::Probe probe;
  probe.name = "asked";
  probe.where = std::move(where);
  scene.probes.push_back(probe);
}

simulate::Scene loaded_end(simulate::Scene scene, const simulate::Selection& end, const Vec3& force) {
  scene.get<simulate::Loads>().loads.push_back(make_push(end, force));
  probe_at(scene, end);
  return scene;
}

Found study_beam(int n) {
  Body body = simulate::testing::corner_beam(n);
  return solve(
      body,
      loaded_end(simulate::testing::held_beam("cells"), simulate::select_by_name("box/x1"),
                 Vec3(0, 0, simulate::testing::kStudyForce)),
      simulate::testing::study_reference(simulate::testing::study_width(n)) * simulate::testing::kStudyForce);
}

// The beam of tests/simulate/beam_test.cpp, with Poisson's ratio 0.3, held by its face and pushed across its
// width.
Found wide_beam(int n) {
  simulate::testing::BoxOptions options;
  options.cells = {4 * n, static_cast<int>(std::lround(1.4 * n)), n};
  options.spacing = Vec3(2.0 / options.cells[0], 0.7 / options.cells[1], 0.5 / options.cells[2]);
  Body body = simulate::testing::box_body(options);
  simulate::Scene scene;
  scene.materials["gum"] = {"gum", simulate::testing::kStudyYoung, 0.3, 580, "test"};
  scene.material = "gum";
  scene.get<simulate::Supports>().ties.push_back(simulate::make_fix(simulate::select_by_name("xmin")));
  return solve(body, loaded_end(scene, simulate::select_by_name("box/x1"), Vec3(0, 1e-3, 0)),
               1.65964e-4 * 1e-3);
}

// A bar drawn, its cells three across: F L / (E A) but for the ties, which yield by h / 300.
Found drawn_bar(int n) {
  Body body = simulate::testing::box_body({.cells = {4 * n, n, n}, .spacing = Vec3::Constant(1.0 / n)});
  simulate::Scene scene;
  scene.materials["gum"] = {"gum", 1e6, 0.3, 1000, "test"};
  scene.material = "gum";
  for (const auto& [side, axis] : {std::pair{"xmin", 0}, {"ymin", 1}, {"zmin", 2}}) {
    simulate::Tie tie = simulate::make_fix(simulate::select_by_name(side));
    tie.axes = {axis == 0, axis == 1, axis == 2};
    scene.get<simulate::Supports>().ties.push_back(tie);
  }
  // The mean over the end also draws in by nu F / E on either side of y = z = 0.
  const double drawn = 4 * 10 / 1e6, drawn_in = 0.3 * 10 / 1e6 / 2;
  return solve(body, loaded_end(scene, simulate::select_by_name("xmax"), Vec3(10, 0, 0)),
               std::hypot(drawn, drawn_in, drawn_in));
}

// Adds quads, one CAD face.
struct Mesh {
  Surface surface;
  Mesh() {
    surface.polygon_offsets = {0};
    surface.parts.push_back({"part"});
    SurfaceSource source;
    source.file = "part";
    source.format = "stl-binary";
    surface.sources.push_back(source);
    surface.part_source.push_back(0);
  }
  void face(const std::string& name) { surface.faces.push_back({name, 0}); }
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    for (const std::uint32_t v : {a, b, c, d}) surface.polygon_vertices.push_back(v);
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(static_cast<std::uint32_t>(surface.faces.size() - 1));
  }
};

Body voxels(Surface surface, double spacing, voxelize::Align align) {
  Progress progress("bench", Progress::Mode::silent);
  voxelize::VoxelizeOptions options;
  options.size = spacing;
  options.align = align;
  return voxelize::voxelize(std::move(surface), options, progress).body;
}

// 2 x 0.5 x 0.5 m, turned by 30 degrees about two axes against the lattice.
Found turned_beam(int n) {
  const Mat3 turn = (Eigen::AngleAxisd(M_PI / 6, Vec3::UnitZ()) * Eigen::AngleAxisd(M_PI / 6, Vec3::UnitX()))
                        .toRotationMatrix();
  Mesh mesh;
  for (int c = 0; c < 8; ++c)
    mesh.surface.vertices.push_back(turn * Vec3((c & 1) * 2, (c >> 1 & 1) * 0.5, (c >> 2) * 0.5));
  const std::uint32_t quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (int f = 0; f < 6; ++f) {
    mesh.face(fmt::format("f{}", f));
    mesh.quad(quads[f][0], quads[f][1], quads[f][2], quads[f][3]);
  }
  Body body = voxels(mesh.surface, 0.5 / n, voxelize::Align::none);
  simulate::Scene scene;
  scene.materials["gum"] = {"gum", simulate::testing::kStudyYoung, 0.25, 580, "test"};
  scene.material = "gum";
  scene.get<simulate::Supports>().ties.push_back(simulate::make_fix(simulate::select_by_name("part/f0")));
  return solve(body, loaded_end(scene, simulate::select_by_name("part/f1"), turn * Vec3(0, 0, 1e-3)),
               simulate::testing::study_reference(0.5) * 1e-3);
}

// A quarter of a thick tube under inner pressure, in plane strain (Lame). Mean displacement of the inner
// face.
Found ring(double spacing) {
  constexpr int kSteps = 180;
  constexpr double kInner = 0.02, kOuter = 0.04, kHigh = 0.004, kYoung = 210e9, kPoisson = 0.3,
                   kPressure = 1e6;
  Mesh mesh;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = M_PI / 2 * i / kSteps;
    for (const double z : {0.0, kHigh})
      for (const double r : {kInner, kOuter})
        mesh.surface.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  const auto at = [](int i, int high, int outer) {
    return static_cast<std::uint32_t>(4 * i + 2 * high + outer);
  };
  const auto around = [&](const std::string& name, const auto& quad) {
    mesh.face(name);
    for (int i = 0; i < kSteps; ++i) quad(i);
  };
  around("inner", [&](int i) { mesh.quad(at(i, 0, 0), at(i, 1, 0), at(i + 1, 1, 0), at(i + 1, 0, 0)); });
  around("outer", [&](int i) { mesh.quad(at(i, 0, 1), at(i + 1, 0, 1), at(i + 1, 1, 1), at(i, 1, 1)); });
  around("low", [&](int i) { mesh.quad(at(i, 0, 0), at(i + 1, 0, 0), at(i + 1, 0, 1), at(i, 0, 1)); });
  around("high", [&](int i) { mesh.quad(at(i, 1, 0), at(i, 1, 1), at(i + 1, 1, 1), at(i + 1, 1, 0)); });
  mesh.face("along");
  mesh.quad(at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0));
  mesh.face("across");
  mesh.quad(at(kSteps, 0, 0), at(kSteps, 1, 0), at(kSteps, 1, 1), at(kSteps, 0, 1));
  Body body = voxels(mesh.surface, spacing, voxelize::Align::none);
  simulate::Scene scene;
  scene.materials["metal"] = {"metal", kYoung, kPoisson, 7850, "test"};
  scene.material = "metal";
  for (const auto& [face, axis] :
       {std::pair{"part/along", 1}, {"part/across", 0}, {"part/low", 2}, {"part/high", 2}}) {
    simulate::Tie tie = simulate::make_fix(simulate::select_by_name(face));
    tie.axes = {axis == 0, axis == 1, axis == 2};
    scene.get<simulate::Supports>().ties.push_back(tie);
  }
  scene.get<simulate::Loads>().loads.push_back(
      simulate::make_pressure(simulate::select_by_name("part/inner"), kPressure));
  probe_at(scene, simulate::select_by_name("part/inner"));
  const double a2 = kInner * kInner, b2 = kOuter * kOuter;
  const double radial =
      (1 + kPoisson) * kPressure * a2 / (kYoung * (b2 - a2)) * ((1 - 2 * kPoisson) * kInner + b2 / kInner);
  return solve(body, scene, radial * 2 * std::sqrt(2.0) / M_PI);
}

}  // namespace

int main() {
  std::vector<Case> cases;
  for (const int n : {3, 4, 6, 8, 12})
    cases.push_back({fmt::format("cantilever, {} cells thick", n), [n] { return study_beam(n); }});
  for (const int n : {4, 5, 8})
    cases.push_back({fmt::format("cantilever bent across, {} cells thick", n), [n] { return wide_beam(n); }});
  for (const int n : {4, 8})
    cases.push_back({fmt::format("bar drawn, {} cells thick", n), [n] { return drawn_bar(n); }});
  for (const int n : {4, 8, 12})
    cases.push_back(
        {fmt::format("cantilever turned twice, {} cells thick", n), [n] { return turned_beam(n); }});
  for (const double h : {0.002, 0.001, 0.0005})
    cases.push_back({fmt::format("thick tube, {:.0f} cells through", 0.02 / h), [h] { return ring(h); }});
  fmt::print(
      "| case | cells | error % | bar % | holds | order | extrapolated, error % | cost of the bar % |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  int hold = 0;
  for (const Case& each : cases) {
    const Found found = each.run();
    if (found.all.bars.empty()) {
      fmt::print("| {} | {} | | none: {} | | | | |\n", each.name, found.all.cells[0], found.all.note);
      continue;
    }
    const double scale = 100 / found.reference, error = scale * (found.bar.value - found.reference);
    const bool holds = std::abs(found.bar.value - found.reference) <= found.bar.bar.half_width;
    hold += holds ? 1 : 0;
    fmt::print("| {} | {} | {:+.2f} | {:.2f} | {} | {} | {:+.2f} | {:.0f} |\n", each.name, found.all.cells[0],
               error, scale * found.bar.bar.half_width, holds ? "yes" : "no",
               found.bar.bar.order ? fmt::format("{:.1f}", *found.bar.bar.order) : "",
               scale * (found.bar.bar.extrapolated - found.reference),
               100 * found.all.seconds / found.seconds);
  }
  fmt::print("\n{} of {} hold\n", hold, cases.size());
  return hold * 10 >= static_cast<int>(cases.size()) * 9 ? 0 : 1;
}
