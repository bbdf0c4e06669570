// Held and loaded regions that matter goes on beside, their widths, and how far loads sink in there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulate/effects/loads.h"
#include "simulate/effects/supports.h"
#include "simulate/estimate/narrow_region.h"

namespace flexel::simulate {
namespace {

// Nine squares of 1 m in the plane z = 0, the middle one (number 4) at another height, with walls to it.
Surface squares(double height) {
  Surface surface;
  surface.polygon_offsets = {0};
  const auto add = [&](const std::vector<Vec3>& corners) {
    for (const Vec3& corner : corners) {
      surface.polygon_vertices.push_back(static_cast<std::uint32_t>(surface.vertices.size()));
      surface.vertices.push_back(corner);
    }
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(0);
  };
  for (int n = 0; n < 9; ++n) {
    const double x = n % 3, y = n / 3, z = n == 4 ? height : 0;
    add({Vec3(x, y, z), Vec3(x + 1, y, z), Vec3(x + 1, y + 1, z), Vec3(x, y + 1, z)});
  }
  if (height == 0) return surface;
  const std::vector<Vec3> rim = {Vec3(1, 1, 0), Vec3(2, 1, 0), Vec3(2, 2, 0), Vec3(1, 2, 0)};
  const Vec3 rise(0, 0, height);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 &a = rim[i], &b = rim[(i + 1) % 4];
    add({a, b, b + rise, a + rise});
  }
  return surface;
}

std::optional<double> width_alone(const Surface& surface, const std::vector<std::uint32_t>& polygons) {
  return width_amid_matter(surface, polygons, polygons);
}

TEST(NarrowSupport, APatchAndThePitOfAScrewAreAmidMatterAndAnEndIsNot) {
  const std::vector<std::uint32_t> middle = {4};
  EXPECT_DOUBLE_EQ(width_alone(squares(0), middle).value(), 0.5);     // flush
  EXPECT_DOUBLE_EQ(width_alone(squares(-0.4), middle).value(), 0.5);  // at the bottom of a pit
  EXPECT_EQ(width_alone(squares(0.4), middle), std::nullopt) << "the end of a boss";
  std::vector<std::uint32_t> all;
  for (std::uint32_t n = 0; n < 9; ++n) all.push_back(n);
  EXPECT_EQ(width_alone(squares(0), all), std::nullopt) << "nothing goes on beside it";
  // A strip from side to side: flush along six of its eight edges.
  EXPECT_DOUBLE_EQ(width_alone(squares(0), {3, 4, 5}).value(), 0.75);
  // Along one side: three of eight edges.
  EXPECT_DOUBLE_EQ(width_alone(squares(0), {0, 1, 2}).value(), 0.75);
  EXPECT_EQ(width_alone(squares(0), {0, 1, 2, 3, 4, 5, 6, 7}).has_value(), false) << "two of twelve";
  EXPECT_EQ(width_alone(squares(0), {}), std::nullopt);
}

TEST(NarrowSupport, WhatIsHeldBesideItGivesNoWay) {
  const std::vector<std::uint32_t> strip = {3, 4, 5}, all = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  EXPECT_EQ(width_amid_matter(squares(0), strip, all), std::nullopt) << "the other parts of an end";
  EXPECT_DOUBLE_EQ(width_amid_matter(squares(0), {3}, strip).value(), 0.5);  // flush along two of its edges
}

// The squares at one height, the middle one a face of its own.
Body plate(double spacing) {
  Body body;
  body.surface = squares(0);
  body.surface.faces = {{"", 0}, {"", 0}};
  body.surface.polygon_face = {0, 0, 0, 0, 1, 0, 0, 0, 0};
  body.surface.parts = {{"plate"}};
  Part part;
  part.name = "plate";
  part.material = "steel";
  part.lattice.spacing = Vec3::Constant(spacing);
  body.parts = {part};
  return body;
}

TEST(NarrowSupport, IsToldByWhatItIs) {
  Body body = plate(0.4);
  Scene scene;
  Tie tie;
  tie.where = select_by_name("plate/2");
  tie.name = "ring: inner";
  scene.get<Supports>().ties = {tie};
  EXPECT_EQ(
      support_under_two_cells(body, scene),
      "the support \"ring: inner\" is narrow (a strip of its area and rim is 500 mm wide, under two cells)");
  scene.get<Supports>().ties.front().link.emplace();
  EXPECT_THAT(support_under_two_cells(body, scene), ::testing::StartsWith("the rigid link \"ring: inner\""));
  body.parts.front().lattice.spacing = Vec3::Constant(0.25);
  EXPECT_EQ(support_under_two_cells(body, scene), "") << "two cells";
  body.parts.front().lattice.spacing = Vec3::Constant(0.4);
  tie.where = select_by_name("plate/1");
  scene.get<Supports>().ties.push_back(tie);
  EXPECT_EQ(support_under_two_cells(body, scene), "") << "all around it is held too";
}

TEST(NarrowLoad, SinksInAsIntoAHalfSpaceAsFarAsItsCellsSpreadIt) {
  const auto found = [](double spacing, const Load& load) {
    Scene scene;
    scene.material = "steel";
    scene.get<Loads>().loads = {load};
    return indentations_under_two_cells(plate(spacing), scene);
  };
  Load load;
  load.where = select_by_name("plate/2");
  load.name = "thumb";
  load.force = Vec3(0, 3e6, -4e6);
  const Material& steel = *library_material("steel");
  const double on_half_space = 1.122 * (1 - steel.poisson * steel.poisson) * 5e6 / steel.young;
  for (const double spacing : {0.3, 0.5, 20.0}) {
    const auto depths = found(spacing, load);
    ASSERT_EQ(depths.size(), 1) << spacing;
    EXPECT_EQ(depths[0].load, "thumb");
    EXPECT_EQ(depths[0].polygons, std::vector<std::uint32_t>{4});
    EXPECT_DOUBLE_EQ(depths[0].width, 0.5);
    EXPECT_NEAR(depths[0].depth, on_half_space * spacing / (0.5 + spacing), 1e-12 * on_half_space);
  }
  EXPECT_TRUE(found(0.25, load).empty()) << "two cells";
  Load pressure = load;
  pressure.force.reset();
  pressure.pressure = -5e6;  // on 1 m^2
  EXPECT_NEAR(found(0.5, pressure).at(0).depth, on_half_space / 2, 1e-12 * on_half_space);
  Load couple = load;
  couple.force.reset();
  couple.torque = Vec3(0, 0, 1);
  EXPECT_TRUE(found(0.5, couple).empty());
  // Several loads on it act together; what is pushed beside it by less goes on.
  Scene two;
  two.material = "steel";
  Load beside = load;
  beside.where = select_by_name("plate/1");
  beside.force = Vec3(0, 0, -8e6);  // on 8 m^2
  two.get<Loads>().loads = {load, load, beside};
  const auto together = indentations_under_two_cells(plate(0.5), two);
  ASSERT_EQ(together.size(), 1);
  EXPECT_NEAR(together[0].depth, 2 * on_half_space / 2, 1e-12 * on_half_space);
  *two.get<Loads>().loads[2].force *= 6;
  EXPECT_TRUE(indentations_under_two_cells(plate(0.5), two).empty());
  load.where.kind = Selection::Kind::any_of;
  load.where.members = {select_by_name("plate/1"), select_by_name("plate/2")};
  EXPECT_TRUE(found(0.5, load).empty()) << "nothing goes on beside it";
}

}  // namespace
}  // namespace flexel::simulate
