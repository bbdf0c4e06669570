// What people write after --push and --move.
#include "flexel/actions.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace flexel::commands {
namespace {

TEST(Actions, ThreeComponentsAndOneUnit) {
  for (const char* text :
       {"xmax: 1 -2.5 30 N", "xmax:1,-2.5,30 N", "xmax: [1, -2.5, 30] N", "xmax : +1 -2.5 30N"}) {
    const Action action = parse_push(text);
    EXPECT_EQ(action.where, "xmax") << text;
    ASSERT_TRUE(action.vector) << text;
    EXPECT_EQ(*action.vector, Vec3(1, -2.5, 30)) << text;
    EXPECT_FALSE(action.along || action.pressure);
  }
  EXPECT_EQ(*parse_move("part/3: 0 0 -2 mm").vector, Vec3(0, 0, -2e-3));
  EXPECT_EQ(*parse_push("a: 0 0 1e-3 kN").vector, Vec3(0, 0, 1));
}

TEST(Actions, OneNumberGoesAlongTheInwardNormalAndAPressureIsAPressure) {
  EXPECT_EQ(*parse_push("part/3: 50 N").along, 50);
  EXPECT_EQ(*parse_push("part/3: 2 MPa").pressure, 2e6);
  EXPECT_FALSE(parse_push("part/3: 2 MPa").along);
  EXPECT_EQ(*parse_move("part/3: -2 mm").along, -2e-3);
}

TEST(Actions, TheLastColonEndsWhere) {
  EXPECT_EQ(parse_push("a:b/3: 50 N").where, "a:b/3");
  const std::string region = "{ sphere = { centre = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"5 mm\" } }";
  EXPECT_EQ(parse_push(region + ": 0 0 1 N").where, region);
}

TEST(Actions, WhatCannotBeReadIsRefusedWithAnExample) {
  for (const char* text :
       {"xmax", "xmax 50 N", ": 50 N", "xmax:", "xmax: 1 2 N", "xmax: 1 2 3 4 N", "xmax: 50", "xmax: 50 mm",
        "xmax: N", "xmax: 1e999 N", "xmax: nan N", "xmax: 1 2 three N"}) {
    try {
      static_cast<void>(parse_push(text));
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("--push"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(static_cast<void>(parse_move("xmax: 2 N")), InputError);
  EXPECT_THROW(static_cast<void>(parse_move("xmax: 2 MPa")), InputError);
}

// A body of one triangle pair is enough for normals.
Body with_faces(const std::vector<std::array<Vec3, 3>>& triangles) {
  Body body;
  body.parts.resize(1);
  body.parts[0].name = "part";
  body.surface.parts.resize(1);
  body.surface.parts[0].name = "part";
  body.surface.polygon_offsets = {0};
  body.surface.faces.push_back({"group", 0});
  for (const auto& triangle : triangles) {
    for (const Vec3& x : triangle) {
      body.surface.polygon_vertices.push_back(static_cast<std::uint32_t>(body.surface.vertices.size()));
      body.surface.vertices.push_back(x);
    }
    body.surface.polygon_offsets.push_back(static_cast<std::uint32_t>(body.surface.polygon_vertices.size()));
    body.surface.polygon_face.push_back(0);
  }
  return body;
}

TEST(Actions, TheInwardNormalIsAgainstTheAreaVector) {
  const Body body = with_faces(
      {{Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1)}, {Vec3(1, 0, 1), Vec3(1, 1, 1), Vec3(0, 1, 1)}});
  EXPECT_LT((inward_normal(simulate::select_by_name("group", "--push"), body) - Vec3(0, 0, -1)).norm(),
            1e-15);
  simulate::Scene scene;
  add_push(scene, parse_push("group: 50 N"), body);
  add_push(scene, parse_push("group: 3 Pa"), body);
  add_move(scene, parse_move("group: 2 mm"), body);
  const std::vector<simulate::Load>& loads = scene.get<simulate::Loads>().loads;
  ASSERT_EQ(loads.size(), 2u);
  EXPECT_LT((*loads[0].force - Vec3(0, 0, -50)).norm(), 1e-12);
  EXPECT_EQ(*loads[1].pressure, 3);
  EXPECT_EQ(scene.get<simulate::Supports>().ties.size(), 1u);
}

// A slanted top: its polygon looks 45 degrees away from z, but "zmax" is a side, whose push is along z.
TEST(Actions, APushOnASideGoesAlongItsAxis) {
  const Body body = with_faces(
      {{Vec3(0, 0, 0), Vec3(1, 0, 1), Vec3(0, 1, 0)}, {Vec3(1, 0, 1), Vec3(1, 1, 1), Vec3(0, 1, 0)}});
  simulate::Scene scene;
  add_push(scene, parse_push("zmax: 50 N"), body);
  add_push(scene, parse_push("group: 50 N"), body);
  add_move(scene, parse_move("part/zmax: 2 mm"), body);
  const std::vector<simulate::Load>& loads = scene.get<simulate::Loads>().loads;
  EXPECT_EQ(*loads[0].force, Vec3(0, 0, -50));
  EXPECT_LT((*loads[1].force - 50 * Vec3(1, 0, -1).normalized()).norm(), 1e-12);
  EXPECT_EQ(scene.get<simulate::Supports>().ties[0].motion.translation, Vec3(0, 0, -2e-3));
}

TEST(Actions, TorquesAndTwistsTurnAboutTheOutwardNormal) {
  const Body body = with_faces(
      {{Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1)}, {Vec3(1, 0, 1), Vec3(1, 1, 1), Vec3(0, 1, 1)}});
  simulate::Scene scene;
  add_torque(scene, parse_torque("group: 5 N m"), body);
  add_torque(scene, parse_torque("group: 1 2 3 Nm"), body);
  add_twist(scene, parse_twist("group: 10 deg"), body);
  add_twist(scene, parse_twist("group: 0 -10 0 deg"), body);
  const std::vector<simulate::Load>& loads = scene.get<simulate::Loads>().loads;
  EXPECT_LT((*loads[0].torque - Vec3(0, 0, 5)).norm(), 1e-12);
  EXPECT_LT((*loads[1].torque - Vec3(1, 2, 3)).norm(), 1e-12);
  const std::vector<simulate::Tie>& ties = scene.get<simulate::Supports>().ties;
  EXPECT_TRUE(ties[0].is_move && ties[1].is_move);
  EXPECT_LT((ties[0].motion.axis - Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_LT((ties[0].motion.through - Vec3(0.5, 0.5, 1)).norm(), 1e-12);
  EXPECT_NEAR(ties[0].motion.angle, M_PI / 18, 1e-12);
  EXPECT_LT((ties[1].motion.axis + Vec3::UnitY()).norm(), 1e-12);
  EXPECT_NEAR(ties[1].motion.angle, M_PI / 18, 1e-12);
}

TEST(Actions, GravityPinsAndProbes) {
  EXPECT_LT((parse_gravity("1 g") - Vec3(0, 0, -9.80665)).norm(), 1e-12);
  EXPECT_LT((parse_gravity("0 -2 0 g") - Vec3(0, -2 * 9.80665, 0)).norm(), 1e-12);
  EXPECT_LT((parse_gravity("0 0 -9.81 m/s^2") - Vec3(0, 0, -9.81)).norm(), 1e-12);
  for (const char* text : {"9.81", "1 2 m/s^2", "g", "5 N", ""})
    EXPECT_THROW((void)parse_gravity(text), InputError) << text;
  EXPECT_THROW((void)parse_bearing("part/3: 200 N"), InputError);
  EXPECT_THROW((void)parse_bearing("part/3: 0 0 0 N"), InputError);
  EXPECT_EQ(*parse_bearing("part/3: 0 0 -200 N").vector, Vec3(0, 0, -200));
  EXPECT_LT((*parse_probe("tip: 10 5 3 mm").at - Vec3(0.010, 0.005, 0.003)).norm(), 1e-15);
  EXPECT_EQ(parse_probe("tip: part/3").where->name, "part/3");
  EXPECT_EQ(parse_probe("tip: part/3").name, "tip");
  EXPECT_EQ(parse_probe("part/3").name, "part/3");
  for (const char* text : {"tip: 1 2 mm", "", "tip:", ": 1 2 3 mm"})
    EXPECT_THROW((void)parse_probe(text), InputError) << text;
}

TEST(Actions, FacesThatLookBothWaysHaveNoDirection) {
  const Body body = with_faces(
      {{Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1)}, {Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(1, 0, 0)}});
  EXPECT_THROW(inward_normal(simulate::select_by_name("group", "--push"), body), InputError);
}

}  // namespace
}  // namespace flexel::commands
