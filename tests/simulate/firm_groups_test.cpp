#include "simulate/matter/firm_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/simulate/box_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using ::testing::AllOf;
using testing::box_body;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Cells of a box of `size` that `has` says are there.
Body cells(const std::array<int, 3>& size, const std::function<bool(int, int, int)>& has) {
  return box_body({.cells = size, .spacing = Vec3::Constant(0.01), .fill = [has](int i, int j, int k) {
                     return has(i, j, k) ? 1.0 : 0.0;
                   }});
}

std::size_t group_count(const Body& body) {
  const std::vector<std::uint32_t> group = firm_groups(body);
  return std::set<std::uint32_t>(group.begin(), group.end()).size();
}

TEST(FirmGroups, CellsThatShareFacesHoldTogether) {
  EXPECT_EQ(group_count(cells({4, 3, 2}, [](int, int, int) { return true; })), 1u);
  // around a corner
  EXPECT_EQ(group_count(cells({2, 2, 2}, [](int i, int j, int k) { return i * j * k == 0; })), 1u);
}

TEST(FirmGroups, AnEdgeIsAHingeAndACornerAJoint) {
  EXPECT_THAT(firm_groups(cells({2, 2, 1}, [](int i, int j, int) { return i == j; })), ElementsAre(0, 1));
  EXPECT_EQ(group_count(cells({2, 2, 2}, [](int i, int j, int k) { return i == j && j == k; })), 2u);
  // a plate along a whole line of edges
  EXPECT_EQ(group_count(cells({2, 2, 9}, [](int i, int j, int) { return i == j; })), 2u);
}

TEST(FirmGroups, TwoHingesThatAreNotInLineHold) {
  // a bridge that touches its feet along two edges
  const Body bridge = cells({5, 1, 4}, [](int i, int, int k) {
    return k == 0 || (k == 1 && (i == 0 || i == 4)) || (k == 2 && i > 0 && i < 4);
  });
  EXPECT_EQ(group_count(bridge), 1u);
}

TEST(FirmGroups, ThreeHingesAroundACornerHoldAFourBarLinkageDoesNot) {
  const Body corner = cells({2, 2, 2}, [](int i, int j, int k) { return i + j + k == 1; });
  EXPECT_EQ(group_count(corner), 1u);
  const Body linkage = cells({3, 3, 1}, [](int i, int j, int) { return (i + j) % 2 == 1; });
  EXPECT_EQ(group_count(linkage), 4u);
}

TEST(FirmGroups, BrokenCellsHoldNothing) {
  Body body = cells({3, 1, 1}, [](int, int, int) { return true; });
  body.broken[1] = 1;
  EXPECT_THAT(firm_groups(body), ElementsAre(0, kNoGroup, 1));
}

// Two plates that meet along a line of edges: one is held, nothing holds the other against turning.
TEST(FirmGroups, APlateOnAHingeIsRefused) {
  Body body = cells({8, 8, 2}, [](int i, int, int k) { return k == 0 ? i < 4 : i >= 4; });
  Scene scene = testing::gum_scene();
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
  EXPECT_THAT(testing::refusal(body, scene),
              AllOf(HasSubstr("in 2 pieces that are not firmly connected"), HasSubstr("the one of 32 cells"),
                    HasSubstr("by edges and corners of cells alone"), HasSubstr("a smaller spacing")));
}

}  // namespace
}  // namespace flexel::simulate
