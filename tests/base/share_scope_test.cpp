// Shares told from within work, as a listener of the Progress hears them.
#include "base/program/share_scope.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "base/parallel.h"
#include "base/program/progress.h"
#include "base/program/progress_stretch.h"
#include "tests/base/heard.h"

namespace flexel {
namespace {

using test::Heard, test::wait_for_update;

TEST(ShareScope, MovesItsStretchOfTheStageAndPartsMoveTheirsOfIt) {
  Heard heard;
  Progress progress("flexel", Progress::Mode::lines);
  progress.stage("heal");
  wait_for_update();
  const ShareScope part(progress, 0.5, 1, "lid");
  wait_for_update();
  tell_share(0.5);
  wait_for_update();
  {
    const ShareScope first(0.5, 1);
    tell_share(0.5);
    wait_for_update();
    const ShareScope own(progress, 0, 0.5, "walls");  // of the same Progress: within
    wait_for_update();
    tell_share(7);  // no more than all of it
  }
  wait_for_update();
  tell_share(1);
  EXPECT_EQ(heard.shares, (std::vector<double>{0, 0.5, 0.75, 0.875, 0.75, 0.875, 1}));
  EXPECT_EQ(heard.notes, (std::vector<std::string>{"", "lid", "lid", "lid", "walls", "walls", "lid"}));
}

TEST(ShareScope, OfARunWithinARunTellsThatRun) {
  Heard heard;
  Progress progress("flexel", Progress::Mode::lines);
  progress.stage("look");
  wait_for_update();
  const ShareScope whole(progress, 0, 1);
  wait_for_update();
  ProgressStretch run(progress, 0.2, 0.6);
  const ShareScope scope(run.inner(), 0, 1);
  wait_for_update();
  tell_share(0.5);
  EXPECT_EQ(heard.shares, (std::vector<double>{0, 0, 0.2, 0.4}));
}

TEST(ShareScope, NobodyHearsWhatIsToldOutsideOrOnAnotherThread) {
  Heard heard;
  Progress progress("flexel", Progress::Mode::lines);
  tell_share(0.5);
  const ShareScope nobodys(0, 1);
  tell_share(0.5);
  progress.stage("map");
  std::thread other([] { tell_share(0.9); });
  other.join();
  EXPECT_EQ(heard.shares, std::vector<double>{0});
}

TEST(ShareScope, AFunctionHears) {
  std::vector<double> shares;
  const ShareScope scope([&](double share) { shares.push_back(share); });
  tell_share(0.5);
  const ShareScope rest(0.5, 1);
  tell_share(1);
  EXPECT_EQ(shares, (std::vector<double>{0.5, 1}));
}

TEST(ShareScope, ALoopIsCountedToItsEnd) {
  std::vector<double> shares;
  const ShareScope scope([&](double share) { shares.push_back(share); });
  constexpr std::size_t kItems = 1000;
  ShareCounter counter(kItems);
  parallel_chunks(kItems, 10, [&](std::size_t begin, std::size_t end) { counter.add(end - begin); });
  ASSERT_FALSE(shares.empty());  // the calling thread takes part
  for (const double share : shares) EXPECT_TRUE(share > 0 && share <= 1) << share;
  ShareCounter nothing(0);
  nothing.add(1);
  EXPECT_EQ(shares.back(), 1);
}

}  // namespace
}  // namespace flexel
