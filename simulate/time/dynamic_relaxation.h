// Equilibrium where parts touch, or are rigid: a run in a time of its own, whose motion is taken out until
// nothing moves any more.
//
// Adaptive dynamic relaxation (Underwood 1983): all velocities decay at the rate 2 omega, which is critical
// for a swing of angular frequency omega. omega^2 is Rayleigh's quotient of the present motion,
//     -v . (F+ - F) / (dt v . M v)
// (F, F+ the forces before and after a way of v dt, M the masses): fast swings die first, and then it is that
// of the slowest one left. What falls freely is not damped.
//
// Loads and moves grow evenly, tools take their paths, and what begins inside something else is let out, in
// the first ten times that sound takes through the body; the run then has 3000 such times to come to rest.
#pragma once
#include <functional>
#include <vector>

#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Whether a scene without a time is brought to rest this way.
[[nodiscard]] bool settles(const Scene& scene);

class DynamicRelaxation {
 public:
  // Gives `scene`, which it must outlive, the courses of a run that settles. Throws InputError: what it does
  // not take.
  DynamicRelaxation(Scene& scene, const Body& body);

  // Before a step: the velocities that it begins with.
  void before(const State& state);
  // After it: what all velocities are to be multiplied by. `tell` gives loads and reactions.
  [[nodiscard]] double after(const State& state, const std::vector<double>& mass,
                             const std::function<void(SimulateResult&)>& tell);
  [[nodiscard]] bool done() const { return done_; }
  [[nodiscard]] const SettleSummary& summary() const { return summary_; }
  void report(SimulateResult& result) const;
  // Why the run, which has come to its end, has failed.
  [[nodiscard]] std::string failure(const Body& body, const State& state) const;

 private:
  static constexpr std::uint64_t kLook = 20;  // steps between two looks at the residual
  void look(const State& state, const std::function<void(SimulateResult&)>& tell);

  Vec3 middle_ = Vec3::Zero();        // m, of the body's elements at rest
  double extent_ = 0;                 // m, of the body
  double ramp_ = 0;                   // s
  double kinetic_ = 0, largest_ = 0;  // J: now, ever
  bool done_ = false;
  std::vector<Vec3> velocity_;  // m/s, that the step began with
  std::vector<Vec3> force_;     // N, (elements), of the last step; empty before the first
  SettleSummary summary_;
};

}  // namespace flexel::simulate
