// Fracture: cells that are pulled beyond their strength, or flow beyond their elongation, resist no more;
// their matter stays in the scene and moves on (Jansson and Vergeest, section 3.2: a connection ends where
// its length passes a threshold, equation 2). Lives in the kernel (simulate/kernels/kernel_plastic.h);
// docs/reference/fracture-plasticity.md.
#pragma once
#include "simulate/effects/effect.h"

namespace flexel::simulate {

class Fracture : public Effect {
 public:
  struct Entry {
    std::optional<double> strength;    // Pa; nothing: the material's
    std::optional<double> elongation;  // plastic strain; nothing: the material's
    std::optional<std::string> part;   // nothing: every part
    std::string origin;
  };
  struct Parameters {
    std::vector<Entry> entries;  // which goes before which: entries_of_parts()
  };
  static constexpr const char* name = "fracture";

  static void parse(TableReader& scene, Parameters& parameters);
  // Throws InputError: an unknown part, a part that is named but has neither limit or whose model cannot
  // break, no part that can.
  [[nodiscard]] static std::optional<Fracture> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;
  void configure_kernel(KernelEffects& plan) const override;
  // In model `cells` a limit of elongation needs plasticity.
  void check_kernel(const KernelEffects& plan) const override;
  [[nodiscard]] double kernel_share(const KernelShares& shares) const override { return shares.fracture; }

 private:
  std::vector<FractureLimits> limits_;  // (parts)
  std::vector<bool> needs_flow_;        // (parts) an elongation of cells
  std::string origin_;
};

}  // namespace flexel::simulate
