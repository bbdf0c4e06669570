// How much of some work is done, told from deep within it to whoever shows it.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <string>

namespace flexel {

class Progress;

// While one lives, tell_share() on its thread is heard: by `progress`, whose stage moves from one share to another; by a
// function; or by the scope around it. One of the same Progress as the scope around it moves within that one's shares.
// Threads that help tell nothing: the thread of the scope takes its part in every loop, and speaks for them.
class ShareScope {
 public:
  using Hear = std::function<void(double share)>;
  ShareScope(Progress& progress, double from, double to, std::string note = "");
  explicit ShareScope(Hear hear);
  // A part of the work of the scope around it. Where there is none, nobody hears.
  ShareScope(double from, double to);
  ~ShareScope();
  ShareScope(const ShareScope&) = delete;
  ShareScope& operator=(const ShareScope&) = delete;

 private:
  friend void tell_share(double share);
  void hear(double share, const std::string& note) const;
  Progress* progress_ = nullptr;
  Hear hear_;
  double from_ = 0, to_ = 1;
  std::string note_;
  const ShareScope* around_;
};

// That so much of the work is done, in [0, 1].
void tell_share(double share);

// The items of a loop that are done, counted by any of its threads.
class ShareCounter {
 public:
  explicit ShareCounter(std::size_t items) : items_(std::max<std::size_t>(1, items)) {}
  void add(std::size_t items) {
    const std::size_t done = done_.fetch_add(items, std::memory_order_relaxed) + items;
    tell_share(static_cast<double>(done) / static_cast<double>(items_));
  }

 private:
  std::atomic<std::size_t> done_ = 0;
  std::size_t items_;
};

}  // namespace flexel
