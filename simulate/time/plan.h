// What the effects that live inside the hot kernel ask of a timed run. Filled by their `compose` hooks,
// before the stepper is made.
#pragma once
#include <vector>

namespace flexel {

struct StepPlan {
  std::vector<double> damping;  // (parts) s, the time tau of the internal damping; 0: none
};

}  // namespace flexel
