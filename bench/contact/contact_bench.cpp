// Contact: finding the pairs, per point at a constant density of points (a sort by cubes is flat, in whatever
// order the points come), and what a step pays while nothing touches, per element of a block.
#include <benchmark/benchmark.h>

#include <random>

#include "simulate/contact/contacts.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

// Points of 12 neighbours on the average.
void broad_phase(benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0));
  const double side = std::cbrt(static_cast<double>(count));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(0, side);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  std::size_t pairs = 0;
  for (auto _ : state)
    pairs = neighbours_within(points, 1.42, [](std::uint32_t, std::uint32_t) { return true; }).others.size();
  state.counters["time_a_point"] =
      benchmark::Counter(static_cast<double>(count),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["pairs_a_point"] = static_cast<double>(pairs) / static_cast<double>(count);
}
BENCHMARK(broad_phase)->Arg(10000)->Arg(100000)->Arg(1000000)->UseRealTime();

// A block in free flight, with itself and nothing else to touch.
void nothing_touches(benchmark::State& state) {
  testing::BoxOptions options;
  const int cells = static_cast<int>(state.range(0));
  options.cells = {cells, cells, cells};
  options.spacing = Vec3::Constant(1e-3);
  const Body body = testing::box_body(options);
  simulate::Problem problem{
      body, {{"gum", 1e6, 0.25, 1000, "test"}}, std::vector<std::uint8_t>(body.cell_count(), 0)};
  simulate::ContactSettings settings;
  settings.parts = {1};
  simulate::Contacts contacts(settings, problem);
  simulate::State now;
  now.displacement.assign(body.element_count(), Vec3::Zero());
  now.velocity.assign(body.element_count(), Vec3(1, 0, 0));
  std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
  (void)contacts.frequency(now);
  for (auto _ : state) {
    for (Vec3& u : now.displacement) u.x() += 1e-6;
    benchmark::DoNotOptimize(contacts.needs_step_recheck(now));
    contacts.add_forces(now, forces);
  }
  state.counters["time_an_element"] =
      benchmark::Counter(static_cast<double>(body.element_count()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(nothing_touches)->Arg(16)->Arg(46)->UseRealTime();

}  // namespace
}  // namespace flexel::simulate

BENCHMARK_MAIN();
