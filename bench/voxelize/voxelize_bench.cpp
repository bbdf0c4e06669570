// Voxelising a knotted tube of about a million triangles, the longest axis cut into 512 voxels: from binary
// STL to body file as the program does it (stl_to_body), and its phases.
#include <benchmark/benchmark.h>

#include <unistd.h>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <Eigen/Geometry>

#include "base/parallel.h"
#include "bench/knot.h"
#include "formats/exchange/import.h"
#include "formats/exchange/surface_file.h"
#include "formats/lattice/body_file.h"
#include "voxelize/classify/classify.h"
#include "voxelize/heal/orientation.h"
#include "voxelize/lattice/align.h"
#include "voxelize/lattice/elements.h"
#include "voxelize/voxelize.h"

namespace flexel::voxelize {
namespace {

// A (2, 3) torus knot, outward-oriented, 2 * around * along triangles; about 210 mm long.
Surface knot(int along, int around) {
  const auto centre = [](double t) {
    const double r = .070 + .035 * std::cos(3 * t);
    return Vec3(r * std::cos(2 * t), r * std::sin(2 * t), .035 * std::sin(3 * t));
  };
  return closed_tube(
      along, around, centre, [](double, double) { return .0056; }, Vec3(.3, .2, 1), 1e-5);
}

const Surface& million() {
  static const Surface surface = knot(1024, 512);
  return surface;
}

double size_for(int voxels) {
  return bounding_box(million().vertices).size().maxCoeff() / voxels;
}

voxelize::PartMesh placed(int voxels) {
  voxelize::PartMesh mesh = part_meshes(million())[0];
  repair_orientation(mesh);
  place_on_lattice(mesh, align_lattice(mesh, size_for(voxels), voxelize::Align::none, true));
  return mesh;
}

// Files of this process, in memory where the system has a file system there; removed at the end.
struct TemporaryFiles {
  std::filesystem::path folder;
  TemporaryFiles() {
    const std::filesystem::path memory = "/dev/shm";
    folder = (std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path()) /
             ("flexel-bench-" + std::to_string(getpid()));
    std::filesystem::create_directory(folder);
    write_surface(million(), std::vector<Vec3>(million().vertices.size(), Vec3::Zero()),
                  SurfaceFormat::stl_binary, 1e-3, part());
  }
  ~TemporaryFiles() { std::filesystem::remove_all(folder); }
  [[nodiscard]] std::string part() const { return (folder / "knot.stl").string(); }
  [[nodiscard]] std::string body() const { return (folder / "knot.vtu").string(); }
};

void stl_to_body(benchmark::State& state) {
  static const TemporaryFiles files;
  const ThreadLimit threads(static_cast<int>(state.range(1)));
  Progress progress("bench", Progress::Mode::quiet);
  voxelize::VoxelizeOptions options;
  options.size = size_for(static_cast<int>(state.range(0)));
  options.max_memory = 1e12;
  for (auto _ : state) {
    const voxelize::VoxelizeResult result = voxelize(import_surface(files.part()), options, progress);
    write_body(result.body, files.body());
    state.counters["cells"] = static_cast<double>(result.parts[0].cells);
  }
}

void whole(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(1)));
  Progress progress("bench", Progress::Mode::quiet);
  voxelize::VoxelizeOptions options;
  options.size = size_for(static_cast<int>(state.range(0)));
  options.max_memory = 1e12;
  for (auto _ : state) {
    state.PauseTiming();
    Surface surface = million();
    state.ResumeTiming();
    const voxelize::VoxelizeResult result = voxelize(std::move(surface), options, progress);
    state.counters["cells"] = static_cast<double>(result.parts[0].cells);
  }
}

void meshes(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(part_meshes(million()));
}

void classify(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(1)));
  const voxelize::PartMesh mesh = placed(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(classify_closed(mesh, {}));
}

void elements(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(1)));
  const voxelize::Voxels voxels = classify_closed(placed(static_cast<int>(state.range(0))), {});
  for (auto _ : state) benchmark::DoNotOptimize(make_elements(voxels));
}

BENCHMARK(stl_to_body)
    ->Args({512, 1})
    ->Args({512, 2})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(whole)->Args({512, 1})->Args({512, 2})->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(meshes)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(classify)
    ->Args({256, 2})
    ->Args({512, 1})
    ->Args({512, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(elements)->Args({512, 1})->Args({512, 2})->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace flexel::voxelize

BENCHMARK_MAIN();
