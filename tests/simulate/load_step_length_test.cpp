// How the length of load steps answers to what became of them.
#include "simulate/equilibrium/load_step_length.h"

#include <gtest/gtest.h>

namespace flexel::simulate {
namespace {

// Easy steps until the length doubles.
int easy_steps_until_doubled(LoadStepLength& length) {
  const double before = length.get();
  for (int steps = 1; steps < 100; ++steps) {
    length.succeeded(true);
    if (length.get() != before) {
      EXPECT_EQ(length.get(), 2 * before);
      return steps;
    }
  }
  return 0;
}

TEST(LoadStepLength, HalvesAndDoublesUpToTheFirst) {
  LoadStepLength length(0.5);
  length.succeeded(true);
  EXPECT_EQ(length.get(), 0.5);
  length.failed(0.5);
  length.failed(0.25);
  EXPECT_EQ(length.get(), 0.125);
  length.succeeded(false);
  EXPECT_EQ(length.get(), 0.125) << "that was not easy";
  EXPECT_EQ(easy_steps_until_doubled(length), 1);
  EXPECT_EQ(easy_steps_until_doubled(length), 1);
  for (int i = 0; i < 40; ++i) length.succeeded(true);
  EXPECT_EQ(length.get(), 0.5);
}

TEST(LoadStepLength, WaitsLongerEachTimeThatDoublingFails) {
  LoadStepLength length(1);
  for (int i = 0; i < 6; ++i) length.failed(length.get());
  const double lasts = length.get();
  for (const int wait : {1, 2, 4, 8, 16, 16, 16}) {
    EXPECT_EQ(easy_steps_until_doubled(length), wait);
    length.failed(length.get());
    EXPECT_EQ(length.get(), lasts);
  }
  EXPECT_EQ(easy_steps_until_doubled(length), 16);
  EXPECT_EQ(easy_steps_until_doubled(length), 1) << "the doubled one served";
}

// A length that served and fails later was not doubled in vain.
TEST(LoadStepLength, OnlyAFailureOfTheDoubledStepMakesItWait) {
  LoadStepLength length(1);
  length.failed(1);
  length.failed(0.5);
  EXPECT_EQ(easy_steps_until_doubled(length), 1);
  length.succeeded(false);
  length.failed(length.get());
  EXPECT_EQ(easy_steps_until_doubled(length), 1);
}

TEST(LoadStepLength, ALastStepIsHalvedFromWhatWasTried) {
  LoadStepLength length(1);
  length.failed(0.0625);
  EXPECT_EQ(length.get(), 0.03125);
}

TEST(LoadStepLength, MayStopGrowing) {
  LoadStepLength length(1);
  length.failed(1);
  length.stop_growing();
  for (int i = 0; i < 40; ++i) length.succeeded(true);
  EXPECT_EQ(length.get(), 0.5);
  length.failed(0.5);
  EXPECT_EQ(easy_steps_until_doubled(length), 1);
  length.set(0.125);
  EXPECT_EQ(length.get(), 0.125);
}

}  // namespace
}  // namespace flexel::simulate
