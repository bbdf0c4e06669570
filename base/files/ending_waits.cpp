// Handlers cannot lock: they look at a count, which the thread that they interrupt has set.
#include "base/files/ending_waits.h"

#include <atomic>
#include <csignal>

namespace flexel {
namespace {

std::recursive_mutex moment;
std::atomic<int> moments{0}, waiting{0};
static_assert(std::atomic<int>::is_always_lock_free);

}  // namespace

EndingWaits::EndingWaits() {
  moment.lock();
  ++moments;
}

EndingWaits::~EndingWaits() {
  const bool last = --moments == 0;
  moment.unlock();
  if (const int signal = last ? waiting.exchange(0) : 0; signal != 0) std::raise(signal);
}

bool EndingWaits::takes(int signal) noexcept {
  if (moments == 0) return false;
  waiting = signal;
  return moments != 0 || waiting.exchange(0) == 0;  // on another thread the moment may have ended in between
}

std::unique_lock<std::recursive_mutex> EndingWaits::none_begins() {
  return std::unique_lock(moment);
}

}  // namespace flexel
