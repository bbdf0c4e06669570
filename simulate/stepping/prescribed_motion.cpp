// Prescribed components: f = m a of the free advance, R = m (a of the path) - f.
#include "simulate/stepping/prescribed_motion.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace flexel::simulate {

PrescribedMotion::PrescribedMotion(const Constraints& constraints, const Body& body, State& state, bool fresh)
    : constraints_(constraints), body_(body) {
  for (std::uint32_t e = 0; e < constraints.mask.size(); ++e) {
    if (!constraints.mask[e]) continue;
    for (int axis = 0; axis < 3; ++axis)
      if (fresh && constraints.mask[e] >> axis & 1) {
        state.displacement[e][axis] = path(e, axis, state);
        state.velocity[e][axis] = 0;
      }
    entries_.push_back({e, state.displacement[e], Vec3::Zero()});
  }
}

double PrescribedMotion::path(std::uint32_t element, int axis, const State& state) const {
  const std::uint32_t motion = constraints_.motion[element][static_cast<std::size_t>(axis)];
  const auto at = [&](double time) {
    State then;
    then.time = time;
    then.share = state.share;
    return constraints_.path(body_, element, axis, constraints_.courses[motion].at(then));
  };
  if (state.time && *state.time > end_) return 2 * at(end_) - at(2 * end_ - *state.time);
  return constraints_.path(body_, element, axis, constraints_.courses[motion].at(state));
}

void PrescribedMotion::impose(State& state, const std::vector<double>& mass, const step::Advance& advance) {
  parallel_for_each(entries_.size(), [&](std::size_t i) {
    Entry& entry = entries_[i];
    const std::uint32_t e = entry.element;
    Vec3& u = state.displacement[e];
    Vec3& v = state.velocity[e];
    for (int axis = 0; axis < 3; ++axis) {
      if (!(constraints_.mask[e] >> axis & 1)) continue;
      const double wanted = path(e, axis, state);
      const double velocity = (wanted - entry.displacement[axis]) / advance.drift;
      entry.force[axis] = mass[e] * (velocity - v[axis]) / advance.kick;
      u[axis] = wanted;
      v[axis] = velocity;
    }
    entry.displacement = u;
  });
}

double PrescribedMotion::farthest_off_path(const State& state) const {
  double farthest = 0;
  for (const Entry& entry : entries_)
    for (int axis = 0; axis < 3; ++axis)
      if (constraints_.mask[entry.element] >> axis & 1)
        farthest = std::max(
            farthest, std::abs(state.displacement[entry.element][axis] - path(entry.element, axis, state)));
  return farthest;
}

void PrescribedMotion::put_on_path(State& state) {
  for (Entry& entry : entries_) {
    for (int axis = 0; axis < 3; ++axis)
      if (constraints_.mask[entry.element] >> axis & 1)
        state.displacement[entry.element][axis] = path(entry.element, axis, state);
    entry.displacement = state.displacement[entry.element];
  }
}

void PrescribedMotion::settle(const State& state, const std::vector<Vec3>& supports) {
  for (Entry& entry : entries_) {
    entry.displacement = state.displacement[entry.element];
    entry.force = supports[entry.element];
  }
}

void PrescribedMotion::impose_velocity(const State& end, double drift, std::vector<Vec3>& velocity) const {
  for (const Entry& entry : entries_)
    for (int axis = 0; axis < 3; ++axis)
      if (constraints_.mask[entry.element] >> axis & 1)
        velocity[entry.element][axis] = (path(entry.element, axis, end) - entry.displacement[axis]) / drift;
}

void PrescribedMotion::copy(const std::vector<Vec3>& from, std::vector<Vec3>& values) const {
  for (const Entry& entry : entries_)
    for (int axis = 0; axis < 3; ++axis)
      if (constraints_.mask[entry.element] >> axis & 1)
        values[entry.element][axis] = from[entry.element][axis];
}

void PrescribedMotion::add_change(const std::vector<Vec3>& from, const std::vector<Vec3>& to,
                                  std::vector<Vec3>& sum) const {
  for (const Entry& entry : entries_)
    for (int axis = 0; axis < 3; ++axis)
      if (constraints_.mask[entry.element] >> axis & 1)
        sum[entry.element][axis] += to[entry.element][axis] - from[entry.element][axis];
}

void PrescribedMotion::add_forces(std::vector<Vec3>& forces) const {
  for (const Entry& entry : entries_) forces[entry.element] += entry.force;
}

}  // namespace flexel::simulate
