// Elements that follow a path exactly in a timed run: after each free advance they are put where the path
// wants them, and what that took is their support's force.
#pragma once
#include <vector>

#include "simulate/constraints.h"
#include "simulate/state.h"
#include "simulate/time/kernel.h"

namespace flexel {

class Held {
 public:
  // Both must outlive it. Puts the held components of `state` on their paths at its time.
  Held(const Constraints& constraints, const Body& body, State& state);

  // Call after the velocities and displacements have been advanced as if free to `state.time`, by `advance`.
  // Gives the power [W] of the supports' forces at the time before, with the mean velocity.
  double impose(State& state, const std::vector<double>& mass, const step::Advance& advance);

  // Minus the supports' forces at the time before the last advance [N]; 0 for free components. (elements)
  void add_unbalanced(std::vector<Vec3>& unbalanced) const;
  [[nodiscard]] Vec3 total_force() const;  // N, of the supports

 private:
  struct Entry {
    std::uint32_t element = 0;
    Vec3 displacement = Vec3::Zero(), velocity = Vec3::Zero();  // that it last had
    Vec3 force = Vec3::Zero();                                  // N, of the support
  };
  [[nodiscard]] double path(std::uint32_t element, int axis, const State& state) const;

  const Constraints& constraints_;
  const Body& body_;
  std::vector<Entry> entries_;  // ascending by element
};

}  // namespace flexel
