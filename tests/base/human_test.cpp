// Figures as people write them.
#include "base/human.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/units.h"

namespace flexel {
namespace {

TEST(Human, SharesHaveTwoDigitsAndNoExponent) {
  EXPECT_EQ(human_share(0), "0 %");
  EXPECT_EQ(human_share(0.0296), "3 %");
  EXPECT_EQ(human_share(0.0234), "2.3 %");
  EXPECT_EQ(human_share(0.47), "47 %");
  EXPECT_EQ(human_share(0.996), "100 %");  // {:.2g} says 1e+02
  EXPECT_EQ(human_share(2.374), "240 %");
  EXPECT_EQ(human_share(24.1), "24 times");
  EXPECT_EQ(human_share(4.4e-16), "under 0.01 %");
  EXPECT_EQ(human_share(-0.012), "-1.2 %");
}

TEST(Human, ALengthHasAsManyDecimalsAsItsBar) {
  EXPECT_EQ(length_with_bar(54.12e-6, 1.57e-6), "54.1 um +- 1.6 um");
  EXPECT_EQ(length_with_bar(5.28e-3, 536e-6), "5.28 mm +- 0.54 mm");
  EXPECT_EQ(length_with_bar(5.28e-3, 0.0996e-3), "5.28 mm +- 0.10 mm");
  EXPECT_EQ(length_with_bar(0.1491e-6, 0.002135e-6), "149.1 nm +- 2.1 nm");
  EXPECT_EQ(length_with_bar(1.7e-3, 4e-3), "1.7 mm +- 4.0 mm");
  // No more than four digits, however narrow the bar
  EXPECT_EQ(length_with_bar(54.123456e-6, 1e-12), "54.12 um +- under 0.01 um");
  EXPECT_EQ(length_with_bar(54.123456e-6, 0), "54.12 um +- under 0.01 um");
  EXPECT_EQ(length_with_bar(0, 1e-6), "0 nm");
}

TEST(Human, ABarNeverHidesWhatItSays) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> power(-8, 2), share(-3.5, 0.3);
  for (int i = 0; i < 2000; ++i) {
    const double value = std::pow(10, power(random)), share_of_value = std::pow(10, share(random)),
                 bar = share_of_value * value;
    const std::string text = length_with_bar(value, bar);
    const std::size_t between = text.find(" +- ");
    ASSERT_NE(between, std::string::npos) << text;
    ASSERT_EQ(text.find("e-"), std::string::npos) << text;
    const bool under = text.find("under ") != std::string::npos;
    const double shown = parse_quantity(text.substr(0, between), Dimension::length);
    const double told = parse_quantity(text.substr(between + (under ? 10 : 4)), Dimension::length);
    EXPECT_GE(told, 0.94 * bar) << text;
    if (share_of_value > 0.02) {
      EXPECT_LE(told, 1.06 * bar) << text;
    }
    EXPECT_LE(std::abs(shown - value), 0.51 * told) << text;
  }
}

TEST(Human, RangesEndAtZero) {
  EXPECT_EQ(length_range(-4e-3, 5.7e-3), "0 to 5.7 mm");
  EXPECT_EQ(length_range(0.8e-3, 2.6e-3), "0.8 to 2.6 mm");
  EXPECT_EQ(length_range(12e-6, 88e-6), "12 to 88 um");
}

TEST(Human, TimesAndCounts) {
  EXPECT_EQ(human_seconds(0.254), "0.25 s");
  EXPECT_EQ(human_seconds(40.2), "40 s");
  EXPECT_EQ(human_seconds(100), "1.7 min");
  EXPECT_EQ(human_seconds(9000), "2.5 h");
  EXPECT_EQ(counted(1, "voxel"), "1 voxel");
  EXPECT_EQ(counted(2048, "voxel"), "2,048 voxels");
}

TEST(Human, NumbersHaveNoExponent) {
  EXPECT_EQ(human_number(637500), "637,500");
  EXPECT_EQ(human_number(6.375e5, 6), "637,500");
  EXPECT_EQ(human_number(0.00012345), "0.000123");
  EXPECT_EQ(human_number(-1235.6), "-1236");
  EXPECT_EQ(human_number(0), "0");
  EXPECT_EQ(human_number(9.996), "10");
}

}  // namespace
}  // namespace flexel
