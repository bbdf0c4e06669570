// Arguments of a program, by CLI11. Only files that declare options include this.
#pragma once
#include <CLI/CLI.hpp>

namespace flexel {

// Parses the arguments with CLI11. --help and --version print and yield their exit code (0); a wrong argument
// throws InputError with the nearest valid option where one is near. Returns true when the program should go
// on, false when it is done (help or version was printed).
[[nodiscard]] bool parse_arguments(CLI::App& app, int argc, char** argv);

// --threads: how many the work may use; 0 is every core.
void add_threads_option(CLI::App& app, int& threads);

}  // namespace flexel
