// What the report says of triangles, volume, the surface passing through itself, and Voronoi neighbours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include "base/error.h"
#include "mapping/methods/bind.h"
#include "mapping/report/attributes.h"
#include "mapping/report/quality.h"
#include "mapping/report/report.h"
#include "motions.h"

namespace flexel::mapping {
namespace {

MapReport mapped(const Body& body, const MapOptions& options = {}) {
  Progress progress("test", Progress::Mode::quiet);
  return report(body, map_surface(body, options, progress));
}

TEST(Quality, ARigidMotionChangesNothing) {
  Body body = test::block(4, 4, 4, 0.1, Placement::corner);
  test::deform(body, test::turn);
  const MapReport found = mapped(body);
  EXPECT_EQ(found.quality.flipped + found.quality.folded, 0u);
  EXPECT_NEAR(found.quality.smallest_angle_after, 45, 1e-6);
  EXPECT_NEAR(found.quality.area_after, 6 * 0.397 * 0.397, 1e-12);
  EXPECT_LT(found.quality.largest_normal_jump_added, 1e-6);
  EXPECT_LT(found.largest_strain, 1e-12);
  EXPECT_NEAR(found.lattice_volume_before, 0.064, 1e-15);
  EXPECT_NEAR(found.lattice_volume_after, 0.064, 1e-14);
}

TEST(Quality, StretchAndShearAreMeasured) {
  Body body = test::block(4, 4, 4, 0.1, Placement::corner);
  test::deform(body, [](const Vec3& x) -> Vec3 { return {2 * x.x(), 3 * x.y(), 0.5 * x.z()}; });
  const MapReport found = mapped(body);
  EXPECT_NEAR(found.largest_strain, 2, 1e-9);
  EXPECT_NEAR(found.lattice_volume_after, 3 * 0.064, 1e-12);
  EXPECT_NEAR(found.quality.volume_after / found.quality.volume_before, 3, 1e-9);
  EXPECT_NEAR(found.quality.smallest_angle_after, std::atan(0.5 / 3) * 180 / M_PI, 1e-6);
}

TEST(Quality, TheVolumeOfABentLatticeIsThatOfItsCells) {
  Body body = test::block(6, 3, 3, 0.1, Placement::corner);
  test::deform(body, [](const Vec3& x) -> Vec3 {
    return {x.x(), x.y() + 0.3 * x.x() * x.z(), x.z() * (1 + x.y())};
  });
  // The determinant is 1 + y + 0.3 x z (-0): integrated by a fine sum.
  double sum = 0;
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j)
      for (int k = 0; k < kSteps; ++k) {
        const Vec3 x = Vec3(0.6 * (i + 0.5), 0.3 * (j + 0.5), 0.3 * (k + 0.5)) / kSteps;
        Mat3 gradient;
        gradient << 1, 0, 0, 0.3 * x.z(), 1, 0.3 * x.x(), 0, x.z(), 1 + x.y();
        sum += gradient.determinant() * 0.6 * 0.3 * 0.3 / (kSteps * kSteps * kSteps);
      }
  EXPECT_NEAR(lattice_volume(body).after, sum, 1e-6);
}

TEST(Quality, TrianglesTurnedOverAreCounted) {
  // A frame of gram-schmidt does not stretch: squeezed to a tenth, sharp folds appear.
  Body body = test::block(6, 6, 6, 0.1, Placement::corner, 40);
  test::deform(body, [](const Vec3& x) -> Vec3 { return {0.05 * x.x(), x.y(), x.z()}; });
  EXPECT_GT(mapped(body, {&kGramSchmidt}).quality.flipped, 0u);
  EXPECT_EQ(mapped(body, {&kBlended}).quality.flipped, 0u);
}

// Two blocks, bound by nothing: one is pushed through the other.
TEST(Intersection, OnlyNewOnesAreCounted) {
  Body body = test::block(3, 3, 3, 0.1, Placement::corner, 4);
  Body other = test::block(3, 3, 3, 0.1, Placement::corner, 4);
  const Vec3 apart(0.5, 0.01, 0.02);
  for (Vec3& x : other.rest) x += apart;
  for (Vec3& x : other.surface.vertices) x += apart;
  other.parts[0].lattice.origin += apart;
  other.position = other.rest;
  test::append_body(body, other);
  MapOptions options;
  options.check_intersection = true;
  EXPECT_EQ(mapped(body, options).new_meetings->between, 0u);
  EXPECT_FALSE(mapped(body).new_meetings.has_value());
  for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
    body.position[e] -= Vec3(0.35, 0, 0);
  const MapReport found = mapped(body, options);
  EXPECT_GT(found.new_meetings->through, 8u);
  EXPECT_EQ(found.new_meetings->self, 0u);
  EXPECT_FALSE(found.valid());
  EXPECT_NE(report_lines(found).front().find("pass through each other"), std::string::npos);
  // The same state at rest already: nothing is new.
  for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
    body.rest[e] = body.position[e];
  for (std::size_t v = body.surface.vertices.size() / 2; v < body.surface.vertices.size(); ++v)
    body.surface.vertices[v] -= Vec3(0.35, 0, 0);
  body.parts[1].lattice.origin -= Vec3(0.35, 0, 0);
  EXPECT_EQ(mapped(body, options).new_meetings->between, 0u);
}

// A bar that is rolled up over its own beginning.
TEST(Intersection, OfAPartWithItself) {
  Body body = test::block(40, 2, 2, 0.1, Placement::corner, 4);
  MapOptions options;
  options.check_intersection = true;
  const auto rolled = [&](double turns) {
    test::deform(body, [&](const Vec3& x) -> Vec3 {
      const double angle = 2 * std::numbers::pi * turns * x.x() / 4, radius = 0.6 + x.y();
      return {radius * std::sin(angle), radius * std::cos(angle), x.z()};
    });
    return *mapped(body, options).new_meetings;
  };
  EXPECT_EQ(rolled(0.9).self, 0u);
  EXPECT_GT(rolled(1.05).self, 0u);
  EXPECT_EQ(rolled(1.05).between, 0u);
  EXPECT_FALSE(mapped(body, options).valid());
}

// Pressed in as contact does, two parts touch; deeper ones have passed through each other.
TEST(Intersection, PartsThatTouchAreToldFromThoseThatPass) {
  const Vec3 apart(0.35, 0.01, 0.02);
  const auto pressed = [&](int fine, double depth) {
    Body body = test::block(3, 3, 3, 0.1, Placement::corner, fine);
    Body other = test::block(3, 3, 3, 0.1, Placement::corner, fine);
    for (Vec3& x : other.rest) x += apart;
    for (Vec3& x : other.surface.vertices) x += apart;
    other.parts[0].lattice.origin += apart;
    other.position = other.rest;
    const double gap =
        bounding_box(other.surface.vertices).min.x() - bounding_box(body.surface.vertices).max.x();
    test::append_body(body, other);
    MapOptions options;
    options.check_intersection = true;
    for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
      body.position[e] -= Vec3(gap + depth, 0, 0);
    return mapped(body, options);
  };
  for (const int fine : {4, 15}) {  // triangles of .75 and of a fifth of a spacing
    const MapReport touching = pressed(fine, 0.005);
    EXPECT_TRUE(touching.valid());
    EXPECT_GT(touching.new_meetings->between, 0u);
    EXPECT_NEAR(touching.new_meetings->deepest, 0.005, 1e-6);
    const MapReport through = pressed(fine, 0.03);
    EXPECT_FALSE(through.valid());
    EXPECT_NEAR(through.new_meetings->deepest, 0.03, 1e-6);
  }
}

// Into the hole of an open part goes what does not touch its walls: there only triangles tell how deep.
TEST(Intersection, AnOpenSurfaceHasNoInside) {
  const Vec3 apart(0.35, 0.01, 0.02);
  Body body = test::block(3, 3, 3, 0.1, Placement::corner, 15);
  Body cup = test::block(3, 3, 3, 0.1, Placement::corner, 15);
  for (Vec3& x : cup.rest) x += apart;
  for (Vec3& x : cup.surface.vertices) x += apart;
  cup.parts[0].lattice.origin += apart;
  cup.position = cup.rest;
  const double rim = bounding_box(cup.surface.vertices).min.x();
  Surface& surface = cup.surface;
  const Surface whole = surface;
  surface.polygon_offsets = {0};
  surface.polygon_vertices.clear();
  surface.polygon_face.clear();
  for (std::size_t p = 0; p < whole.polygon_count(); ++p) {
    const auto corners = whole.polygon(p);
    if (std::all_of(corners.begin(), corners.end(),
                    [&](std::uint32_t v) { return whole.vertices[v].x() == rim; }))
      continue;
    surface.polygon_vertices.insert(surface.polygon_vertices.end(), corners.begin(), corners.end());
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(whole.polygon_face[p]);
  }
  ASSERT_LT(surface.polygon_count(), whole.polygon_count());
  const double gap = rim - bounding_box(body.surface.vertices).max.x();
  test::append_body(body, cup);
  MapOptions options;
  options.check_intersection = true;
  for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
    body.position[e] -= Vec3(gap + 0.005, 0, 0);
  const MapReport found = mapped(body, options);
  EXPECT_GT(found.new_meetings->between, 0u);
  EXPECT_EQ(found.new_meetings->through, 0u);
  EXPECT_NEAR(found.new_meetings->deepest, 0.005, 1e-6);
}

TEST(VoronoiCheck, TiesOfTheLatticeDoNotCountAndShearDoes) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = test::block(6, 5, 4, 0.1, placement, 6);
    MapOptions options;
    options.check_voronoi = true;
    const auto changed = [&](const test::Field& field) {
      test::deform(body, field);
      return *mapped(body, options).voronoi_changed;
    };
    EXPECT_EQ(mapped(body).voronoi_changed, std::nullopt);
    EXPECT_EQ(changed([](const Vec3& x) { return x; }), 0u);
    EXPECT_EQ(changed(test::turn), 0u);
    EXPECT_EQ(changed([](const Vec3& x) -> Vec3 { return {x.x() + 0.015 * x.y(), x.y(), x.z()}; }), 0u);
    EXPECT_GT(changed([](const Vec3& x) -> Vec3 { return {x.x() + 0.022 * x.y(), x.y(), x.z()}; }), 0u);
    EXPECT_GT(changed([](const Vec3& x) -> Vec3 { return {x.x() + 0.5 * x.y(), x.y(), x.z()}; }), 100u);
    // Bent to a radius of 100, twisted by .002 in all: strains of some .2 %. Facets at the rim, which have no
    // end, stay what they are.
    EXPECT_EQ(changed([](const Vec3& x) -> Vec3 {
                const double angle = x.x() / 100;
                return {(100 - x.z()) * std::sin(angle), x.y(), 100 - (100 - x.z()) * std::cos(angle)};
              }),
              0u);
    EXPECT_EQ(changed([](const Vec3& x) -> Vec3 {
                const Vec3 turned = Eigen::AngleAxisd(0.002 * x.x() / 0.6, Vec3::UnitX()) * x;
                return turned;
              }),
              0u);
    EXPECT_TRUE(mapped(body, options).valid());
  }
}

TEST(Options, AreReadOrRefused) {
  MapOptions options;
  add_checks(options, "voronoi,self-intersection");
  EXPECT_TRUE(options.check_voronoi && options.check_intersection);
  EXPECT_THROW(add_checks(options, "voronoy"), InputError);
  EXPECT_THROW(add_checks(options, ""), InputError);
  EXPECT_EQ(far_vertices("rigid"), FarVertices::rigid);
  EXPECT_THROW((void)far_vertices("rigidly"), InputError);
  for (const MapMethod method : test::kEveryMethod) EXPECT_EQ(map_method(name_of(method)), method);
  EXPECT_THROW((void)map_method("smoth"), InputError);
}

TEST(Attributes, HoldWhatIsKnownOfEachVertex) {
  Body body = test::block(4, 4, 4, 0.1, Placement::corner);
  test::deform(body, [](const Vec3& x) -> Vec3 { return {1.2 * x.x(), x.y(), x.z()}; });
  Progress progress("test", Progress::Mode::quiet);
  const Columns columns = vertex_attributes(body.surface, body, map_surface(body, {}, progress));
  check_columns(columns, body.surface.vertices.size(), "vertex_columns", "test");
  EXPECT_EQ(columns.at("displacement").components, 3);
  for (const double value : columns.at("stretch").values) EXPECT_NEAR(value, 0.2, 1e-9);
  for (const double value : columns.at("frame_kind").values) EXPECT_EQ(value, 0);
  for (const double value : columns.at("rest_residual").values) EXPECT_LT(value, 1e-15);
  EXPECT_EQ(columns.count("voronoi_changed"), 0u);
}

}  // namespace
}  // namespace flexel::mapping
