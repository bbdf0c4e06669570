// What SIGTERM and SIGHUP do. By themselves they end a program at once, temporary outputs removed
// (formats/program.h); work that leaves something behind when it is stopped has them wait.
#pragma once

namespace flexel {

// While one lives, SIGTERM and SIGHUP ask to stop as SIGINT does: interrupted() becomes true, a second signal
// ends the program at once. The exit code of a program that then stops is 128 + the signal's number.
class TerminationWaits {
 public:
  TerminationWaits();
  ~TerminationWaits();
  TerminationWaits(const TerminationWaits&) = delete;
  TerminationWaits& operator=(const TerminationWaits&) = delete;
};

}  // namespace flexel
