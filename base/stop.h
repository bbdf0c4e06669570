// Stopping work from outside: Ctrl-C and time limits, in one place for the whole process.
//
// Every loop that may take more than some milliseconds calls check_stop(). The loops of base/parallel.h do so
// once a chunk: what is built on them needs nothing more. A serial loop calls it once an item, or once in a
// few where an item takes under 100 ns.
//
//     const StopAfter limit(seconds, "--timeout");   // the work below ends with TimeoutError
//     solve();
//
// Time limits nest. Code that goes on after an attempt took too long checks whose limit it was:
//
//     const StopAfter limit(budget, "--within");
//     try {
//       attempt();
//     } catch (const TimeoutError&) {
//       if (!limit.passed()) throw;                  // an outer limit: the whole command ends
//       give_up_this_attempt();                      // after the scope of `limit` work is possible again
//     }
//
// A checkpoint, or the last sound state, is written under a StopWaits. Calls into libraries that cannot be
// interrupted are made under a StopEndsProcess (base/program/termination.h). Limits belong to the process:
// set them on the thread that owns the run, not on a worker.
#pragma once
#include <atomic>
#include <cstdint>
#include <limits>
#include <string>

namespace flexel {

namespace stop_detail {
inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
extern std::atomic<bool> interrupted;
extern std::atomic<std::int64_t> nearest_limit;  // ns, of the clock below; kNever without one
[[nodiscard]] std::int64_t now() noexcept;       // ns, CLOCK_MONOTONIC_COARSE: some ns a call, 4 ms exact
void throw_stop();                               // unless a StopWaits lives
[[nodiscard]] std::int64_t command_limit() noexcept;  // the nearest limit of the command; kNever without one
}  // namespace stop_detail

// True once SIGINT has arrived (or SIGTERM, SIGHUP: base/program/termination.h).
[[nodiscard]] inline bool interrupted() noexcept {
  return stop_detail::interrupted.load(std::memory_order_relaxed);
}

// For the signal handler: interrupted() becomes true. Safe there.
void request_stop() noexcept;
// For a process that outlives a run that was stopped: the next one may begin.
void forget_stop() noexcept;

// True where check_stop() would throw, but for a StopWaits. For code that may not throw.
[[nodiscard]] inline bool stop_is_due() noexcept {
  const std::int64_t limit = stop_detail::nearest_limit.load(std::memory_order_relaxed);
  return interrupted() || (limit != stop_detail::kNever && stop_detail::now() >= limit);
}

// Throws Interrupted, or TimeoutError ("stopped by --timeout"), when the work is to end. Any thread, the
// bodies of parallel loops too.
inline void check_stop() {
  if (stop_is_due()) [[unlikely]]
    stop_detail::throw_stop();
}

// Whose a time limit is: of the whole command, which ends with it, or of an attempt that the command
// outlives.
enum class LimitOf { command, attempt };

// While one lives, check_stop() throws TimeoutError("stopped by NAME") once `seconds` have gone since it was
// made.
class StopAfter {
 public:
  StopAfter(double seconds, std::string name, LimitOf of = LimitOf::attempt);
  ~StopAfter();
  StopAfter(const StopAfter&) = delete;
  StopAfter& operator=(const StopAfter&) = delete;
  // This limit (not only one around it) has been reached.
  [[nodiscard]] bool passed() const noexcept { return stop_detail::now() >= limit_; }
  [[nodiscard]] double seconds_left() const noexcept;  // below zero once it is over

 private:
  friend void stop_detail::throw_stop();
  friend std::int64_t stop_detail::command_limit() noexcept;
  std::string name_;
  LimitOf of_;
  std::int64_t limit_;        // ns
  std::int64_t outer_limit_;  // the nearest without this one
  const StopAfter* outer_;
};

// While one lives check_stop() lets everything pass, so that what was reached can be written. A second Ctrl-C
// still ends the process at once.
class StopWaits {
 public:
  StopWaits();
  ~StopWaits();
  StopWaits(const StopWaits&) = delete;
  StopWaits& operator=(const StopWaits&) = delete;
};

}  // namespace flexel
