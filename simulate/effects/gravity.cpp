// Weight: a dead force on every element, in proportion to the load share.
#include "simulate/effects/gravity.h"

#include "formats/parallel.h"
#include "simulate/carrier.h"

namespace flexel {

void Gravity::parse(TableReader& scene, Parameters& parameters) {
  const SceneValue* table = scene.find("gravity");
  if (!table) return;
  TableReader reader(*table, scene.file(), "[gravity]");
  parameters.acceleration =
      reader.to_vector(reader.require("acceleration", "[\"0 m/s2\", \"0 m/s2\", \"-9.81 m/s2\"]"),
                       Dimension::acceleration, "acceleration");
  reader.finish();
}

std::optional<Gravity> Gravity::make(const Parameters& parameters, const Setting& setting) {
  if (!parameters.acceleration) return std::nullopt;
  Gravity gravity;
  gravity.acceleration_ = *parameters.acceleration;
  gravity.mass_ = element_masses(setting);
  return gravity;
}

std::string Gravity::why() const {
  return "[gravity]";
}

double Gravity::energy(const State& state) const {
  return -state.share * parallel_sum<double>(mass_.size(), [&](std::size_t e) {
    return mass_[e] * acceleration_.dot(state.displacement[e]);
  });
}

void Gravity::add_forces(const State& state, std::vector<Vec3>& forces) const {
  parallel_for_each(mass_.size(),
                    [&](std::size_t e) { forces[e] += (state.share * mass_[e]) * acceleration_; });
}

void Gravity::report(const State& state, const std::vector<Vec3>&, SimulateResult& result) const {
  const double mass = parallel_sum<double>(mass_.size(), [&](std::size_t e) { return mass_[e]; });
  result.loads.push_back({"gravity", state.share * mass * acceleration_});
}

}  // namespace flexel
