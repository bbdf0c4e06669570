// From a number to a colour.
#pragma once
#include "flexel/picture/canvas/image.h"

namespace flexel::picture {

// Viridis (van der Walt and Smith, 2015; CC0), perceptually uniform, dark blue at 0 to yellow at 1; sRGB. `t`
// outside [0, 1] is clamped. Polynomials of degree 6 fitted by M. Zucker (CC0), within 0.01 of the table.
[[nodiscard]] Colour colour_of(float t);

// What has no value (NaN).
[[nodiscard]] Colour colour_of_nothing();

}  // namespace flexel::picture
