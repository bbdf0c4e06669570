// Internal damping: every connection and every cell resists the rate of its strain as a dashpot of tau times
// its stiffness does (Jansson and Vergeest, equations 3 and 18, b = tau k). On relative velocities only: free
// motion and momentum are untouched. A swing of angular frequency omega decays with the ratio zeta = tau
// omega / 2; so tau = zeta T / pi has the ratio zeta at a period T. Lives in the kernel
// (simulate/kernels/kernel_table.cpp).
#pragma once
#include "simulate/effects/effect.h"

namespace flexel::simulate {

class Damping : public Effect {
 public:
  struct Entry {
    double time = 0;                  // s, tau; without a period
    std::optional<std::string> part;  // nothing: every part
    std::string origin;
    double period = 0;                 // s, of the swing that decays with the ratio; 0: `time` is given
    std::optional<double> ratio = {};  // zeta; nothing: the material's
  };
  struct Parameters {
    std::vector<Entry> entries;  // which goes before which: entries_of_parts()
  };
  static constexpr const char* name = "damping";

  static void parse(TableReader& scene, Parameters& parameters);
  // Throws InputError: an unknown part, a period without a ratio, here or of the material.
  [[nodiscard]] static std::optional<Damping> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;
  void configure_kernel(KernelEffects& plan) const override;
  [[nodiscard]] double kernel_share(const KernelShares& shares) const override { return shares.damping; }

 private:
  std::vector<double> time_;  // (parts) s
  std::size_t entries_ = 0;
};

}  // namespace flexel::simulate
