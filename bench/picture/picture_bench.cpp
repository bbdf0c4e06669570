// A picture of 1600 x 1200 pixels of a fluted, knotted tube of a million triangles: from the surface in
// memory to the bytes of the PNG, and what its passes take.
#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "bench/knot.h"
#include "flexel/picture/canvas/png_file.h"
#include "flexel/picture/picture.h"
#include "flexel/picture/render/lines.h"
#include "flexel/picture/render/render.h"

namespace flexel::picture {
namespace {

// A (2, 3) torus knot of 2 x along x around triangles, about 125 mm across, its tube fluted.
Surface knot(int along, int around) {
  const auto centre = [](double t) {
    const double r = 0.02 * (2.2 + std::cos(3 * t));
    return Vec3(r * std::cos(2 * t), r * std::sin(2 * t), -0.02 * std::sin(3 * t));
  };
  const auto fluted = [](double t, double q) { return 0.0084 * (1 + 0.05 * std::sin(9 * q + 24 * t)); };
  return closed_tube(along, around, centre, fluted, Vec3::UnitZ(), 1e-4);
}

const Surface& million() {
  static const Surface surface = knot(1024, 512);
  return surface;
}

void whole(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(0)));
  Progress progress("bench", Progress::Mode::quiet);
  std::vector<picture::PictureSubject> subjects(1);
  subjects[0].surface = million();
  picture::PictureOptions options;
  if (state.range(1) == 0) options.view = picture::View{};
  for (auto _ : state) benchmark::DoNotOptimize(encode_png(draw_picture(subjects, options, progress).image));
  state.counters["triangles"] = static_cast<double>(million().polygon_count());
}

const picture::DrawingFrame& frame() {
  static const picture::DrawingFrame one = [] {
    const Box box = bounding_box(million().vertices);
    return picture::DrawingFrame{(box.min + box.max) / 2, box.diagonal() / 2};
  }();
  return one;
}

const picture::Drawable& drawn() {
  static const picture::Drawable one =
      draw_surface(million(), mesh_topology(million()), million().vertices, frame());
  return one;
}

void prepare(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(0)));
  for (auto _ : state)
    benchmark::DoNotOptimize(draw_surface(million(), mesh_topology(million()), million().vertices, frame()));
}

void build_tree(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(0)));
  (void)drawn();
  for (auto _ : state) benchmark::DoNotOptimize(make_tracer(drawn()));
}

picture::Camera camera() {
  picture::Camera one = camera_towards({});
  one.pixels = 700;
  one.x = 800;
  one.y = 600;
  return one;
}

void shade(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(0)));
  const picture::Tracer tracer = make_tracer(drawn());
  picture::Image image(1600, 1200, colour(0xffffff));
  for (auto _ : state) render(image, {0, 0, 1600, 1200}, camera(), drawn(), tracer, {});
}

void lines(benchmark::State& state) {
  const ThreadLimit threads(static_cast<int>(state.range(0)));
  const picture::Tracer tracer = make_tracer(drawn());
  picture::Image image(1600, 1200, colour(0xffffff));
  for (auto _ : state) draw_lines(image, visible_lines(drawn(), tracer, camera()), {});
}

// By threads; the second argument of `whole` is 1 where the view is chosen. CPU is that of all threads.
BENCHMARK(whole)
    ->Args({1, 0})
    ->Args({2, 0})
    ->Args({2, 1})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(prepare)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(build_tree)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(shade)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(lines)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

}  // namespace
}  // namespace flexel::picture

BENCHMARK_MAIN();
