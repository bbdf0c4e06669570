// What touches a part, or is about to.
#pragma once
#include <limits>

namespace flexel::simulate {

struct PartTouch {
  // m, the smallest to another surface, or another place of its own; below 0: it is pressed. Infinity:
  // nothing is near.
  double gap = std::numeric_limits<double>::infinity();
  double soon =
      std::numeric_limits<double>::infinity();  // m, what it may fall to in the time that was asked for
  double stored = 0;                            // J, that its contacts store
};

}  // namespace flexel::simulate
