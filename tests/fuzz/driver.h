// Fuzzing without a special compiler: deterministic mutations of good inputs, run under the sanitizers by
// tools/check and, shortly, in every build by ctest.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel::fuzz {

[[nodiscard]] Bytes bytes_of(const std::string& text);

// Mutates `corpus` and hands each mutant to `read` as the name of a file that holds it. `read` may return or
// throw InputError; anything else (another exception, a crash, more than 20 s) is a failure. A mutant that
// failed stays in the file, whose name is printed. Arguments: --iterations N (default 500), --seconds S (stop
// then; default none), --first N (mutant to begin with). Returns the exit code for main.
[[nodiscard]] int run(int argc, char** argv, const std::string& name, const std::vector<Bytes>& corpus,
                      const std::function<void(const std::string& path)>& read);

}  // namespace flexel::fuzz
