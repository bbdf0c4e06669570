// Viridis by Horner's scheme.
#include "flexel/picture/canvas/colour_map.h"

#include <algorithm>

namespace flexel::picture {

Colour colour_of(float t) {
  static const Colour c0(0.2777273272f, 0.0054073445f, 0.3340998053f),
      c1(0.1050930431f, 1.4046135299f, 1.3845901626f), c2(-0.3308618287f, 0.2148475595f, 0.0950951630f),
      c3(-4.6342304990f, -5.7991009734f, -19.3324409563f), c4(6.2282699363f, 14.1799333668f, 56.6905526007f),
      c5(4.7763849977f, -13.7451453777f, -65.3530326334f), c6(-5.4354558559f, 4.6458526122f, 26.3124352496f);
  const float x = std::clamp(t, 0.0f, 1.0f);
  const Colour sum = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * (c5 + x * c6)))));
  return sum.cwiseMax(0.0f).cwiseMin(1.0f);
}

Colour colour_of_nothing() {
  return colour(0xb8bcc2);
}

}  // namespace flexel::picture
