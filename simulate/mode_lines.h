// Modes as lines for people.
#pragma once
#include <string>
#include <vector>

#include "simulate/result/result.h"

namespace flexel::simulate {

// One line a mode and one about all; `mass` is the body's [kg].
[[nodiscard]] std::vector<std::string> mode_lines(const ModesSummary& summary, double mass);

}  // namespace flexel::simulate
