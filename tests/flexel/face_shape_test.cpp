// Flat, round and curved faces, in any direction and place.
#include "flexel/measure/face_shape.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace flexel::commands {
namespace {

// A patch z = f(u, v) of n x n quads, mapped by `place`.
Surface patch(int n, const std::function<Vec3(double, double)>& place) {
  Surface surface;
  surface.parts.push_back({"part"});
  surface.faces.push_back({"", 0});
  surface.polygon_offsets.push_back(0);
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) surface.vertices.push_back(place(double(i) / n, double(j) / n));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      for (const auto& [a, b] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
        surface.polygon_vertices.push_back(static_cast<std::uint32_t>((i + a) * (n + 1) + j + b));
      surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
      surface.polygon_face.push_back(0);
    }
  return surface;
}

const Mat3 kTurn = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
const Vec3 kShift(10, -20, 5);

TEST(FaceShape, FlatFacesGiveNormalAreaAndCentroid) {
  const auto shape = face_shapes(
      patch(4, [](double u, double v) -> Vec3 { return kTurn * Vec3(2 * u, 3 * v, 0) + kShift; }))[0];
  EXPECT_EQ(shape.kind, FaceShape::Kind::flat);
  EXPECT_LT((shape.normal - kTurn.col(2)).norm(), 1e-12);
  EXPECT_NEAR(shape.area, 6, 1e-12);
  EXPECT_LT((shape.centroid - (kTurn * Vec3(1, 1.5, 0) + kShift)).norm(), 1e-12);
  EXPECT_EQ(shape.polygons, 16u);
}

TEST(FaceShape, PartsOfCylindersGiveAxisRadiusAndSide) {
  for (const double angle : {0.5, 3.0, 2 * M_PI})
    for (const bool hollow : {false, true}) {
      const auto shape = face_shapes(patch(24, [&](double u, double v) -> Vec3 {
        const double a = angle * (hollow ? 1 - u : u);
        return kTurn * Vec3(0.3 * std::cos(a), 0.3 * std::sin(a), v) + kShift;
      }))[0];
      ASSERT_EQ(shape.kind, FaceShape::Kind::round);
      EXPECT_NEAR(std::abs(shape.axis.dot(kTurn.col(2))), 1, 1e-9);
      EXPECT_NEAR(shape.radius, 0.3, 1e-9);
      EXPECT_EQ(shape.hollow, hollow);
      EXPECT_NEAR(shape.angle, angle, 0.02);
      EXPECT_EQ(shape.is_hole(), hollow && angle > 6);
      EXPECT_LT((shape.axis_point - kShift).cross(shape.axis).norm(), 1e-9);
    }
}

// Rings of corners, each turned by half a step against the one below: no triangle of the cylinder is
// parallel to its axis.
TEST(FaceShape, ARemeshedCylinderIsRound) {
  constexpr int kSides = 16, kRings = 5;
  Surface surface;
  surface.parts.push_back({"part"});
  surface.faces.push_back({"", 0});
  surface.polygon_offsets.push_back(0);
  for (int j = 0; j < kRings; ++j)
    for (int i = 0; i < kSides; ++i) {
      const double a = 2 * M_PI * (i + 0.5 * j) / kSides;
      surface.vertices.push_back(kTurn * Vec3(0.3 * std::cos(a), 0.3 * std::sin(a), 0.1 * j) + kShift);
    }
  const auto add = [&](int a, int b, int c) {
    for (const int v : {a, b, c}) surface.polygon_vertices.push_back(static_cast<std::uint32_t>(v));
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(0);
  };
  for (int j = 0; j + 1 < kRings; ++j)
    for (int i = 0; i < kSides; ++i) {
      const int next = (i + 1) % kSides, low = j * kSides, high = low + kSides;
      add(low + i, high + i, low + next);
      add(low + next, high + i, high + next);
    }
  const FaceShape shape = face_shapes(surface)[0];
  ASSERT_EQ(shape.kind, FaceShape::Kind::round);
  EXPECT_TRUE(shape.is_hole());
  EXPECT_NEAR(std::abs(shape.axis.dot(kTurn.col(2))), 1, 1e-5);
  EXPECT_NEAR(shape.radius, 0.3, 1e-3);
}

// A hole that the CAD program cut into two faces, and two hollows of half a circle that lie one behind the
// other.
TEST(FaceShape, TwoHalvesAreAHoleOnlyWhereTheyLieSideBySide) {
  for (const double shift : {0.0, 2.0}) {
    Surface surface;
    for (int half = 0; half < 2; ++half) {
      const Surface more = patch(24, [&](double u, double v) -> Vec3 {
        const double a = M_PI * (1 - u + half);
        return {0.3 * std::cos(a), 0.3 * std::sin(a), v + half * shift};
      });
      const auto base = static_cast<std::uint32_t>(surface.vertices.size());
      surface.vertices.insert(surface.vertices.end(), more.vertices.begin(), more.vertices.end());
      if (half == 0) surface.polygon_offsets = {0};
      for (std::size_t p = 0; p < more.polygon_count(); ++p) {
        for (const std::uint32_t v : more.polygon(p)) surface.polygon_vertices.push_back(base + v);
        surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
        surface.polygon_face.push_back(static_cast<std::uint32_t>(half));
      }
      surface.faces.push_back({"", 0});
    }
    surface.parts = {{"part"}};
    for (const FaceShape& shape : face_shapes(surface)) {
      EXPECT_TRUE(shape.hollow);
      EXPECT_NEAR(shape.angle, M_PI, 0.02);
      EXPECT_EQ(shape.is_hole(), shift == 0);
    }
  }
}

TEST(FaceShape, OthersAreCurved) {
  const auto ball = [](double u, double v) -> Vec3 {
    return {std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v)};
  };
  const auto cone = [](double u, double v) -> Vec3 {
    return {(1 + v) * std::cos(u), (1 + v) * std::sin(u), v};
  };
  const auto ellipse = [](double u, double v) -> Vec3 { return {2 * std::cos(3 * u), std::sin(3 * u), v}; };
  for (const auto& place : {std::function<Vec3(double, double)>(ball), {cone}, {ellipse}})
    EXPECT_EQ(face_shapes(patch(24, place))[0].kind, FaceShape::Kind::curved);
}

// Of a height at which the corners lie within a hundredth of one circle all the same.
TEST(FaceShape, SlightConesAndBarrelsAreCurved) {
  const double slope = std::tan(4 * M_PI / 180), height = 0.2;
  for (const bool hollow : {false, true})
    for (const double angle : {1.0, 2 * M_PI}) {
      const auto turned = [&](const std::function<double(double)>& radius) {
        return face_shapes(patch(48, [&](double u, double v) -> Vec3 {
          const double a = angle * (hollow ? 1 - u : u), r = radius(height * (v - 0.5));
          return kTurn * Vec3(r * std::cos(a), r * std::sin(a), height * v) + kShift;
        }))[0];
      };
      EXPECT_EQ(turned([](double) { return 1; }).kind, FaceShape::Kind::round);
      // a sixth of a cone this slight is, as well, one of a cylinder that is tilted
      if (angle > M_PI) {
        EXPECT_EQ(turned([&](double z) { return 1 + slope * z; }).kind, FaceShape::Kind::curved);
      }
      EXPECT_EQ(turned([&](double z) { return 1 - slope * z * z / height; }).kind, FaceShape::Kind::curved);
    }
}

TEST(FaceShape, InWords) {
  FaceShape shape;
  shape.kind = FaceShape::Kind::flat;
  shape.normal = -Vec3::UnitY();
  EXPECT_EQ(describe(shape, 1e-3, "mm"), "flat, normal -y");
  shape.kind = FaceShape::Kind::round;
  shape.axis = Vec3::UnitX();
  shape.radius = 4e-3;
  shape.hollow = true;
  shape.angle = M_PI / 2;
  EXPECT_EQ(describe(shape, 1e-3, "mm"), "round, fillet of radius 4 mm (90 degrees) along x");
  shape.angle = M_PI;
  EXPECT_EQ(describe(shape, 1e-3, "mm"), "round, hollow of radius 4 mm (180 degrees) along x");
  shape.closed = true;
  EXPECT_EQ(describe(shape, 1e-3, "mm"), "round, hole of diameter 8 mm along x");
  shape.hollow = false;
  EXPECT_EQ(describe(shape, 1e-3, "mm"), "round, outside of diameter 8 mm along x");
  shape.closed = false;
  shape.angle = 0.5;
  EXPECT_EQ(describe(shape, 1e-3, "mm"), "round, rounded edge of radius 4 mm (29 degrees) along x");
  EXPECT_EQ(direction_name(Vec3(1, 0, 1).normalized()), "(0.707, 0, 0.707)");
}

}  // namespace
}  // namespace flexel::commands
