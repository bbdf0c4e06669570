// [[velocity]] of a scene, resolved to elements.
#include "simulate/effects/initial_velocity.h"

#include <fmt/format.h>

#include "base/error.h"
#include "simulate/input/scene_selection.h"

namespace flexel::simulate {

void InitialVelocity::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("velocity")) {
    TableReader reader(*table, scene.file(), "[[velocity]]");
    StartingVelocity start;
    start.origin = reader.place();
    start.where = require_where(reader);
    const std::optional<Vec3> velocity = reader.vector("velocity", Dimension::velocity);
    if (velocity) start.velocity = *velocity;
    if (const SceneValue* value = reader.find("spin")) {
      TableReader spin(*value, reader.file(), "spin of [[velocity]]");
      (void)spin.require("axis", "[0, 0, 1]");
      const Vec3 axis = *spin.direction("axis");
      start.through = spin.to_vector(spin.require("through", "[\"0 mm\", \"0 mm\", \"0 mm\"]"),
                                     Dimension::length, "through");
      // an angle a second: "1 turn", "360 deg"
      start.spin = axis * spin.to_quantity(spin.require("angle_per_second", "\"360 deg\""), Dimension::angle,
                                           "angle_per_second");
      spin.finish();
    }
    reader.finish();
    if (!velocity && start.spin == Vec3::Zero())
      reader.fail(
          "[[velocity]] needs \"velocity\" (for example [\"1 m/s\", \"0 m/s\", \"0 m/s\"]) or \"spin\"");
    parameters.velocities.push_back(start);
  }
}

std::optional<InitialVelocity> InitialVelocity::make(const Parameters& parameters, const Problem& problem) {
  if (parameters.velocities.empty()) return std::nullopt;
  InitialVelocity made;
  made.count_ = parameters.velocities.size();
  made.velocity_.assign(problem.body.element_count(), Vec3::Zero());
  for (const StartingVelocity& start : parameters.velocities) {
    const Selected selected = resolve(start.where, problem.body);
    if (!selected.polygons.empty())
      throw InputError(start.origin,
                       fmt::format("[[velocity]] needs a part, box, sphere or half-space; {} selects surface",
                                   describe(start.where)));
    for (const std::uint32_t e : selected.elements)
      made.velocity_[e] += start.velocity + start.spin.cross(problem.body.position[e] - start.through);
  }
  return made;
}

std::string InitialVelocity::why() const {
  return fmt::format("{} [[velocity]]", count_);
}

void InitialVelocity::add_initial_state(State& state) {
  for (std::size_t e = 0; e < velocity_.size(); ++e) state.velocity[e] += velocity_[e];
}

}  // namespace flexel::simulate
