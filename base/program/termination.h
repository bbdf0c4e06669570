// What SIGTERM and SIGHUP do, and SIGINT where nobody can hear it. By themselves SIGTERM and SIGHUP end a
// program at once, temporary outputs removed (base/program/program.h); work that leaves something behind when it
// is stopped has them wait.
#pragma once
#include <memory>

namespace flexel {

// While one lives, SIGTERM and SIGHUP ask to stop as SIGINT does (base/stop.h): a second signal ends the
// program at once. The exit code of a program that then stops is 128 + the signal's number.
class TerminationWaits {
 public:
  TerminationWaits();
  ~TerminationWaits();
  TerminationWaits(const TerminationWaits&) = delete;
  TerminationWaits& operator=(const TerminationWaits&) = delete;
};

// While one lives, and no TerminationWaits, Ctrl-C and the time limits of the command that were set before it
// end the process at once, with the line and the exit code that check_stop() would have led to; temporary
// files are removed. For commands that leave nothing when they are stopped, and for calls of libraries that
// cannot be asked to stop. A limit of an attempt is heard only after the call.
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

}  // namespace flexel
