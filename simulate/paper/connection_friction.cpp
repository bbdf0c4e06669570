// Worked out at both ends of a connection, with the same bits: momentum is kept exactly.
#include "simulate/paper/connection_friction.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/effects/part_entries.h"
#include "simulate/matter/masses.h"
#include "simulate/models/paper_model.h"

namespace flexel::simulate {

void ConnectionFriction::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("internal_friction")) {
    TableReader reader(*table, scene.file(), "[internal_friction]");
    Entry entry;
    entry.origin = reader.place();
    const std::optional<double> coefficient = reader.number("coefficient");
    entry.part = reader.text("part");
    reader.finish();
    if (!coefficient) reader.fail("[internal_friction] needs \"coefficient\", for example 0.3");
    if (!(*coefficient >= 0)) reader.fail("\"coefficient\" needs to be 0 or more");
    entry.coefficient = *coefficient;
    parameters.entries.push_back(entry);
  }
}

std::vector<double> ConnectionFriction::coefficients(const Parameters& parameters, const Problem& problem) {
  std::vector<double> coefficient(problem.body.parts.size(), 0);
  if (parameters.entries.empty()) return coefficient;
  bool any = false;
  for (const auto& [each, parts] : entries_of_parts(parameters.entries, problem.body))
    for (const std::uint32_t p : parts) {
      const Entry& entry = *each;
      const bool has_connections = model_of(problem, p) == Model::paper;
      if (entry.part && !has_connections)
        throw InputError(entry.origin, fmt::format("part \"{}\" has no internal friction: it acts along the "
                                                   "connections of model \"paper\"",
                                                   *entry.part));
      if (!has_connections) continue;
      coefficient[p] = entry.coefficient;
      any = true;
    }
  if (!any)
    throw InputError(parameters.entries[0].origin,
                     "no part can have internal friction: it acts along the connections of model \"paper\"");
  return coefficient;
}

std::optional<ConnectionFriction> ConnectionFriction::make(const Parameters& parameters,
                                                           const Problem& problem) {
  if (parameters.entries.empty()) return std::nullopt;
  ConnectionFriction made;
  made.entries_ = parameters.entries.size();
  made.coefficient_ = coefficients(parameters, problem);
  if (*std::max_element(made.coefficient_.begin(), made.coefficient_.end()) == 0) return std::nullopt;
  made.mass_ = lumped_masses(problem);
  made.body_ = &problem.body;
  return made;
}

std::string ConnectionFriction::why() const {
  return fmt::format("{} [internal_friction]", entries_);
}

void ConnectionFriction::attach(const PaperModel& model, const std::vector<double>& damping) {
  model_ = &model;
  friction_ = connection_factors(*body_, model.rows(), "friction");
  tau_ = damping;
}

void ConnectionFriction::add_forces(const State& state, std::vector<Vec3>& forces) {
  if (!model_ || !(state.kick > 0)) return;
  parallel_for_each(
      forces.size(),
      [&](std::size_t at) {
        const auto e = static_cast<std::uint32_t>(at);
        const auto row = model_->rows().of(e);
        const double mu = coefficient_[model_->part_of(e)], tau = tau_[model_->part_of(e)];
        if (row.empty() || mu == 0) return;
        for (const ConnectionRows::Entry& entry : row) {
          const std::uint32_t p = entry.other;
          const double stiffness = model_->stiffness(e, entry);
          if (stiffness == 0) continue;
          const Stretch now = model_->stretched(state, e, entry);
          const Vec3 velocity = state.velocity[e] - state.velocity[p];
          const double along = velocity.dot(now.direction);
          const Vec3 sliding = velocity - along * now.direction;
          const double speed = sliding.norm();
          if (!(speed > 0)) continue;
          const double normal = stiffness * (now.elongation - tau * model_->damping_factor(entry) * along);
          const double connections = static_cast<double>(std::max(row.size(), model_->rows().of(p).size()));
          const double most =
              mass_[e] * mass_[p] / (mass_[e] + mass_[p]) * speed / (state.kick * connections);
          const double factor = friction_.empty() ? 1 : friction_[model_->place(entry)];
          const double friction = std::min(std::abs(mu * factor * normal), most);
          forces[e] -= (friction / speed) * sliding;
        }
      },
      512);
}

}  // namespace flexel::simulate
