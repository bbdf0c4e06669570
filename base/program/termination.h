// Scopes that change how a process is stopped. By default SIGTERM and SIGHUP remove the temporary outputs and
// end the program at once (base/program/program.h), and SIGINT and time limits stop it at the next
// check_stop().
#pragma once
#include <memory>

namespace flexel {

// In this scope SIGTERM and SIGHUP stop the work as SIGINT does (base/stop.h), so that it can write a
// checkpoint or its last state; a second signal ends the program at once. The exit code is 128 + the signal's
// number.
class TerminationWaits {
 public:
  TerminationWaits();
  ~TerminationWaits();
  TerminationWaits(const TerminationWaits&) = delete;
  TerminationWaits& operator=(const TerminationWaits&) = delete;
};

// In this scope, unless there is a TerminationWaits too, Ctrl-C and the command's time limits that were set
// before it end the process at once, with the message and exit code of check_stop(); temporary files are
// removed. For commands that leave nothing when they are stopped, and for calls into libraries that cannot be
// interrupted. The limit of an attempt takes effect only after the call.
class StopEndsProcess {
 public:
  StopEndsProcess();
  ~StopEndsProcess();
  StopEndsProcess(const StopEndsProcess&) = delete;
  StopEndsProcess& operator=(const StopEndsProcess&) = delete;

 private:
  class Watch;
  std::unique_ptr<Watch> watch_;  // null: the command has no limit
};

// For a library within another's process, before anything runs: from now on nothing here ends the process, and every stop
// waits for the next check_stop().
void never_end_process() noexcept;

}  // namespace flexel
