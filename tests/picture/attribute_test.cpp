// Values of bodies: strain of known deformations, and their way to the vertices.
#include "flexel/picture/attribute.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../mapping/bodies.h"
#include "flexel/picture/lattice_drawable.h"
#include "scenes.h"

namespace flexel::picture {
namespace {

TEST(Attributes, StrainOfAStretchIsTwoThirdsOfItsLogarithm) {
  for (const Placement placement : {Placement::corner, Placement::centre})
    for (const double stretch : {0.8, 1.0, 1.001, 1.7}) {
      Body body = mapping::test::block(4, 3, 2, 0.01, placement);
      const Mat3 turn = mapping::test::rotation(1.1, Vec3(1, 2, 3).normalized());
      mapping::test::deform(body, [&](const Vec3& x) {
        return Vec3(turn * Vec3(stretch * x.x(), x.y(), x.z()) + Vec3(5, 6, 7));
      });
      for (const double value : strain(body).values)
        EXPECT_NEAR(value, 2.0 / 3 * std::abs(std::log(stretch)), 1e-9);
    }
}

TEST(Attributes, ChangeOfVolumeAloneIsNoEquivalentStrain) {
  Body body = mapping::test::block(3, 3, 3, 0.01, Placement::corner);
  mapping::test::deform(body, [](const Vec3& x) { return Vec3(1.3 * x); });
  for (const double value : strain(body).values) EXPECT_NEAR(value, 0, 1e-9);
}

TEST(Attributes, AnInvertedCellHasNoStrain) {
  Body body = mapping::test::block(2, 2, 2, 0.01, Placement::corner);
  mapping::test::deform(body, [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); });
  for (const double value : strain(body).values) EXPECT_TRUE(std::isnan(value));
}

TEST(Attributes, LinearValuesOfElementsAreExactAtVertices) {
  Body body = mapping::test::block(4, 3, 2, 0.01, Placement::corner);
  Column column{1, {}};
  const auto value = [](const Vec3& x) { return 3 + 40 * x.x() - 20 * x.y() + 7 * x.z(); };
  for (const Vec3& x : body.rest) column.values.push_back(value(x));
  body.element_columns["warmth"] = column;
  const auto attribute = body_attribute(body, "warmth");
  ASSERT_TRUE(attribute);
  const std::vector<double> at =
      at_vertices(body, *attribute, std::vector<std::uint32_t>(body.surface.vertices.size(), 0));
  for (std::size_t v = 0; v < at.size(); ++v) EXPECT_NEAR(at[v], value(body.surface.vertices[v]), 1e-9);
}

TEST(Attributes, NamesAndComponents) {
  Body body = mapping::test::block(2, 2, 2, 0.01, Placement::corner);
  body.element_columns["velocity"] = {3, std::vector<double>(3 * body.element_count(), 2)};
  EXPECT_NEAR(body_attribute(body, "velocity")->values.at(0), std::sqrt(12.0), 1e-12);
  EXPECT_EQ(body_attribute(body, "velocity.y")->values.at(0), 2);
  EXPECT_EQ(body_attribute(body, "velocity.2")->values.at(0), 2);
  EXPECT_FALSE(body_attribute(body, "velocity.3"));
  EXPECT_FALSE(body_attribute(body, "speed"));
  EXPECT_EQ(body_attribute(body, "fill")->values, body.fill);
}

TEST(Lattice, TheHullOfABlockIsItsOutside) {
  const Body body = mapping::test::block(4, 3, 2, 0.01, Placement::corner);
  const CellHull hull = draw_cells(body, body.position, {Vec3::Zero(), 1});
  EXPECT_EQ(hull.drawn.triangles.size(), 2u * 2 * (4 * 3 + 3 * 2 + 2 * 4));
  std::vector<Vec3> vertices;
  for (const Vec3f& v : hull.drawn.vertices) vertices.push_back(v.cast<double>());
  EXPECT_NEAR(signed_volume(vertices, hull.drawn.triangles), 4 * 3 * 2 * 1e-6, 1e-11);
}

TEST(Lattice, BrokenCellsLeaveAGap) {
  Body body = mapping::test::block(5, 2, 2, 0.01, Placement::corner);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    body.broken[c] = body.lattice_index[body.cell_elements[c][0]][0] == 2 ? 1 : 0;
  // two blocks of 2 x 2 x 2
  EXPECT_EQ(draw_cells(body, body.position, {Vec3::Zero(), 1}).drawn.triangles.size(), 2u * 2 * 6 * 4);
  body.broken.assign(body.cell_count(), 1);
  EXPECT_EQ(draw_cells(body, body.position, {Vec3::Zero(), 1}).drawn.triangles.size(),
            2u * 2 * (10 + 4 + 10));
}

TEST(Picture, TheDeformedBodyIsDrawnWhereItIs) {
  // A block that is moved to the right by its own length: the shading follows, the outline stays.
  PictureSubject moved = test::subject({}, "body");
  moved.body = mapping::test::block(6, 3, 3, 0.01, Placement::corner);
  mapping::test::deform(*moved.body, [](const Vec3& x) { return Vec3(x + Vec3(0.12, 0, 0)); });
  PictureOptions options;
  options.width = 600;
  options.height = 300;
  options.view = View{0, 0};
  options.colour = "none";
  const Image with = test::picture({moved}, options);
  const auto ink = [](const Image& image, int from, int to) {
    double sum = 0;
    for (int y = 0; y < 200; ++y)
      for (int x = from; x < to; ++x)
        sum += (image.pixels[image.index(x, y)] - image.pixels.front()).norm() > 0.15f;
    return sum;
  };
  EXPECT_GT(ink(with, 320, 600), 10 * ink(with, 0, 280));
  EXPECT_GT(ink(with, 0, 280), 100);
  options.outline_at_rest = false;
  const Image without = test::picture({moved}, options);
  EXPECT_GT(ink(without, 200, 400), 5000);
}

}  // namespace
}  // namespace flexel::picture
