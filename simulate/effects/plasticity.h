// Plasticity: parts whose material has a yield stress keep part of their deformation. J2 flow with isotropic
// hardening, linear or Voce's (Simo and Hughes 1998, box 9.1), cell by cell. Lives in the kernel
// (simulate/kernels/kernel_plastic.h); docs/reference/fracture-plasticity.md.
#pragma once
#include "simulate/effects/effect.h"

namespace flexel::simulate {

class Plasticity : public Effect {
 public:
  struct Entry {
    std::optional<double> yield, hardening;  // Pa; nothing: the material's
    std::optional<std::string> part;         // nothing: every part
    std::string origin;
  };
  struct Parameters {
    std::vector<Entry> entries;  // which goes before which: entries_of_parts()
  };
  static constexpr const char* name = "plasticity";

  static void parse(TableReader& scene, Parameters& parameters);
  // Throws InputError: an unknown part, a part that is named but has no yield stress or whose model cannot
  // flow, no part that can.
  [[nodiscard]] static std::optional<Plasticity> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;
  void configure_kernel(KernelEffects& plan) const override;
  [[nodiscard]] double kernel_share(const KernelShares& shares) const override { return shares.plasticity; }

 private:
  [[nodiscard]] static PlasticFlow flow_of(const Entry& entry, const Material& material, double yield);

  std::vector<PlasticFlow> flow_;  // (parts)
};

}  // namespace flexel::simulate
