// Import and output of a finely tessellated torus knot of 1,000,000 triangles, and the steps of it.
#include <assimp/postprocess.h>
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>

#include "base/files/output_file.h"
#include "base/parallel.h"
#include "formats/exchange/import.h"
#include "formats/exchange/surface_file.h"
#include "formats/part/topology.h"

namespace {

using namespace flexel;

constexpr int kAlong = 1000, kAround = 500;

// Position on a tube of radius 6 round a (2, 3) torus knot, mm.
Eigen::Vector3f knot(int i, int j) {
  const auto centre = [](double t) {
    const double r = 40 + 12 * std::cos(3 * t);
    return Vec3(r * std::cos(2 * t), r * std::sin(2 * t), 12 * std::sin(3 * t));
  };
  const double t = 2 * std::numbers::pi * (i % kAlong) / kAlong,
               s = 2 * std::numbers::pi * (j % kAround) / kAround;
  const Vec3 along = (centre(t + 1e-4) - centre(t - 1e-4)).normalized();
  const Vec3 side = along.cross(Vec3(0.1, 0.2, 1)).normalized();
  return (centre(t) + 6 * (std::cos(s) * side.cross(along) + std::sin(s) * side)).cast<float>();
}

// The knot as a binary STL, written once.
const std::string& knot_file() {
  static const std::string path = [] {
    const std::uint32_t count = 2 * kAlong * kAround;
    std::string bytes(84 + std::size_t{50} * count, '\0');
    std::memcpy(&bytes[80], &count, 4);
    char* record = &bytes[84];
    const auto add = [&](const std::array<Eigen::Vector3f, 3>& corners) {
      for (std::size_t c = 0; c < 3; ++c) std::memcpy(record + 12 + 12 * c, corners[c].data(), 12);
      record += 50;
    };
    for (int i = 0; i < kAlong; ++i)
      for (int j = 0; j < kAround; ++j) {
        add({knot(i, j), knot(i + 1, j + 1), knot(i + 1, j)});
        add({knot(i, j), knot(i, j + 1), knot(i + 1, j + 1)});
      }
    const std::string name =
        (std::filesystem::temp_directory_path() / ("flexel-bench-" + std::to_string(getpid()) + ".stl"))
            .string();
    OutputFile out(name);
    out.write(bytes);
    out.commit();
    return name;
  }();
  return path;
}

struct RemoveFile {
  ~RemoveFile() { std::filesystem::remove(knot_file()); }
};

void import_million(benchmark::State& state) {
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  knot_file();
  for (auto _ : state) benchmark::DoNotOptimize(import_surface(knot_file()));
}

void read_million(benchmark::State& state) {
  knot_file();
  for (auto _ : state) benchmark::DoNotOptimize(content_hash(read_all(knot_file())));
}

void topology_million(benchmark::State& state) {
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  const Surface surface = import_surface(knot_file());
  const Triangles triangles = triangulate(surface);
  for (auto _ : state) benchmark::DoNotOptimize(topology(triangles.corners, weld(surface.vertices)));
}

void write_million(benchmark::State& state, SurfaceFormat format) {
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  const Surface surface = import_surface(knot_file());
  const std::vector<Vec3> displacement(surface.vertices.size(), Vec3(1e-3, 0, 0));
  for (auto _ : state) write_surface(surface, displacement, format, 1e-3, knot_file() + ".out");
  std::filesystem::remove(knot_file() + ".out");
}

// What reading by assimp takes: as it comes, every corner a vertex of its own, and with equal ones joined.
void assimp_million(benchmark::State& state, unsigned steps) {
  knot_file();
  for (auto _ : state) {
    Assimp::Importer importer;
    benchmark::DoNotOptimize(importer.ReadFile(knot_file(), steps));
  }
}

BENCHMARK(import_million)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK(read_million)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(assimp_million, read, 0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(assimp_million, joined, aiProcess_JoinIdenticalVertices)->Unit(benchmark::kMillisecond);
BENCHMARK(topology_million)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(write_million, stl_binary, SurfaceFormat::stl_binary)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(write_million, stl_ascii, SurfaceFormat::stl_ascii)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(write_million, obj, SurfaceFormat::obj)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace

int main(int argc, char** argv) {
  const RemoveFile remove_at_end;
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
