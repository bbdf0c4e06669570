// Linear solver: one solution to a relative residual of 1e-6 with aggregation multigrid, part by part.
// Counters: cells, iterations, set-up and refresh seconds, bytes a cell of matrix and hierarchy (from the
// allocator).
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <chrono>

#include "base/parallel.h"
#include "tests/simulate/voxel_problem.h"

namespace flexel::simulate {
namespace {

double allocated_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Arguments: cells, threads.
void solve(benchmark::State& state, test::VoxelProblem (*make)(double)) {
  const test::VoxelProblem problem = make(static_cast<double>(state.range(0)));
  const ThreadLimit limit(static_cast<int>(state.range(1)));
  const double cells = static_cast<double>(problem.voxels.size());
  double setup = 0, refresh = 0, iterations = 0, bytes = 0;
  for (auto _ : state) {
    const double before = allocated_bytes();
    auto start = std::chrono::steady_clock::now();
    const auto multigrid = aggregation_multigrid(problem.matrix, problem.geometry);
    setup = seconds_since(start);
    bytes = allocated_bytes() - before;
    start = std::chrono::steady_clock::now();
    multigrid->refresh();
    refresh = seconds_since(start);
    std::vector<Vec3> x;
    start = std::chrono::steady_clock::now();
    const simulate::LinearResult result =
        conjugate_gradients(problem.matrix, problem.load, x, *multigrid, 1e-6, 500);
    state.SetIterationTime(seconds_since(start));
    iterations = result.iterations;
    if (!result.converged) state.SkipWithError("did not converge");
  }
  const double matrix = static_cast<double>(problem.matrix.columns.size()) * (sizeof(simulate::Block) + 4);
  state.counters["cells"] = cells;
  state.counters["iterations"] = iterations;
  state.counters["setup_s"] = setup;
  state.counters["refresh_s"] = refresh;
  state.counters["matrix_B_per_cell"] = matrix / cells;
  state.counters["hierarchy_B_per_cell"] = bytes / cells;
}

test::VoxelProblem plate_one(double cells) {
  return test::plate(cells, 1);
}
test::VoxelProblem plate_two(double cells) {
  return test::plate(cells, 2);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"cells", "threads"})
      ->ArgsProduct({{50000, 200000}, {1, 2}})
      ->UseManualTime()
      ->Iterations(1);
  benchmark->Unit(benchmark::kSecond);
}

BENCHMARK_CAPTURE(solve, beam, test::beam)->Apply(sizes);
BENCHMARK_CAPTURE(solve, plate_1, plate_one)->Apply(sizes);
BENCHMARK_CAPTURE(solve, plate_2, plate_two)->Apply(sizes);
BENCHMARK_CAPTURE(solve, i_beam, test::i_beam)->Apply(sizes);
BENCHMARK_CAPTURE(solve, spring, test::spring)->Apply(sizes);
BENCHMARK_CAPTURE(solve, tube, test::tube)->Apply(sizes);

}  // namespace
}  // namespace flexel::simulate

BENCHMARK_MAIN();
