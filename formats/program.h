// The edge of a program: arguments in, one line of error and an exit code out.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "formats/error.h"

namespace flexel {

// Runs `body` and turns whatever it throws into one line `NAME: error: [WHERE: ]WHAT` on stderr and the
// design's exit code. Installs the handlers: SIGPIPE is ignored (a closed pipe surfaces as ReaderClosedPipe),
// SIGINT is heard by check_stop() (formats/stop.h); a second one ends the process at once. Returns the exit
// code for main.
[[nodiscard]] int run_program(const std::string& name, const std::function<int()>& body);

// Parses the arguments with CLI11. --help and --version print and yield their exit code (0); a wrong argument
// throws InputError with the nearest valid option where one is near. Returns true when the program should go
// on, false when it is done (help or version was printed).
[[nodiscard]] bool parse_arguments(CLI::App& app, int argc, char** argv);

// The candidate nearest to `word` by edit distance, or "" where none is within a third of its length (at
// least 2 edits).
[[nodiscard]] std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);
// `; did you mean "X"?` or "".
[[nodiscard]] std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

// Program version, "0.1.0".
[[nodiscard]] const char* version();

}  // namespace flexel
