// The longest stable step of a whole run: cells, connections and the stiffness that effects add
// (simulate/models/stability.h), in the state that was last looked at.
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/effects/effect.h"
#include "simulate/models/paper_model.h"
#include "simulate/models/stability.h"

namespace flexel::simulate {

class StepBound {
 public:
  // Keeps references to all.
  StepBound(const Problem& problem, const std::vector<ActiveEffect>& effects, const KernelEffects& plan);

  // Whether explicit damping of the cells leaves at least half of the undamped step.
  [[nodiscard]] bool damps_explicitly() const;

  // Looks at how stiff everything is now. `paper`: the centre-placed parts, or none.
  void look(const State& state, const PaperModel* paper, const std::vector<double>& mass);

  // s; `staged_damping`: that of the cells is taken in stages (StagedDamping). 0 or less: a cell is folded.
  [[nodiscard]] double longest(bool staged_damping) const;
  // 1/s, bounds the rates at which the damping of the cells alone takes velocities, in the state of the last look and
  // until cells are a tenth longer than there.
  [[nodiscard]] double damping_rate() const;
  // Whether `rate` bounds them in `state` no more. Looks at the cells only where they may have changed: every so many
  // steps that nothing has moved by a twentieth of a spacing since, at its speed.
  [[nodiscard]] bool outgrows(double rate, const State& state, double step, std::uint64_t steps);
  // How far the fastest element goes in `step` [s], in the smallest spacing of the body.
  [[nodiscard]] double travel(const State& state, double step) const;

 private:
  [[nodiscard]] double bare_damping_rate() const;

  const Problem& problem_;
  const std::vector<ActiveEffect>& effects_;
  const KernelEffects& plan_;
  std::vector<CellOfPart> cells_;                 // (parts)
  std::vector<double> stiffening_, connections_;  // (parts) growth of the cells' frequency^2; 1/s^2
  std::vector<double> growth_;                    // (parts) of the damping
  std::vector<double> damping_;                   // (parts) s, the longest time of a cell
  double added_ = 0;                              // 1/s^2
};

}  // namespace flexel::simulate
