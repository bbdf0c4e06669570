// The version of the programs.
#pragma once

namespace flexel {

// "0.1.0"
[[nodiscard]] const char* version();

}  // namespace flexel
