// Heat and shrinkage at equilibrium: matter expands freely by simulate/thermal/free_strain.h, and stress is that of the
// strain beside it. Models `cells` (rest shapes) and `quadratic` (forces of the free strain); docs/reference/thermal.md.
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/thermal/thermal_settings.h"

namespace flexel::simulate {

class Thermal : public Effect {
 public:
  using Parameters = ThermalSettings;
  static constexpr const char* name = "thermal";

  static void parse(TableReader& scene, Parameters& parameters);
  // Throws InputError: a model or a law that has no free strain.
  static void refuse_unfit(const Parameters& parameters, const Body& body, const std::vector<Model>& models,
                           const std::vector<Material>& materials);
  // Throws InputError: a timed run, and as above.
  [[nodiscard]] static std::optional<Thermal> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override { return why_; }
  [[nodiscard]] bool drives() const override { return true; }
  [[nodiscard]] bool constant() const override { return true; }

 private:
  std::string why_;
};

}  // namespace flexel::simulate
