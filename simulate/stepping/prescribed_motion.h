// Elements that follow a path exactly in a timed run: after each free advance they are put where the path
// wants them, and what that took is their support's force.
#pragma once
#include <limits>
#include <vector>

#include "simulate/conditions/constraints.h"
#include "simulate/kernels/kernel.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

class PrescribedMotion {
 public:
  // Both must outlive it. With `fresh` puts the held components of `state` on their paths at its time, at
  // rest; without, they are on them.
  PrescribedMotion(const Constraints& constraints, const Body& body, State& state, bool fresh = true);

  // Call after the velocities and displacements have been advanced as if free to `state.time`, by `advance`.
  void impose(State& state, const std::vector<double>& mass, const step::Advance& advance);

  // Likewise after an advance that already led there, with the supports' forces [N] (elements).
  void settle(const State& state, const std::vector<Vec3>& supports);

  // Sets the held components of `velocity` [m/s] to those that lead to the path at `end.time`, `drift` s
  // away.
  void impose_velocity(const State& end, double drift, std::vector<Vec3>& velocity) const;
  // Sets the held components to those of `from`.
  void copy(const std::vector<Vec3>& from, std::vector<Vec3>& values) const;
  // Adds to those of `sum` what they have changed by.
  void add_change(const std::vector<Vec3>& from, const std::vector<Vec3>& to, std::vector<Vec3>& sum) const;

  // Adds the supports' forces at the time before the last advance [N] (elements); 0 for free components.
  void add_forces(std::vector<Vec3>& forces) const;

  // m, the largest distance of a held component of `state` from its path.
  [[nodiscard]] double farthest_off_path(const State& state) const;
  // Between two steps: puts them there.
  void put_on_path(State& state);

  // From the time `end` [s] on, where the run is over, paths go on as they came there.
  void go_on_beyond(double end) { end_ = end; }

  [[nodiscard]] const Body& body() const { return body_; }

 private:
  struct Entry {
    std::uint32_t element = 0;
    Vec3 displacement = Vec3::Zero();  // that it last had
    Vec3 force = Vec3::Zero();         // N, of the support
  };
  [[nodiscard]] double path(std::uint32_t element, int axis, const State& state) const;

  const Constraints& constraints_;
  const Body& body_;
  std::vector<Entry> entries_;  // ascending by element
  double end_ = std::numeric_limits<double>::infinity();
};

}  // namespace flexel::simulate
