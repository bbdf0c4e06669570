// What an act is made from: the state of a body, and the setting.
#include "simulate/time/act.h"

namespace flexel {

State beginning(const Body& body) {
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

Setting timed_setting(const Body& body, const Scene& scene, const Beginning& beginning) {
  return {body,
          materials_of_parts(scene, body),
          {},
          models_of_parts(scene, body),
          hooke_of_parts(scene, body),
          {},
          scene.run.time,
          beginning.settled,
          beginning.bonding_parts,
          RigidParts::rigidity(scene.get<RigidParts>(), body)};
}

}  // namespace flexel
