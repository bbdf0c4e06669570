// The exceptions that cross a stage. Each is caught once, at the edge of the program (base/program/program.h), and
// becomes one line on stderr and an exit code.
#pragma once
#include <stdexcept>
#include <string>

namespace flexel {

// Exit codes, fixed by the design.
enum ExitCode : int {
  kExitDone = 0,
  kExitOurFault = 1,
  kExitInput = 2,
  kExitDiverged = 3,
  kExitInvalidMapping = 4,
  kExitTimeout = 5,
  kExitInterrupted = 130,
  kExitReaderClosedPipe = 141,
};

// Something that the user can put right: the input, the arguments or the environment (exit 2). `what()` says
// what is wrong and what to do, on one line; `where` is "file:line", "file" or empty.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& what) : std::runtime_error(what) {}
  InputError(std::string where, const std::string& what)
      : std::runtime_error(what), where_(std::move(where)) {}
  [[nodiscard]] const std::string& where() const { return where_; }

 private:
  std::string where_;
};

// The simulation diverged (exit 3). `what()` names the step, the element and a suggestion. The caller that
// knows the output's name saves the last good state under <out>.failed.vtu first.
class DivergedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// --strict found an invalid mapping, or `flexel flex` missed its angle by half (exit 4).
class InvalidMappingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The time that --timeout allows ran out (exit 5). `what()` says how far the run had come.
class TimeoutError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// SIGINT arrived and the work was stopped cleanly (exit 130).
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

// The reader of our stdout went away (exit 141, silently).
class ReaderClosedPipe : public std::runtime_error {
 public:
  ReaderClosedPipe() : std::runtime_error("the reader closed the pipe") {}
};

}  // namespace flexel
