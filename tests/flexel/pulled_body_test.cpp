// A body that tools lead: roughly while they move, exactly where they rest, and back where it finds no rest.
#include "flexel/clay/pulled_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flexel/clay/answers.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/box_body.h"

namespace flexel::clay {
namespace {

using simulate::testing::box_body;
using simulate::testing::BoxOptions;

constexpr double kBarCell = 0.01, kBarLength = 20 * kBarCell, kArm = 0.03;  // m
constexpr const char* kLedScene =
    "material = \"PLA\"\n"
    "[[fix]]\nwhere = { sphere = { centre = [\"0 cm\", \"3 cm\", \"3 cm\"], radius = \"5 cm\" } }\n"
    "[[move]]\nwhere = { sphere = { centre = [\"20 cm\", \"3 cm\", \"3 cm\"], radius = \"1.5 cm\" } }\n"
    "displacement = [\"0 mm\", \"0 mm\", \"0 mm\"]\n";

Body bar() {
  BoxOptions options;
  options.cells = {20, 6, 6};  // more than are factorised at once
  options.spacing = Vec3::Constant(kBarCell);
  return box_body(options);
}

PulledBody pulled(const Body& body) {
  return {body,
          simulate::parse_scene(kLedScene, "scene"),
          {{Vec3(kBarLength, 3 * kBarCell, 3 * kBarCell), false}},
          kArm,
          std::vector<Vec3>(body.element_count(), Vec3::Zero()),
          {ToolPose{}}};
}

// A hand's way, that turns and comes back: 20 mm up, 5 mm aside.
Way pose(int step) {
  const double at = 0.1 * step;
  return {{Vec3(0, 5e-3 * std::sin(2 * at), 20e-3 * std::sin(at)), Vec3(0, 0.1 * std::sin(at), 0)}};
}

double farthest(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t e = 0; e < a.size(); ++e) most = std::max(most, (a[e] - b[e]).norm());
  return most;
}

const auto kGoOn = [] {};

TEST(Answers, OfALinearPartAreExactForWaysThatItHasSeen) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return Vec3(any(random), any(random), any(random)); };
  std::vector<Eigen::Matrix<double, 3, 6>> part(50);
  for (auto& each : part)
    for (int c = 0; c < 6; ++c) each.col(c) = vector();
  const auto answer = [&](const Way& way) {
    Eigen::Matrix<double, 6, 1> both;
    both << way[0].displacement, way[0].turn;
    std::vector<Vec3> moved;
    for (const auto& each : part) moved.emplace_back(each * both);
    return moved;
  };
  Answers answers(kArm);
  EXPECT_TRUE(answers.empty());
  const std::vector<Vec3> rest(part.size(), Vec3::Zero());
  std::vector<Way> seen;
  for (int k = 0; k < 3; ++k) {
    seen.push_back({{kArm * vector(), vector()}});
    answers.learn(seen.back(), rest, answer(seen.back()));
  }
  answers.learn({{}}, rest, std::vector<Vec3>(part.size(), Vec3::Ones()));  // no way: nothing is learnt
  const Way asked = {seen[0][0] * 0.3 + seen[1][0] * 2 - seen[2][0]};
  std::vector<Vec3> found = rest;
  answers.add(asked, found);
  EXPECT_LT(farthest(found, answer(asked)), 1e-10);
}

TEST(PulledBody, FollowsToTheResidualThatIsAskedAndStaysNearTheEquilibrium) {
  const Body body = bar();
  PulledBody rough = pulled(body), exact = pulled(body);
  int followed = 0;
  for (int step = 1; step <= 34; ++step) {
    ASSERT_TRUE(exact.lead(pose(step), 1e-10, 40, kGoOn)) << step;
    if (rough.follow(pose(step), 1e-2)) {
      ++followed;
      EXPECT_LE(rough.residual(), 1e-2);
      EXPECT_EQ(rough.poses(), pose(step));
    } else {
      ASSERT_TRUE(rough.lead(pose(step), 1e-4, 40, kGoOn)) << step;
    }
    EXPECT_LT(farthest(rough.displacement(), exact.displacement()), 2e-4) << step;  // of 20 mm
  }
  EXPECT_GT(followed, 28);
  ASSERT_TRUE(rough.lead(pose(34), 1e-10, 40, kGoOn));
  EXPECT_LT(farthest(rough.displacement(), exact.displacement()), 1e-9) << "at rest it is the same";
  EXPECT_LT((rough.felt()[0].force - exact.felt()[0].force).norm(), 1e-6 * exact.felt()[0].force.norm());
}

// Their ties are stiff: the more the part resists the more both what is left and what it is measured by are theirs.
TEST(PulledBody, FollowsFaces) {
  const Body body = bar();
  const char* scene =
      "material = \"PLA\"\n[[fix]]\nwhere = \"x0\"\n"
      "[[move]]\nwhere = \"x1\"\ndisplacement = [\"0 mm\", \"0 mm\", \"0 mm\"]\n";
  const auto made = [&] {
    return PulledBody(body, simulate::parse_scene(scene, "scene"),
                      {{Vec3(kBarLength, 3 * kBarCell, 3 * kBarCell), false}}, kArm,
                      std::vector<Vec3>(body.element_count(), Vec3::Zero()), {ToolPose{}});
  };
  PulledBody rough = made(), exact = made();
  int followed = 0;
  for (int step = 1; step <= 34; ++step) {
    ASSERT_TRUE(exact.lead(pose(step), 1e-10, 40, kGoOn)) << step;
    if (rough.follow(pose(step), 1e-2))
      ++followed;
    else
      ASSERT_TRUE(rough.lead(pose(step), 1e-4, 40, kGoOn)) << step;
    EXPECT_LT(farthest(rough.displacement(), exact.displacement()), 2e-4) << step;
  }
  EXPECT_GT(followed, 31);
}

// A ball above the end of a bar goes into it and along it, and leaves it.
TEST(PulledBody, FollowsTheBallThatPushesIt) {
  const Body body = bar();
  const std::string scene =
      "material = \"PLA\"\n[[fix]]\nwhere = \"x0\"\n"
      "[[indenter]]\nball = { centre = [\"17 cm\", \"3 cm\", \"9 cm\"], radius = \"3 cm\" }\n";
  const auto made = [&] {
    return PulledBody(body, simulate::parse_scene(scene, "scene"), {{Vec3(0.17, 0.03, 0.09), true}}, kArm,
                      std::vector<Vec3>(body.element_count(), Vec3::Zero()), {ToolPose{}});
  };
  PulledBody rough = made(), exact = made();
  const auto place = [](int step) {
    return Way{{Vec3(5e-3 * std::sin(0.2 * step), 2e-3 * std::sin(0.1 * step), -8e-3 * std::sin(0.1 * step)),
                Vec3::Zero()}};
  };
  int followed = 0;
  double strongest = 0;
  for (int step = 1; step <= 34; ++step) {
    if (rough.follow(place(step), 1e-2)) {
      ++followed;
      EXPECT_LE(rough.residual(), 1e-2);
    } else {
      ASSERT_TRUE(rough.lead(place(step), 1e-4, 40, kGoOn)) << step;
    }
    if (step % 4 != 0) continue;
    ASSERT_TRUE(exact.lead(place(step), 1e-8, 40, kGoOn)) << step;
    const Vec3 force = exact.felt()[0].force;
    strongest = std::max(strongest, force.norm());
    EXPECT_LT(farthest(rough.displacement(), exact.displacement()), 2e-4) << step;  // of 8 mm
    EXPECT_LT((rough.felt()[0].force - force).norm(), 0.02 * strongest) << step;
  }
  EXPECT_GT(followed, 25);
  ASSERT_TRUE(rough.lead(place(30), 1e-8, 40, kGoOn));
  ASSERT_TRUE(exact.lead(place(30), 1e-8, 40, kGoOn));
  EXPECT_LT(farthest(rough.displacement(), exact.displacement()), 1e-7) << "at rest it is the same";
  EXPECT_FALSE(rough.follow({{Vec3(0, 0, -0.2), Vec3::Zero()}}, 1e-2)) << "not through the part";
  EXPECT_EQ(rough.poses(), place(30));
}

TEST(PulledBody, ComesBackToWhereItBegan) {
  const Body body = bar();
  PulledBody part = pulled(body);
  for (const int step : {1, 2, 1}) ASSERT_TRUE(part.lead(pose(step), 1e-4, 12, kGoOn));
  ASSERT_TRUE(part.lead({ToolPose{}}, 1e-4, 12, kGoOn)) << "no force is left to measure residuals by";
  EXPECT_LT(farthest(part.displacement(), std::vector<Vec3>(body.element_count(), Vec3::Zero())), 1e-6);
}

TEST(PulledBody, RetreatsToTheLastEquilibrium) {
  const Body body = bar();
  PulledBody part = pulled(body);
  ASSERT_TRUE(part.lead(pose(1), 1e-8, 40, kGoOn));
  ASSERT_TRUE(part.lead(pose(2), 1e-8, 40, kGoOn));
  const std::vector<Vec3> rested = part.displacement();
  const Vec3 force = part.felt()[0].force;
  ASSERT_TRUE(part.follow(pose(3), 1e-2));
  EXPECT_GT(farthest(part.displacement(), rested), 1e-4);
  ASSERT_TRUE(part.lead(pose(4), 1e-4, 12, kGoOn)) << "which is none to 1e-8";
  part.retreat();
  EXPECT_EQ(part.displacement(), rested);
  EXPECT_EQ(part.poses(), pose(2));
  EXPECT_LE(part.residual(), kRest);
  EXPECT_EQ(part.felt()[0].force, force);
  EXPECT_TRUE(part.lead(pose(3), 1e-8, 40, kGoOn)) << "and goes on from there";
}

TEST(PulledBody, FollowsNothingThatItCannot) {
  const Body body = bar();
  PulledBody part = pulled(body);
  EXPECT_FALSE(part.follow(pose(1), 1e-2)) << "there is no tangent yet";
  ASSERT_TRUE(part.lead(pose(1), 1e-8, 40, kGoOn));
  const std::vector<Vec3> before = part.displacement();
  const Way through = {{Vec3(-2 * kBarLength, 0, 0), Vec3::Zero()}};
  EXPECT_FALSE(part.follow(through, 1e-2)) << "it would fold";
  EXPECT_EQ(part.displacement(), before);
  EXPECT_EQ(part.poses(), pose(1));
}

}  // namespace
}  // namespace flexel::clay
