#include "base/stop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>

#include "base/error.h"
#include "base/math/parallel_sort.h"
#include "base/parallel.h"
#include "base/resources.h"

namespace flexel {
namespace {

using testing::Message;
using testing::ThrowsMessage;

void sleep_for(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

TEST(Stop, WithoutALimitNothingIsStopped) {
  EXPECT_FALSE(stop_is_due());
  EXPECT_NO_THROW(check_stop());
}

TEST(Stop, ALimitIsNamedAndEndsWithItsScope) {
  {
    const StopAfter limit(0.02, "--within");
    EXPECT_NO_THROW(check_stop());
    EXPECT_FALSE(limit.passed());
    EXPECT_GT(limit.seconds_left(), 0);
    sleep_for(0.05);
    EXPECT_THAT([] { check_stop(); }, ThrowsMessage<TimeoutError>("stopped by --within"));
    EXPECT_TRUE(limit.passed());
    EXPECT_LE(limit.seconds_left(), 0);
  }
  EXPECT_NO_THROW(check_stop());
}

TEST(Stop, TheOutermostLimitThatIsOverIsNamed) {
  const StopAfter outer(0.02, "--timeout");
  {
    const StopAfter inner(1000, "--within");
    sleep_for(0.05);
    EXPECT_THAT([] { check_stop(); }, ThrowsMessage<TimeoutError>("stopped by --timeout"));
    EXPECT_FALSE(inner.passed()) << "the one who set it has to pass the error on";
    const StopAfter innermost(0, "an attempt");
    EXPECT_THAT([] { check_stop(); }, ThrowsMessage<TimeoutError>("stopped by --timeout"));
  }
  EXPECT_TRUE(outer.passed());
}

TEST(Stop, TheTimeLeftIsThatOfTheNearestLimit) {
  EXPECT_EQ(time_left(), std::numeric_limits<double>::infinity());
  const StopAfter outer(100, "--timeout");
  {
    const StopAfter inner(0.02, "--within");
    EXPECT_LE(time_left(), inner.seconds_left() + 0.01);
    sleep_for(0.05);
    EXPECT_LE(time_left(), 0);
  }
  EXPECT_GT(time_left(), 50);
  EXPECT_LE(time_left(), 100.01);
}

TEST(Stop, AnInnerLimitLeavesTheOuterOneAsItWas) {
  const StopAfter outer(1000, "--timeout");
  {
    const StopAfter inner(0, "--within");
    EXPECT_THROW(check_stop(), TimeoutError);
  }
  EXPECT_NO_THROW(check_stop());
}

TEST(Stop, ALongTimeIsNoLimit) {
  for (const double seconds : {1e10, 1e300, std::numeric_limits<double>::infinity()}) {
    const StopAfter limit(seconds, "--timeout");
    EXPECT_NO_THROW(check_stop()) << seconds;
    EXPECT_FALSE(limit.passed());
  }
}

TEST(Stop, WhatWasReachedCanBeWritten) {
  const StopAfter limit(0, "--timeout");
  {
    const StopWaits saving;
    EXPECT_NO_THROW(check_stop());
    const StopWaits again;
    EXPECT_TRUE(stop_is_due());
  }
  EXPECT_THROW(check_stop(), TimeoutError);
}

TEST(Stop, EveryParallelLoopHearsIt) {
  std::vector<int> values(100000, 1);
  const auto loops = [&](std::atomic<int>& done) {
    parallel_for_each(values.size(), [&](std::size_t) { ++done; });
  };
  std::atomic<int> done = 0;
  {
    const StopAfter limit(0, "--timeout");
    EXPECT_THROW(loops(done), TimeoutError);
    EXPECT_THROW(parallel_chunks(3, 10, [&](std::size_t, std::size_t) { ++done; }), TimeoutError);
    EXPECT_THROW((void)parallel_sum<int>(values.size(), [&](std::size_t i) { return values[i]; }),
                 TimeoutError);
    EXPECT_THROW(parallel_sort(values.begin(), values.end(), std::less<>()), TimeoutError);
  }
  EXPECT_EQ(done, 0);
  loops(done);
  EXPECT_EQ(done, 100000);
}

// A limit that comes while the loop runs: what is left of it is not begun.
TEST(Stop, ALoopThatRunsEndsSoon) {
  const StopAfter limit(0.05, "--timeout");
  std::atomic<int> chunks = 0;
  EXPECT_THROW(parallel_chunks(100000, 1,
                               [&](std::size_t, std::size_t) {
                                 ++chunks;
                                 sleep_for(0.001);
                               }),
               TimeoutError);
  EXPECT_LT(chunks, 100000 / 10);  // 0 on a machine that is late to begin
}

}  // namespace
}  // namespace flexel
