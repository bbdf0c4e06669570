// Runs other programs as child processes: with a deadline, interrupted together with this process, time and
// memory measured by the kernel.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace flexel {

// How a child process ended and what it used, its own children that it waited for included.
struct ChildRun {
  int exit_code = 0;         // 128 + signal where a signal ended it
  bool out_of_time = false;  // it was stopped at the deadline
  double wall = 0, cpu = 0;  // s; cpu of all threads, user and system
  double memory = 0;         // bytes, largest resident set of any one of the processes
};

// When a child is stopped.
using Deadline = std::chrono::steady_clock::time_point;
inline constexpr Deadline kNever = Deadline::max();

struct ChildOptions {
  std::filesystem::path log;             // stdout and stderr go there
  std::filesystem::path folder;          // the working folder; "": that of this process
  std::vector<std::string> environment;  // "NAME=VALUE", added to this process's
  Deadline deadline = kNever;
  bool heed_interrupts = true;      // false: an interrupt that has come already does not count
  std::function<void()> meanwhile;  // called some ten times a second while it runs
};

// Runs the program (argv[0] its path) with stdin from /dev/null, and waits for it. An interrupt (SIGINT) is
// passed on; when the child has ended Interrupted is thrown. So is the deadline, as SIGINT. A child that
// lives on for two seconds gets SIGKILL. Throws InputError: it cannot be started, the log cannot be written.
[[nodiscard]] ChildRun run_child(const std::vector<std::string>& argv, const ChildOptions& options);

// The path of any other program, from PATH; "" where it is not there.
[[nodiscard]] std::string find_program(const std::string& name);

}  // namespace flexel
