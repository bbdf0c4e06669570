// What hands leave behind: the rigid motion of what a tool takes, and the scene that does the same.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>
#include <random>
#include <vector>

#include "flexel/clay/clay_document.h"
#include "flexel/clay/rigid_fit.h"
#include "simulate/scene/scene.h"

namespace flexel::clay {
namespace {

TEST(Hands, ARigidMotionIsFound) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return Vec3(any(random), any(random), any(random)); };
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<MovedPoint> points(3 + trial % 9);
    for (MovedPoint& point : points) point.rest = vector();
    const Vec3 middle = mean_rest(points), turn = 3 * vector().normalized() * std::abs(any(random)),
               way = vector();
    const Mat3 rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    for (MovedPoint& point : points)
      point.displacement = way + rotation * (point.rest - middle) - (point.rest - middle);
    const ToolPose pose = rigid_fit(points);
    EXPECT_LT((pose.displacement - way).norm(), 1e-12);
    const Mat3 found = pose.turn.norm() > 0
                           ? Eigen::AngleAxisd(pose.turn.norm(), pose.turn.normalized()).toRotationMatrix()
                           : Mat3(Mat3::Identity());
    EXPECT_LT((found - rotation).norm(), 1e-6) << trial;
  }
}

TEST(Hands, TheSceneSaysWhatWasDone) {
  ClayDocument document;
  document.material = "PLA";
  document.holds = {"a \"b\\\"/1"};
  document.tools.push_back(
      {where_of_ball({1, 2, 3}, 0.5), {1, 2, 3}, 0.5, {0.1, 0.2, 0.3}, {{1e-3, 0, -2e-3}, {0, 0.5, 0}}});
  for (const std::string base : {"", "[run]", "[run]\ntolerance = 1e-6\n",
                                 "[gravity]\nacceleration = [0, 0, \"-9 m/s2\"]\n[run]\nload_steps = 2"}) {
    const simulate::Scene scene = simulate::parse_scene(scene_text(document, base, true), "scene");
    EXPECT_TRUE(scene.run.renormalise) << base;
    EXPECT_EQ(scene.material, "PLA");
    const std::vector<simulate::Tie>& ties = scene.get<simulate::Supports>().ties;
    ASSERT_EQ(ties.size(), 2U);
    EXPECT_EQ(ties[0].where.name, document.holds[0]);
    EXPECT_EQ(ties[1].where.point, Vec3(1, 2, 3));
    EXPECT_EQ(ties[1].motion.translation, document.tools[0].pose.displacement);
    EXPECT_EQ(ties[1].motion.angle, 0.5);
    EXPECT_EQ(ties[1].motion.through, document.tools[0].middle);
    EXPECT_FALSE(simulate::parse_scene(scene_text(document, base, false), "scene").run.renormalise);
  }
}

// A body that several documents have counts once; what is left are the last ones.
TEST(Hands, UndoForgetsTheOldestWhereItsBodiesAreLarge) {
  std::vector<ClayDocument> undo;
  for (std::uint64_t k = 0; k < 12; ++k) {
    ClayDocument& document = undo.emplace_back();
    Body body;
    body.rest.resize(10);
    const bool same = k % 2 == 1;
    document.start.body = document.now.body =
        same ? undo[k - 1].now.body : std::make_shared<const Body>(std::move(body));
    document.grabs = k;
  }
  forget_oldest(undo, 100, 60);
  EXPECT_EQ(undo.size(), 12U);
  forget_oldest(undo, 11, 60);
  ASSERT_EQ(undo.size(), 11U);
  forget_oldest(undo, 100, 30);
  ASSERT_EQ(undo.size(), 6U);
  EXPECT_EQ(undo.front().grabs, 6U);
  forget_oldest(undo, 100, 0);
  ASSERT_EQ(undo.size(), 1U);
  EXPECT_EQ(undo.front().grabs, 11U);
}

}  // namespace
}  // namespace flexel::clay
