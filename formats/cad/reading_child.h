// Work on untrusted input in a process of its own, with limits: a crash, a hang or a hunger for memory there
// harms nobody.
#pragma once
#include <functional>

#include "base/files/files.h"

namespace flexel {

struct ChildLimits {
  double processor = 60;  // s of processor time, of all threads together
  double wall = 180;      // s; time in which this process was stopped (Ctrl-Z) does not count
  double memory = 2e9;    // bytes that the child may have in memory beyond what this process has
};

enum class ChildEnd { finished, crashed, out_of_time, out_of_memory };

struct ChildOutput {
  ChildEnd end = ChildEnd::crashed;
  Bytes bytes;  // what `work` returned, once finished
};

// Runs `work` in a child and hands over what it returns. Ctrl-C and time limits end the child, and throw here
// what check_stop() throws; the child never outlives this process. It prints nothing. What `work` throws is a
// crash, std::bad_alloc apart. In the child `work` may start threads, but not use those of base/parallel.h.
// Throws InputError: no process can be started.
[[nodiscard]] ChildOutput run_in_child(const std::function<Bytes()>& work, const ChildLimits& limits);

// In the child: ends it as out of memory. For libraries that say so in another way than by std::bad_alloc.
[[noreturn]] void end_child_without_memory() noexcept;

}  // namespace flexel
