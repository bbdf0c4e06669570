// Moments in which files appear: what would end the process from outside waits until they are over.
#pragma once
#include <mutex>

namespace flexel {

// While one lives, signals and the command's time limit (base/program/signals.cpp) end the process only afterwards. For some
// milliseconds, on the thread that writes: a file is there before a table says so, and one of a run's results before the next.
class EndingWaits {
 public:
  EndingWaits();
  ~EndingWaits();
  EndingWaits(const EndingWaits&) = delete;
  EndingWaits& operator=(const EndingWaits&) = delete;

  // In a handler: whether the signal has to wait. It is raised again then.
  [[nodiscard]] static bool takes(int signal) noexcept;
  // On another thread than the one that writes: no such moment begins while this is held.
  [[nodiscard]] static std::unique_lock<std::recursive_mutex> none_begins();
};

}  // namespace flexel
