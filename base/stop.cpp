// Every loop reads one flag (signals) and one time (the nearest limit). The limits form a stack, which is
// walked only when one of them has passed.
#include "base/stop.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "base/error.h"

namespace flexel {
namespace {

static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<std::int64_t>::is_always_lock_free);

std::atomic<int> waits{0};
std::atomic<const StopAfter*> innermost{nullptr};

// Now and `seconds` in ns; what is further than some 30 years is no limit.
std::int64_t time_after(double seconds) {
  constexpr double kLongest = 1e9;  // s
  if (!(seconds < kLongest)) return stop_detail::kNever;
  return stop_detail::now() + static_cast<std::int64_t>(1e9 * std::max(seconds, 0.0));
}

}  // namespace

namespace stop_detail {

std::atomic<bool> interrupted{false};
std::atomic<std::int64_t> nearest_limit{kNever};

std::int64_t now() noexcept {
  timespec time = {};
  clock_gettime(CLOCK_MONOTONIC_COARSE, &time);
  return std::int64_t{1000000000} * time.tv_sec + time.tv_nsec;
}

// The outermost limit that is over is named: the work ends there.
void throw_stop() {
  if (waits > 0) return;
  if (interrupted) throw Interrupted();
  const StopAfter* over = nullptr;
  for (const StopAfter* each = innermost; each != nullptr; each = each->outer_)
    if (each->passed()) over = each;
  if (over != nullptr) throw TimeoutError("stopped by " + over->name_);
}

std::int64_t command_limit() noexcept {
  std::int64_t nearest = kNever;
  for (const StopAfter* each = innermost; each != nullptr; each = each->outer_)
    if (each->of_ == LimitOf::command) nearest = std::min(nearest, each->limit_);
  return nearest;
}

}  // namespace stop_detail

void request_stop() noexcept {
  stop_detail::interrupted = true;
}

void forget_stop() noexcept {
  stop_detail::interrupted = false;
}

StopAfter::StopAfter(double seconds, std::string name, LimitOf of)
    : name_(std::move(name)),
      of_(of),
      limit_(time_after(seconds)),
      outer_limit_(stop_detail::nearest_limit),
      outer_(innermost) {
  innermost = this;
  stop_detail::nearest_limit = std::min(outer_limit_, limit_);
}

StopAfter::~StopAfter() {
  stop_detail::nearest_limit = outer_limit_;
  innermost = outer_;
}

double StopAfter::seconds_left() const noexcept {
  return limit_ == stop_detail::kNever ? std::numeric_limits<double>::infinity()
                                       : 1e-9 * static_cast<double>(limit_ - stop_detail::now());
}

StopWaits::StopWaits() {
  ++waits;
}
StopWaits::~StopWaits() {
  --waits;
}

}  // namespace flexel
