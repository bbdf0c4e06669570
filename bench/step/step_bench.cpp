// Explicit steps: element-steps (cells: cell-steps) a second on a block of 47^3 elements, as peers are
// measured on, and on a thin-walled real part (skipped where ../shared/parts is absent). Damped, double
// precision. Counters: million element- and cell-steps a second, bytes an element of the solver's own memory.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "base/parallel.h"
#include "formats/exchange/import.h"
#include "simulate/models/stability.h"
#include "simulate/stepping/stepper.h"
#include "tests/simulate/box_body.h"
#include "voxelize/voxelize.h"

namespace flexel::simulate {
namespace {

const simulate::Material kRubber{"rubber", 1.2e6, 0.25, 930, "test"};

Body block() {
  testing::BoxOptions options;
  options.cells = {46, 46, 46};
  options.spacing = Vec3::Constant(1e-3);
  return testing::box_body(options);
}

std::optional<Body> thin_part() {
  const std::filesystem::path path =
      std::filesystem::path(FLEXEL_PARTS_DIR) / "hip_aa_module_shell_cover.STL";
  if (!std::filesystem::exists(path)) return std::nullopt;
  voxelize::VoxelizeOptions options;
  options.count = 100000;
  options.align = voxelize::Align::box;
  Progress progress("bench", Progress::Mode::quiet);
  return voxelize::voxelize(import_surface(path.string(), {}), options, progress).body;
}

// Arguments: model (0 cells, 1 springs), damping (0, 1), threads.
void step(benchmark::State& state, const Body& body) {
  const ThreadLimit limit(static_cast<int>(state.range(2)));
  const Model model = state.range(0) == 0 ? Model::cells : Model::springs;
  const simulate::Problem problem{body, std::vector<simulate::Material>(body.parts.size(), kRubber),
                                  std::vector<std::uint8_t>(body.cell_count(), 0),
                                  std::vector<Model>(body.parts.size(), model)};
  const double bare = stable_step(problem, std::vector<double>(body.parts.size(), 0));
  const std::vector<double> damping(body.parts.size(), state.range(1) ? 0.1 * bare : 0);
  simulate::Stepper stepper(problem, {damping}, false);
  const double dt = stable_step(problem, damping);
  simulate::State now;
  now.displacement.assign(body.element_count(), Vec3::Zero());
  now.velocity.assign(body.element_count(), Vec3::Zero());
  for (std::size_t e = 0; e < body.element_count(); ++e)
    now.displacement[e] = 1e-3 * Vec3(body.rest[e].y(), body.rest[e].z(), body.rest[e].x());
  double steps = 0;
  for (auto _ : state) {
    const simulate::StepOutcome outcome = stepper.advance(now, {}, {dt, dt, false});
    if (!(outcome.smallest_jacobian > 0)) state.SkipWithError("a cell folded");
    ++steps;
  }
  const double elements = static_cast<double>(body.element_count());
  state.counters["M_elements/s"] = benchmark::Counter(1e-6 * elements * steps, benchmark::Counter::kIsRate);
  state.counters["M_cells/s"] =
      benchmark::Counter(1e-6 * static_cast<double>(body.cell_count()) * steps, benchmark::Counter::kIsRate);
  state.counters["B/element"] =
      static_cast<double>(stepper.bytes() + 2 * sizeof(Vec3) * body.element_count()) / elements;
  state.SetLabel(stepper.isa());
}

void step_block(benchmark::State& state) {
  static const Body body = block();
  step(state, body);
}

void step_thin(benchmark::State& state) {
  static const std::optional<Body> body = thin_part();
  if (!body) {
    state.SkipWithError("skipped: ../shared/parts is absent");
    return;
  }
  step(state, *body);
}

void arguments(benchmark::internal::Benchmark* row) {
  row->ArgNames({"springs", "damped", "threads"})->UseRealTime()->Unit(benchmark::kMillisecond);
  for (const int springs : {0, 1})
    for (const int damped : {0, 1})
      for (const int threads : {1, 2}) row->Args({springs, damped, threads});
}

BENCHMARK(step_block)->Apply(arguments);
BENCHMARK(step_thin)->Apply(arguments);

}  // namespace
}  // namespace flexel::simulate

BENCHMARK_MAIN();
