// The unit of length in an OpenVDB file, which has no place of its own for it.
#pragma once

namespace flexel {

// The name of a grid's text metadata with the unit of its transform: "m".
inline constexpr const char* kLengthMetadata = "length_unit";

}  // namespace flexel
