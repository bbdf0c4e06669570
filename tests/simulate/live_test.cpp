// Lines of poses, and tools that are led by them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "base/error.h"
#include "simulate/rigid/live_tool.h"

namespace flexel::simulate {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;

PoseLine at(double time, const Vec3& displacement, const Vec3& turn = Vec3::Zero()) {
  PoseLine line;
  line.time = time;
  line.displacement = displacement;
  line.turn = turn;
  return line;
}

TEST(PoseLine, HasFourSevenOrEightNumbersAndPerhapsAName) {
  const auto plain = parse_pose_line("0.5 1 -2 3e-3", "stdin:1");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->time, 0.5);
  EXPECT_EQ(plain->displacement, Vec3(1, -2, 3e-3));
  EXPECT_EQ(plain->turn, Vec3::Zero());
  const auto turned = parse_pose_line(" jaw\t0.5,1, +2 ,3 0.1 0.2 0.3\r", "stdin:1");
  ASSERT_TRUE(turned);
  EXPECT_EQ(turned->tool, "jaw");
  EXPECT_EQ(turned->turn, Vec3(0.1, 0.2, 0.3));
  const auto quaternion = parse_pose_line("0 0 0 0 2 0 0 2", "stdin:1");  // any length
  ASSERT_TRUE(quaternion);
  EXPECT_LT((quaternion->turn - Vec3(0, 0, 0.5 * pi)).norm(), 1e-15);
  EXPECT_TRUE(parse_pose_line("end", "stdin:1")->end);
  for (const char* nothing : {"", " \t", "# 1 2 3 4", "\r"})
    EXPECT_FALSE(parse_pose_line(nothing, "stdin:1"));
}

TEST(PoseLine, SaysWhatIsWrong) {
  const auto refusal = [](const std::string& line) -> std::string {
    try {
      (void)parse_pose_line(line, "stdin:7");
    } catch (const InputError& error) {
      return error.where() + ": " + error.what();
    }
    return "";
  };
  for (const char* line : {"1 2 3", "1 2 3 4 5", "1 2 3 4 5 6 7 8 9", "jaw"})
    EXPECT_THAT(refusal(line), HasSubstr("stdin:7")) << line;
  EXPECT_THAT(refusal("1 2 3 4mm"), HasSubstr("\"4mm\""));
  EXPECT_THAT(refusal("1 2 3 inf"), HasSubstr("\"inf\""));
  EXPECT_THAT(refusal("1 2 3 4 0 0 0 0"), HasSubstr("quaternion"));
}

TEST(PoseLine, TurnsGoOnThroughWholeOnes) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    const Vec3 reference = 6 * Vec3(normal(random), normal(random), normal(random));
    const Vec3 turn(normal(random), normal(random), normal(random));
    const Vec3 found = nearest_turn(turn, reference);
    EXPECT_LT((turned_by(found) - turned_by(turn)).norm(), 1e-12);
    const Vec3 axis = turn.normalized();
    for (const double whole : {-2 * pi, 2 * pi})
      EXPECT_LE((found - reference).norm(), (found + whole * axis - reference).norm() + 1e-12);
  }
  EXPECT_LT((nearest_turn(Vec3(0, 0, -0.9 * pi), Vec3(0, 0, pi)) - Vec3(0, 0, 1.1 * pi)).norm(), 1e-12);
  EXPECT_LT((nearest_turn(Vec3::Zero(), Vec3(0, 0, 6.2)) - Vec3(0, 0, 2 * pi)).norm(), 1e-12);
}

TEST(LiveTool, KeysAreItsPath) {
  LiveTool tool;
  tool.name = "jaw";
  tool.add_key(at(0, Vec3::Zero()), "stdin:1");
  tool.add_key(at(1, Vec3(0, 0, -2)), "stdin:2");
  EXPECT_EQ(tool.path.key(0.25).displacement, Vec3(0, 0, -0.5));
  EXPECT_THROW(tool.add_key(at(1, Vec3::Zero()), "stdin:3"), InputError);
  tool.add_key(at(2, Vec3(0, 0, 2)), "stdin:4");
  tool.forget(1.5);
  EXPECT_EQ(tool.path.time.size(), 2u);
  EXPECT_EQ(tool.path.key(1.5).displacement, Vec3::Zero());
  tool.forget(5);
  EXPECT_EQ(tool.path.key(5).displacement, Vec3(0, 0, 2));
}

// Whatever comes when: the tool goes on from where it is, and is where it should be when it should.
TEST(LiveTool, IsLedWithoutAJump) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> share(0, 1);
  LiveTool tool;
  tool.name = "jaw";
  double now = 0;
  for (int i = 0; i < 1000; ++i) {
    const ManipulatorPath::Key before = tool.path.key(now);
    PoseLine pose = at(now + 0.02 * (share(random) - 0.5), Vec3(share(random), share(random), share(random)),
                       2 * Vec3(share(random), share(random), share(random)));
    pose.whole_turns = i % 2 == 0;
    const double least = 1e-3, taken = tool.taken;
    tool.lead_to(pose, now, least);
    const ManipulatorPath::Key after = tool.path.key(now);
    EXPECT_LT((after.displacement - before.displacement).norm(), 1e-12);
    EXPECT_LT((turned_by(after.turn) - turned_by(before.turn)).norm(), 1e-12);
    const double there = pose.time > now ? pose.time : now + std::clamp(now - taken, least, 0.1);
    EXPECT_EQ(tool.path.key(there).displacement, pose.displacement);
    EXPECT_LT((turned_by(tool.path.key(there).turn) - turned_by(pose.turn)).norm(), 1e-12);
    EXPECT_TRUE(std::is_sorted(tool.path.time.begin(), tool.path.time.end()));
    EXPECT_LE(tool.path.time.size(), 64u);  // those that have passed are forgotten
    now += 0.004 * share(random);
  }
}

}  // namespace
}  // namespace flexel::simulate
