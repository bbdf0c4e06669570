// Progress, as a listener hears it.
#include "base/program/progress_stretch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "base/program/brief_output.h"
#include "tests/base/heard.h"

namespace flexel {
namespace {

using test::Heard, test::wait_for_update;

TEST(Progress, ARunWithinARunMovesItsStretchOfTheStage) {
  Heard heard;
  Progress whole("flexel", Progress::Mode::lines);
  whole.stage("bars");
  wait_for_update();
  ProgressStretch first(whole, 0.25, 0.75);
  Progress& stretch = first.inner();
  stretch.stage("simulate");
  stretch.update(0.5, "newton 3");
  wait_for_update();
  {
    ProgressStretch deeper(stretch, 0.5, 1);
    deeper.inner().update(0.5);
  }
  stretch.say("not told");
  stretch.warn("neither is this");
  EXPECT_EQ(heard.stages, std::vector<std::string>(3, "bars"));
  EXPECT_EQ(heard.shares, (std::vector<double>{0, 0.5, 0.625}));
  EXPECT_EQ(heard.notes, (std::vector<std::string>{"", "newton 3", ""}));
  EXPECT_TRUE(heard.lines.empty());
  whole.say("told");
  EXPECT_EQ(heard.lines, std::vector<std::string>{"told"});
}

TEST(Progress, ARunWithinARunMayWarn) {
  Heard heard;
  Progress whole("flexel", Progress::Mode::lines);
  whole.stage("bars");
  wait_for_update();
  ProgressStretch stretch(whole, 0.5, 1, "flexel");
  stretch.inner().update(0.5);
  stretch.inner().say("not told");
  stretch.inner().warn("told");
  EXPECT_EQ(heard.shares, (std::vector<double>{0, 0.75}));
  EXPECT_EQ(heard.lines, std::vector<std::string>{"told"});
}

TEST(Progress, ARunWithinARunOfSeveralStagesNeverGoesBack) {
  for (const bool warns : {false, true}) {
    Heard heard;
    Progress whole("flexel", Progress::Mode::lines);
    whole.stage("bars");
    const auto stretch = warns ? std::make_unique<ProgressStretch>(whole, 0.5, 1, "flexel")
                               : std::make_unique<ProgressStretch>(whole, 0.5, 1);
    for (const char* stage : {"heal", "voxelize"}) {
      wait_for_update();
      stretch->inner().stage(stage);
      for (const double share : {0.25, 0.75, 2.0}) {
        wait_for_update();
        stretch->inner().update(share);
      }
    }
    ASSERT_GT(heard.shares.size(), 4u);
    EXPECT_TRUE(std::is_sorted(heard.shares.begin(), heard.shares.end()));
    EXPECT_EQ(heard.shares[warns ? 2 : 1], 0.625);
    EXPECT_EQ(heard.shares.back(), 1);
  }
}

TEST(Progress, AWarningOfARunWithinARunErasesTheBar) {
  testing::internal::CaptureStderr();
  {
    Progress whole("flexel", Progress::Mode::bar);
    whole.stage("bars");
    ProgressStretch stretch(whole, 0.5, 1, "flexel");
    stretch.inner().warn("told");
  }
  EXPECT_NE(testing::internal::GetCapturedStderr().find("\r\033[Kflexel: warning: told\n"),
            std::string::npos);
}

TEST(Progress, ALineErasesTheBarOfWhicheverRun) {
  testing::internal::CaptureStderr();
  {
    Progress whole("flexel", Progress::Mode::bar);
    Progress inner("flexel", Progress::Mode::bar);
    inner.stage("bars");
    whole.say("told");
    whole.say("once more");
  }
  EXPECT_NE(testing::internal::GetCapturedStderr().find("\r\033[Kflexel: told\nflexel: once more\n"),
            std::string::npos);
}

TEST(Progress, ARunThatEndsLeavesTheBarOfAnother) {
  testing::internal::CaptureStderr();
  {
    Progress whole("flexel", Progress::Mode::bar);
    whole.stage("bars");
    { const Progress silent("flexel", Progress::Mode::silent), quiet("flexel", Progress::Mode::quiet); }
    std::fputs("|", stderr);
  }
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(said.substr(said.find('|')), "|\r\033[K");
}

TEST(Progress, OfAQuietRunNoUpdateIsHeard) {
  Heard heard;
  Progress quiet("flexel", Progress::Mode::quiet);
  quiet.stage("bars");
  ProgressStretch stretch(quiet, 0, 1);
  stretch.inner().update(0.5);
  EXPECT_TRUE(heard.stages.empty());
}

TEST(Progress, OfASilentRunNothingIsHeard) {
  Heard heard;
  Progress silent("flexel", Progress::Mode::silent);
  silent.stage("bars");
  ProgressStretch stretch(silent, 0, 1);
  stretch.inner().update(0.5);
  EXPECT_TRUE(heard.stages.empty());
}

TEST(Progress, EachRunKeepsItsOwnWarnings) {
  using Lines = std::vector<std::string>;
  const Heard heard;  // in place of stderr
  Progress progress("flexel", Progress::Mode::lines);
  const KeptWarnings outer;
  progress.warn("before");
  {
    const KeptWarnings inner;
    progress.warn("within");
    EXPECT_EQ(inner.lines(), Lines{"within"});
  }
  progress.warn("after");
  EXPECT_EQ(outer.lines(), (Lines{"before", "after"}));
  EXPECT_EQ(heard.lines, (Lines{"before", "within", "after"}));
}

TEST(Progress, TimeLeftIsToldFromTwoSecondsOn) {
  EXPECT_FALSE(seconds_left(1.9, 0.5));
  EXPECT_FALSE(seconds_left(5, 0.01));
  EXPECT_FALSE(seconds_left(5, 1));
  EXPECT_DOUBLE_EQ(seconds_left(5, 0.25).value(), 15);
}

}  // namespace
}  // namespace flexel
