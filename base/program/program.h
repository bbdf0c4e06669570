// The entry point of every program: turns exceptions into one line on stderr and an exit code.
#pragma once
#include <functional>
#include <string>

namespace flexel {

// Runs `body` and turns whatever it throws into one line `NAME: error: [WHERE: ]WHAT` on stderr and the
// design's exit code, which it returns for main. Installs the handlers of base/program/signals.h.
[[nodiscard]] int run_program(const std::string& name, const std::function<int()>& body);

}  // namespace flexel
