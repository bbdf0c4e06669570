// Shares told from within work, as a listener of the Progress hears them.
#include "base/program/share_scope.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <vector>

#include "base/parallel.h"
#include "base/program/progress.h"
#include "base/program/progress_stretch.h"

namespace flexel {
namespace {

class HeardShares : public ProgressListener {
 public:
  HeardShares() { set_progress_listener(this); }
  ~HeardShares() override { set_progress_listener(nullptr); }
  HeardShares(const HeardShares&) = delete;
  HeardShares& operator=(const HeardShares&) = delete;
  void update(const std::string&, double share, const std::string& note,
              std::optional<double>) noexcept override {
    shares.push_back(share);
    notes.push_back(note);
  }
  void say(const std::string&) noexcept override {}
  void warn(const std::string&) noexcept override {}
  std::vector<double> shares;
  std::vector<std::string> notes;
};

// Updates sooner than that are not shown.
void pause() {
  std::this_thread::sleep_for(std::chrono::milliseconds(110));
}

TEST(ShareScope, MovesItsStretchOfTheStageAndPartsMoveTheirsOfIt) {
  HeardShares heard;
  Progress progress("flexel", Progress::Mode::lines);
  progress.stage("heal");
  pause();
  const ShareScope part(progress, 0.5, 1, "lid");
  pause();
  tell_share(0.5);
  pause();
  {
    const ShareScope first(0.5, 1);
    tell_share(0.5);
    pause();
    const ShareScope own(progress, 0, 0.5, "walls");  // of the same Progress: within
    pause();
    tell_share(7);  // no more than all of it
  }
  pause();
  tell_share(1);
  EXPECT_EQ(heard.shares, (std::vector<double>{0, 0.5, 0.75, 0.875, 0.75, 0.875, 1}));
  EXPECT_EQ(heard.notes, (std::vector<std::string>{"", "lid", "lid", "lid", "walls", "walls", "lid"}));
}

TEST(ShareScope, OfARunWithinARunTellsThatRun) {
  HeardShares heard;
  Progress progress("flexel", Progress::Mode::lines);
  progress.stage("look");
  pause();
  const ShareScope whole(progress, 0, 1);
  pause();
  ProgressStretch run(progress, 0.2, 0.6);
  const ShareScope scope(run.inner(), 0, 1);
  pause();
  tell_share(0.5);
  EXPECT_EQ(heard.shares, (std::vector<double>{0, 0, 0.2, 0.4}));
}

TEST(ShareScope, NobodyHearsWhatIsToldOutsideOrOnAnotherThread) {
  HeardShares heard;
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
