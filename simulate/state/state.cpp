// What a body says of its own motion.
#include "simulate/state/state.h"

namespace flexel::simulate {

State state_of(const Body& body) {
  State state;
  state.time = 0;
  state.displacement.resize(body.element_count());
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.displacement[e] = body.position[e] - body.rest[e];
  state.velocity.assign(body.element_count(), Vec3::Zero());
  const auto found = body.element_columns.find("velocity");
  if (found == body.element_columns.end() || found->second.components != 3) return state;
  const std::vector<double>& values = found->second.values;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.velocity[e] = Vec3(values[3 * e], values[3 * e + 1], values[3 * e + 2]);
  return state;
}

}  // namespace flexel::simulate
