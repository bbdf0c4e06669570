// What the effects that live inside the hot kernel ask of a timed run. Filled by their `compose` hooks,
// before the stepper is made.
#pragma once
#include <cmath>
#include <limits>
#include <vector>

namespace flexel {

struct PlasticFlow {
  double yield = std::numeric_limits<double>::infinity();  // Pa; infinity: elastic
  double hardening = 0;                                    // Pa
};

struct FractureLimits {                                         // infinity: none
  double strength = std::numeric_limits<double>::infinity();    // Pa
  double elongation = std::numeric_limits<double>::infinity();  // plastic strain
  [[nodiscard]] bool any() const { return std::isfinite(strength) || std::isfinite(elongation); }
};

struct StepPlan {
  std::vector<double> damping;                // (parts) s, the time tau of the internal damping; 0: none
  std::vector<PlasticFlow> plasticity = {};   // (parts); empty: none
  std::vector<FractureLimits> fracture = {};  // (parts); empty: none
};

}  // namespace flexel
