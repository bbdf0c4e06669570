// Parts that are selected by the assemblies which hold them.
#include "simulate/input/selection.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate::testing {
namespace {

using ::testing::HasSubstr;

// Three boxes side by side: two in assemblies, one in none.
Body machine() {
  const char* names[] = {"bolt", "bolt-2", "plate"};
  const char* assemblies[] = {"machine/joint", "machine/joint-2", ""};
  Body all;
  for (int b = 0; b < 3; ++b) {
    Body box = box_body({.cells = {2, 1, 1},
                         .spacing = Vec3::Constant(0.01),
                         .origin = Vec3(0.1 * b, 0, 0),
                         .name = names[b]});
    box.surface.parts[0].assembly = assemblies[b];
    if (b == 0)
      all = std::move(box);
    else
      append(all, std::move(box));
  }
  return all;
}

std::size_t elements(const Body& body, const char* name) {
  return resolve(select_by_name(name), body).elements.size();
}

std::string why(const Body& body, const char* name) {
  try {
    static_cast<void>(resolve(select_by_name(name), body));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Selection, AnAssemblyIsAllItsParts) {
  const Body body = machine();
  const std::size_t one = elements(body, "bolt");
  EXPECT_EQ(one, 12u);
  EXPECT_EQ(elements(body, "machine"), 2 * one);
  EXPECT_EQ(elements(body, "machine/joint"), one);
  EXPECT_EQ(elements(body, "joint-2"), one);
  EXPECT_EQ(elements(body, "machine/joint-2/bolt-2"), one);
  EXPECT_EQ(elements(body, "joint/bolt"), one);
}

TEST(Selection, AWordAfterAPathIsAFaceOrASide) {
  const Body body = machine();
  EXPECT_EQ(resolve(select_by_name("machine/xmax"), body).polygons,
            resolve(select_by_name("bolt-2/xmax"), body).polygons);
  EXPECT_EQ(resolve(select_by_name("joint-2/1"), body).polygons,
            resolve(select_by_name("bolt-2/1"), body).polygons);
  EXPECT_EQ(resolve(select_by_name("joint/bolt/x1"), body).polygons,
            resolve(select_by_name("bolt/x1"), body).polygons);
  EXPECT_TRUE(side_axis(select_by_name("machine/zmin"), body).has_value());
}

TEST(Selection, ANameOfTwoThingsIsRefused) {
  Body body = machine();
  body.surface.parts[2].assembly = "bolt";  // an assembly called as a part is
  EXPECT_THAT(why(body, "bolt"), HasSubstr("a part and an assembly; write \"=bolt\""));
  EXPECT_EQ(elements(body, "=bolt"), 12u);
  body.surface.faces[0].name = "joint";  // a face called as an assembly is
  EXPECT_THAT(why(body, "joint"), HasSubstr("an assembly or part, and a side, face or group"));
  EXPECT_THAT(why(body, "machine/joint"), HasSubstr("means two things"));
  EXPECT_EQ(resolve(select_by_name("=joint"), body).polygons.size(), 1u);
  body.surface.parts[2].assembly = "xmin";
  EXPECT_THAT(why(body, "xmin"), HasSubstr("means two things"));
}

TEST(Selection, WhatAnAssemblyDoesNotHaveIsToldWithWhatItHas) {
  const Body body = machine();
  EXPECT_THAT(why(body, "machine/1"), HasSubstr("\"machine\" is 2 parts: name one of them, as bolt/1"));
  EXPECT_THAT(why(body, "joint/9"), HasSubstr("part \"bolt\" has faces 1 to 6"));
  EXPECT_THAT(why(body, "machin"), HasSubstr("did you mean \"machine\""));
  EXPECT_NE(why(body, "chine/joint"), "");
  EXPECT_NE(why(body, "joint/plate"), "");
}

// Lattices' planes are where parts begin and end, and so where users' boxes do: rounding decides nothing.
TEST(Selection, ARegionHoldsElementsOnItsBorder) {
  for (const double spacing : {0.0025, 0.1 / 3, 7e-9, 300.0})
    for (const double away : {0.0, 0.1, 1e4})
      for (int turn = 0; turn < 4; ++turn) {
        const Mat3 axes(Eigen::AngleAxisd(turn * std::numbers::pi / 2, Vec3::UnitZ()));
        const Vec3 origin = spacing * away * Vec3(1.1, -0.7, 0.3);
        const Body body = box_body(
            {.cells = {6, 4, 3}, .spacing = Vec3::Constant(spacing), .origin = origin, .axes = axes});
        const Lattice& lattice = body.parts[0].lattice;
        const Vec3 one = lattice.to_world(Vec3(1, 0, 1)), other = lattice.to_world(Vec3(4, 4, 3));
        Selection region;
        region.kind = Selection::Kind::box;
        region.min = one.cwiseMin(other) * (1 + 1e-15);
        region.max = one.cwiseMax(other) * (1 - 1e-15);
        EXPECT_EQ(resolve(region, body).elements.size(), 4u * 5 * 3) << spacing << " " << away << " " << turn;
        region.kind = Selection::Kind::half_space;
        region.point = lattice.to_world(Vec3(4, 1.7, 1.1));
        region.normal = axes * Vec3(1, 0, 0);
        EXPECT_EQ(resolve(region, body).elements.size(), 3u * 5 * 4);
        region.kind = Selection::Kind::sphere;
        region.point = lattice.to_world(Vec3(2, 2, 1));
        region.radius = std::sqrt(2.0) * spacing * (1 - 1e-15);
        EXPECT_EQ(resolve(region, body).elements.size(), 19u);
        region.radius = 1.4 * spacing;  // and no more than those on it
        EXPECT_EQ(resolve(region, body).elements.size(), 7u);
      }
}

}  // namespace
}  // namespace flexel::simulate::testing
