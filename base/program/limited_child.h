// Work on untrusted input in a process of its own, with limits: a crash, a hang or a hunger for memory there
// harms nobody.
#pragma once
#include <functional>
#include <string>

#include "base/files/files.h"

namespace flexel {

struct ChildLimits {
  double processor = 60;  // s of processor time, of all threads together
  double wall = 180;      // s; time in which this process was stopped (Ctrl-Z) does not count
  double memory = 2e9;    // bytes that the child may have in memory
};

// Of what takes one thread so many seconds: another program may have the processor two thirds of the time.
[[nodiscard]] ChildLimits limits_of_child(double seconds, double memory);

enum class ChildEnd { finished, crashed, out_of_time, out_of_memory, not_started };

// What the child exits with.
// The last is what a program exits with whose libraries are not found.
enum ChildCode : int {
  kChildFinished = 0,
  kChildFailed = 1,
  kChildWithoutMemory = 2,
  kChildNotStarted = 127
};

struct ChildOutput {
  ChildEnd end = ChildEnd::crashed;
  Bytes bytes;  // what the child wrote, once finished
};

// Called now and then while the child runs, with all that it has written so far.
using HearOutput = std::function<void(const Bytes& so_far)>;

// Runs `body` in a child (fork) and returns what it writes to the descriptor that it gets; `body` returns the
// child's code. Ctrl-C and time limits end the child, and throw here what check_stop() throws; the child never
// outlives this process. It prints nothing. What `body` throws is a crash, std::bad_alloc apart. Throws InputError:
// no process can be started.
[[nodiscard]] ChildOutput run_in_child(const std::function<int(int out)>& body, const ChildLimits& limits,
                                       const HearOutput& hear = {});

// The same for another program, which finds `input` on stdin and writes to stdout.
[[nodiscard]] ChildOutput run_limited(const std::string& program, const Bytes& input,
                                      const ChildLimits& limits, const HearOutput& hear = {});

}  // namespace flexel
