// Which lines of a part are seen, and how the view is chosen.
#include "flexel/picture/render/lines.h"

#include <gtest/gtest.h>

#include "flexel/picture/render/best_view.h"
#include "flexel/picture/render/render.h"
#include "scenes.h"

namespace flexel::picture {
namespace {

struct Seen {
  Drawable drawn;
  Camera camera;
  std::vector<ScreenLine> lines;
  // Total length in pixels of the lines of a kind.
  [[nodiscard]] double length(LineKind kind) const {
    double sum = 0;
    for (const ScreenLine& line : lines)
      if (line.kind == kind) sum += (line.to - line.from).norm();
    return sum;
  }
};

// With the frame of a part of radius 1 m about the origin.
Seen look(const Surface& surface, const View& view) {
  Seen seen{draw_surface(surface, mesh_topology(surface), surface.vertices, {}), camera_towards(view), {}};
  seen.camera.pixels = 100;
  seen.lines = visible_lines(seen.drawn, make_tracer(seen.drawn), seen.camera);
  return seen;
}

TEST(Lines, OfACubeNineEdgesAreSeen) {
  const Seen seen = look(test::box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}), {});
  // Seen from a corner every edge is foreshortened by the square root of 2/3.
  const double edge = 100 * std::sqrt(2.0 / 3.0);
  EXPECT_NEAR(seen.length(LineKind::outline), 6 * edge, 0.05 * edge);
  EXPECT_NEAR(seen.length(LineKind::crease), 3 * edge, 0.05 * edge);
  EXPECT_EQ(seen.length(LineKind::border), 0);
  EXPECT_NEAR(seen.length(LineKind::step), 0, 0.05 * edge);
}

TEST(Lines, APartInFrontHidesThoseBehind) {
  // The small box is behind the plate as seen from the front, and before it from the back.
  Surface both = test::box({-0.5, -0.6, -0.5}, {0.5, -0.5, 0.5});
  append(both, test::box({-0.2, 0.2, -0.2}, {0.2, 0.6, 0.2}));
  const Seen front = look(both, {0, 0}), back = look(both, {180, 0});
  EXPECT_NEAR(front.length(LineKind::outline) + front.length(LineKind::step), 400, 15);
  EXPECT_NEAR(back.length(LineKind::outline), 400, 15);
  EXPECT_NEAR(back.length(LineKind::step), 160, 15);
}

TEST(Lines, ASphereHasNothingButItsOutline) {
  const Seen seen = look(test::sphere({0, 0, 0}, 0.8, 5), {17, 31});
  EXPECT_NEAR(seen.length(LineKind::outline), 2 * std::numbers::pi * 80, 0.03 * 2 * std::numbers::pi * 80);
  EXPECT_NEAR(seen.length(LineKind::step) + seen.length(LineKind::crease), 0, 10);
}

TEST(Lines, StrayCreasesOfCoarseRoundShapesAreLeftOut) {
  // A sphere of 128 triangles has dihedral angles of 20 to 40 degrees: none of its edges is a feature.
  const Seen seen = look(test::sphere({0, 0, 0}, 0.8, 2), {17, 31});
  EXPECT_LT(seen.length(LineKind::crease), 0.2 * seen.length(LineKind::outline));
}

TEST(Lines, OverlappingLinesGetNoDarker) {
  Image once(60, 60, colour(0xffffff)), thrice = once;
  LineLayer a(60, 60), b(60, 60);
  a.add({10, 10}, {50, 40}, 3);
  for (int i = 0; i < 3; ++i) b.add({10, 10}, {50, 40}, 3);
  a.lay_on(once, colour(0), colour(0));
  b.lay_on(thrice, colour(0), colour(0));
  EXPECT_EQ(once.pixels, thrice.pixels);
  double ink = 0;
  for (const Colour& c : once.pixels) ink += 1 - c.x();
  EXPECT_NEAR(ink, 50 * 3 + std::numbers::pi * 1.5 * 1.5, 4);
}

TEST(BestView, DoesNotLookAlongTheDisplacement) {
  const Surface cube = test::box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  const Drawable drawn = draw_surface(cube, mesh_topology(cube), cube.vertices, {});
  const Tracer tracer = make_tracer(drawn);
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.7, -0.6, 0.4), Vec3(0.4, -0.8, 0.4)}) {
    const Vec3 u = direction.normalized();
    const View view = best_view({{&drawn, &tracer, u * u.transpose()}}, 4.0 / 3);
    EXPECT_LT(std::abs(camera_towards(view).forward.cast<double>().dot(u)), 0.6) << direction.transpose();
  }
}

TEST(BestView, SeesIntoAnL) {
  // A wall at x = 0 and a floor before it, towards +x: from the right, where the wall hides nothing of the
  // floor.
  Surface angle = test::box({-0.5, -0.4, -0.5}, {-0.4, 0.4, 0.5});
  append(angle, test::box({-0.4, -0.4, -0.5}, {0.5, 0.4, -0.4}));
  const Drawable drawn = draw_surface(angle, mesh_topology(angle), angle.vertices, {});
  const Tracer tracer = make_tracer(drawn);
  EXPECT_GT(best_view({{&drawn, &tracer}}, 4.0 / 3).azimuth, 0);
}

}  // namespace
}  // namespace flexel::picture
