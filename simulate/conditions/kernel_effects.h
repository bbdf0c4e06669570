// What the effects that live inside the hot kernel ask of a timed run. Filled by configure_kernel() of each,
// before the stepper is made.
#pragma once
#include <cmath>
#include <limits>
#include <vector>

namespace flexel::simulate {

// The yield stress at the equivalent plastic strain a: yield + hardening a + saturation (1 - exp(-rate a)), the last term
// Voce's (Journal of the Institute of Metals 74, 1948).
struct PlasticFlow {
  double yield = std::numeric_limits<double>::infinity();  // Pa; infinity: elastic
  double hardening = 0;                                    // Pa
  double saturation = 0, rate = 0;                         // Pa, 1
};

struct FractureLimits {                                         // infinity: none
  double strength = std::numeric_limits<double>::infinity();    // Pa
  double elongation = std::numeric_limits<double>::infinity();  // plastic strain
  // Pa, in place of `strength` where the part hardens by Voce's law: the true stress at the load that it stands for
  double flowing_strength = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool any() const { return std::isfinite(strength) || std::isfinite(elongation); }
};

struct KernelEffects {
  std::vector<double> damping;                // (parts) s, the time tau of the internal damping; 0: none
  std::vector<PlasticFlow> plasticity = {};   // (parts); empty: none
  std::vector<FractureLimits> fracture = {};  // (parts); empty: none
  bool broken_springs = false;  // the body remembers springs that broke (simulate/models/rest_shape.h)
  bool rest_shapes = false;     // cells have rest shapes of their own (simulate/models/rest_shape.h)

  // Whether the elastic energy of the cells is another than that of the lattice's shape, unbroken.
  [[nodiscard]] bool remembers() const {
    return !plasticity.empty() || !fracture.empty() || rest_shapes || broken_springs;
  }
};

// The shares of the hot loop's time that its effects take; the rest is the model.
struct KernelShares {
  double damping = 0, plasticity = 0, fracture = 0;
};

}  // namespace flexel::simulate
