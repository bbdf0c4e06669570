// What the picture must show, whatever it looks like: areas, places, order in depth, symmetry, colours.
#include "flexel/picture/render/render.h"

#include <gtest/gtest.h>

#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "flexel/picture/canvas/colour_map.h"
#include "scenes.h"

namespace flexel::picture {
namespace {

constexpr std::uint32_t kWhite = 0xffffff;

struct Shot {
  Camera camera;
  Image image;
  double pixels_per_metre;
};

Shot shoot(const Surface& surface, const View& view, int size = 400, const std::vector<double>& values = {},
           float low = 0, float high = 1) {
  const Box box = bounding_box(surface.vertices);
  const DrawingFrame frame{(box.min + box.max) / 2, box.diagonal() / 2};
  Drawable drawn = draw_surface(surface, mesh_topology(surface), surface.vertices, frame);
  ShadeOptions options;
  if (!values.empty()) {
    drawn.values_at = Drawable::ValuesAt::vertices;
    drawn.values.assign(values.begin(), values.end());
    options.by_value = true;
    options.low = low;
    options.high = high;
  }
  Camera camera = camera_towards(view);
  camera.pixels = 0.45f * static_cast<float>(size);
  camera.x = camera.y = static_cast<float>(size) / 2;
  Image image(size, size, colour(kWhite));
  render(image, {0, 0, size, size}, camera, drawn, make_tracer(drawn), options);
  return {camera, image, camera.pixels / frame.radius};
}

// The background is pure white and nothing that is shaded is.
double covered(const Colour& pixel) {
  return pixel == colour(kWhite) ? 0 : 1;
}

TEST(Render, SphereCoversItsDisc) {
  const double radius = 0.013;
  for (const View& view : {View{}, View{10, -70}, View{200, 3}}) {
    const Shot shot = shoot(test::sphere({1, -2, 5}, radius), view);
    double area = 0, x = 0, y = 0;
    for (int v = 0; v < shot.image.height; ++v)
      for (int u = 0; u < shot.image.width; ++u) {
        const double share = covered(shot.image.pixels[shot.image.index(u, v)]);
        area += share;
        x += share * (u + 0.5);
        y += share * (v + 0.5);
      }
    const double r = radius * shot.pixels_per_metre;
    // Pixels on the rim count whole: half a pixel all round.
    EXPECT_NEAR(area, std::numbers::pi * (r + 0.5) * (r + 0.5), 0.02 * area);
    EXPECT_NEAR(x / area, 200, 0.2);
    EXPECT_NEAR(y / area, 200, 0.2);
  }
}

TEST(Render, TellsItsShareToTheEnd) {
  const ThreadLimit alone(1);
  const Surface ball = test::sphere({0, 0, 0}, 1);
  const Drawable drawn = draw_surface(ball, mesh_topology(ball), ball.vertices, {Vec3::Zero(), 1});
  const Tracer tracer = make_tracer(drawn);
  Camera camera = camera_towards(View{});
  camera.pixels = 60;
  camera.x = camera.y = 64;
  Image image(128, 128, colour(kWhite));
  std::vector<double> shares;
  const ShareScope scope([&](double share) { shares.push_back(share); });
  render(image, {0, 0, 128, 128}, camera, drawn, tracer, {});
  EXPECT_GT(shares.size(), 100u);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_DOUBLE_EQ(shares.back(), 1);
}

TEST(Render, TheNearerPartHidesTheFarther) {
  // Two plates of different parts, one behind the other as seen from the front (-y).
  Surface both = test::box({-1, -1, -1}, {0.5, -0.9, 1});
  append(both, test::box({-0.5, 0.9, -1}, {1, 1, 1}));
  const auto tint_at = [](const Shot& shot, double x) {
    const Colour c =
        shot.image.pixels[shot.image.index(static_cast<int>(200 + x * shot.pixels_per_metre), 200)];
    return c.x() > c.z() ? 1 : 0;  // part 0 is bluish, part 1 sandy
  };
  const Shot front = shoot(both, {0, 0}), back = shoot(both, {180, 0});
  EXPECT_EQ(tint_at(front, 0), 0);
  EXPECT_EQ(tint_at(front, -0.7), 0);
  EXPECT_EQ(tint_at(front, 0.7), 1);
  EXPECT_EQ(tint_at(back, 0), 1);
  EXPECT_EQ(tint_at(back, -0.7), 1);
  EXPECT_EQ(tint_at(back, 0.7), 0);
}

TEST(Render, FlatFacesShowTheirValues) {
  Surface box = test::box({-1, -1, -1}, {1, 1, 1});
  for (const double value : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const std::vector<double> values(box.vertices.size(), 3 + 2 * value);
    const Shot shot = shoot(box, {0, 0}, 200, values, 3, 5);
    const Colour seen = to_linear(shot.image.pixels[shot.image.index(100, 100)]),
                 wanted = to_linear(colour_of(static_cast<float>(value)));
    // Lit by some factor, with a little gloss; the hue is that of the map.
    const float factor = seen.dot(wanted) / wanted.squaredNorm();
    EXPECT_GT(factor, 0.4f);
    EXPECT_LT((seen - factor * wanted).norm(), 0.03f) << value;
  }
}

TEST(Render, ValuesRunLinearlyAcrossATriangle) {
  const Surface box = test::box({-1, -1, -1}, {1, 1, 1});
  std::vector<double> values;
  for (const Vec3& v : box.vertices) values.push_back(v.x());
  const Shot shot = shoot(box, {0, 0}, 200, values, -1, 1);
  for (const double x : {-0.8, -0.3, 0.2, 0.9}) {
    const Colour seen =
        to_linear(shot.image.pixels[shot.image.index(static_cast<int>(100 + x * shot.pixels_per_metre), 90)]);
    const Colour wanted = to_linear(colour_of(static_cast<float>((x + 1) / 2)));
    const float factor = seen.dot(wanted) / wanted.squaredNorm();
    EXPECT_LT((seen - factor * wanted).norm(), 0.035f) << x;
  }
}

TEST(Render, NoValueIsGreyAndNeverNaN) {
  const Surface box = test::box({-1, -1, -1}, {1, 1, 1});
  std::vector<double> values(box.vertices.size(), std::nan(""));
  const Shot shot = shoot(box, {30, 20}, 120, values);
  for (const Colour& c : shot.image.pixels) {
    ASSERT_TRUE(c.allFinite());
    EXPECT_LT(c.maxCoeff() - c.minCoeff(), 0.06f);
  }
}

TEST(Render, DegenerateTrianglesDrawNothingWrong) {
  Surface flat =
      test::surface_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 1}}, {{0, 1, 2}, {0, 2, 3}, {1, 1, 2}});
  const Shot shot = shoot(flat, {0, 0}, 100);
  for (const Colour& c : shot.image.pixels) ASSERT_TRUE(c.allFinite());
}

TEST(Render, AnyNumberOfThreadsGivesTheSamePixels) {
  Surface both = test::sphere({0, 0, 0}, 1, 4);
  append(both, test::box({-0.5, -2, -0.5}, {0.5, 2, 0.5}));
  std::vector<Image> images;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    images.push_back(shoot(both, {}, 200).image);
  }
  EXPECT_EQ(images[0].pixels, images[1].pixels);
  EXPECT_EQ(images[0].pixels, images[2].pixels);
}

TEST(Render, ASymmetricPartGivesASymmetricShape) {
  const Shot shot = shoot(test::box({-1, -1, -1}, {1, 1, 1}), {45, 0}, 201);
  // The lamp stands to the left: shades differ, what is covered does not.
  for (int v = 0; v < 201; ++v)
    for (int u = 0; u < 100; ++u)
      EXPECT_EQ(covered(shot.image.pixels[shot.image.index(u, v)]),
                covered(shot.image.pixels[shot.image.index(200 - u, v)]))
          << u << "," << v;
}

TEST(Render, HollowsAreDarkerThanTheOpen) {
  // A floor with two walls that meet in a corner: the floor by the corner gets less light than far from it.
  Surface scene = test::box({-2, -2, -0.1}, {2, 2, 0});
  append(scene, test::box({-2, 1.9, 0}, {2, 2, 2}));
  append(scene, test::box({-2, -2, 0}, {-1.9, 2, 2}));
  const Shot shot = shoot(scene, {0, 60});
  const auto brightness = [&](const Vec3& at) {
    const Box box = bounding_box(scene.vertices);
    const DrawingFrame frame{(box.min + box.max) / 2, box.diagonal() / 2};
    const Eigen::Vector2f p = shot.camera.project(frame.drawn(at));
    return shot.image.pixels[shot.image.index(static_cast<int>(p.x()), static_cast<int>(p.y()))].sum();
  };
  EXPECT_LT(brightness({-1.8, 1.8, 0}), 0.9f * brightness({1.5, -1.5, 0}));
}

}  // namespace
}  // namespace flexel::picture
