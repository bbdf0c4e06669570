// What is written of a scene is read as the same.
#include "flexel/scene_text.h"

#include <gtest/gtest.h>

#include "flexel/actions.h"
#include "simulate/effects/gravity.h"

namespace flexel::commands {
namespace {

TEST(SceneText, IsReadAsTheSame) {
  simulate::Scene scene;
  scene.material = "PLA";
  scene.infill = {0.2, 1.0 / 3000};
  scene.parts["a \"b\""].material = "steel";
  scene.get<simulate::Supports>().ties.push_back(simulate::make_fix(simulate::parse_where(
      "{ sphere = { centre = [\"1 mm\", \"0 mm\", \"0 mm\"], radius = \"5 mm\" } }", "--fix")));
  scene.get<simulate::Supports>().ties.push_back(simulate::make_fix(simulate::parse_where(
      "{ sphere = { path = [[0, 0, 0], [\"1 mm\", 0, \"2 mm\"]], radius = \"3 mm\" } }", "--fix")));
  scene.get<simulate::Supports>().ties.push_back(
      simulate::make_move(simulate::parse_where("[\"xmin\", \"part/3\"]", "--move"), Vec3(1e-3, 0, 1.0 / 3)));
  simulate::Tie twist = simulate::make_move(simulate::parse_where("xmax", "--twist"), Vec3::Zero());
  twist.motion.axis = Vec3(1, 2, 2) / 3;
  twist.motion.through = Vec3(0.1, 0.2, 0.3);
  twist.motion.angle = 0.1;
  scene.get<simulate::Supports>().ties.push_back(twist);
  add_bearing(scene, parse_bearing("part/3: 0 0 -200 N"));
  scene.get<simulate::Loads>().loads.push_back(
      simulate::make_pressure(simulate::parse_where("zmax", "--push"), 2e6));
  simulate::Load torque = simulate::make_push(simulate::parse_where("zmax", "--torque"), Vec3::Zero());
  torque.force.reset();
  torque.torque = Vec3(0, 0, 5);
  scene.get<simulate::Loads>().loads.push_back(torque);
  scene.probes.push_back(parse_probe("tip: 10 5 3 mm"));
  scene.probes.push_back(parse_probe("end: xmax"));
  scene.get<simulate::Gravity>().acceleration = Vec3(0, 0, -9.81);
  const SceneText text = scene_text(scene);
  const simulate::Scene again = simulate::parse_scene(text.keys + text.tables, "text");
  EXPECT_EQ(again.material, "PLA");
  EXPECT_EQ(*again.infill.share, 0.2);
  EXPECT_EQ(*again.infill.shell, 1.0 / 3000);
  EXPECT_EQ(again.parts.at("a \"b\"").material, "steel");
  const auto &ties = again.get<simulate::Supports>().ties, &wanted = scene.get<simulate::Supports>().ties;
  ASSERT_EQ(ties.size(), wanted.size());
  EXPECT_EQ(ties[0].where.radius, 5e-3);
  ASSERT_EQ(ties[1].where.members.size(), 2u);
  EXPECT_EQ(ties[1].where.members[1].point, Vec3(1e-3, 0, 2e-3));
  EXPECT_EQ(ties[1].where.radius, 3e-3);
  EXPECT_EQ(ties[2].motion.translation, wanted[2].motion.translation);
  EXPECT_LT((ties[3].motion.axis - twist.motion.axis).norm(), 1e-15);
  EXPECT_EQ(ties[3].motion.through, twist.motion.through);
  EXPECT_EQ(ties[3].motion.angle, 0.1);
  EXPECT_TRUE(ties[3].is_move);
  const auto& loads = again.get<simulate::Loads>().loads;
  ASSERT_EQ(loads.size(), 3u);
  EXPECT_TRUE(loads[0].bearing);
  EXPECT_EQ(*loads[1].pressure, 2e6);
  EXPECT_EQ(*loads[2].torque, Vec3(0, 0, 5));
  EXPECT_EQ(*again.probes[0].at, *scene.probes[0].at);
  EXPECT_EQ(again.probes[1].where->name, "xmax");
  EXPECT_EQ(*again.get<simulate::Gravity>().acceleration, Vec3(0, 0, -9.81));
}

}  // namespace
}  // namespace flexel::commands
