// The library's figures belong together, and every row says where they were read and what was not.
#include "simulate/input/materials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace flexel::simulate {
namespace {

using ::testing::ContainsRegex;

TEST(Materials, FiguresBelongTogether) {
  for (const Material& each : material_library()) {
    EXPECT_GT(each.young, 1e5) << each.name;
    EXPECT_LT(each.young, 1e12) << each.name;  // diamond has 1.05e12
    EXPECT_GT(each.poisson, 0.1) << each.name;
    EXPECT_LT(each.poisson, 0.5) << each.name;
    EXPECT_GT(each.density, 800) << each.name;
    EXPECT_LT(each.density, 23000) << each.name;  // osmium has 22600
    EXPECT_GE(each.yield, 0) << each.name;
    EXPECT_GE(each.strength, 0) << each.name;
    EXPECT_LE(each.yield, each.strength > 0 ? each.strength : each.yield) << each.name;
    const double limit = each.young > 100e6 ? 0.1 * each.young : 1e9;  // elastomers break far above
    EXPECT_LT(std::max(each.yield, each.strength), limit) << each.name;
    EXPECT_GE(each.layer_strength, 0) << each.name;
    EXPECT_LE(each.layer_strength, each.strength) << each.name;
    EXPECT_GE(each.elongation, 0) << each.name;
    EXPECT_LT(each.elongation, 1) << each.name;
    EXPECT_GE(each.friction, 0) << each.name;
    EXPECT_LT(each.friction, 1.5) << each.name;
    EXPECT_GE(each.damping, 0) << each.name;
    EXPECT_LT(each.damping, 0.1) << each.name;
    // no solid is quicker than sound in diamond or slower than in soft rubber
    const double speed = std::sqrt(each.young / each.density);
    EXPECT_GT(speed, 20) << each.name;
    EXPECT_LT(speed, 13000) << each.name;
  }
}

TEST(Materials, EverySourceSaysWhatWasReadAndWhatNot) {
  std::set<std::string> names;
  for (const Material& each : material_library()) {
    EXPECT_TRUE(names.insert(each.name).second) << each.name;
    EXPECT_THAT(each.source, ContainsRegex("read (at|in) |[Nn]ot read: ")) << each.name;
    EXPECT_EQ(library_material(each.name), &each) << each.name;
  }
  EXPECT_GE(names.size(), 30u);
}

TEST(Materials, PrintsHaveStrengths) {
  for (const char* name : {"PLA", "PETG", "ABS", "ASA", "PA12", "PA12 MJF", "TPU 86A", "durable resin"})
    EXPECT_GT(library_material(name)->strength, 0) << name;
  EXPECT_LT(library_material("PLA")->layer_strength, 0.6 * library_material("PLA")->strength);
}

}  // namespace
}  // namespace flexel::simulate
