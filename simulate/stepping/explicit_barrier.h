// The barrier of simulate/models/corner_barrier.h in explicit steps. The hot loop knows nothing of it: whenever the
// bound on the step is taken anew, the cells with a corner that may fold before the next time are listed, and
// their barriers are forces of their own. While there is none, there is nothing.
#pragma once
#include <unordered_map>

#include "simulate/models/corner_barrier.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

class ExplicitBarrier {
 public:
  // Refers to the problem's body while it lives; rest shapes are those that its cells have now.
  explicit ExplicitBarrier(const Problem& problem);

  // Lists the cells anew that have a corner within twice its threshold, or that will be within it in `ahead`
  // seconds at its present rate.
  void look(const State& state, double ahead);
  [[nodiscard]] bool watches() const { return !watched_.empty(); }
  // Adds the barriers' forces [N] (elements).
  void add_forces(const State& state, std::vector<Vec3>& forces);
  // A corner has lost a fifth since the last look, and so the bound on the step may have: it has to be taken
  // anew. Also before the first look.
  [[nodiscard]] bool needs_step_recheck() const;
  [[nodiscard]] double energy(const State& state) const;  // J, of the barriers
  // Takes broken cells off the list; gives the energy that went with them [J].
  double drop_broken(const State& state);

 private:
  struct Watched {
    std::uint32_t cell = 0, part = 0;
    double share = 0;  // of the stiffness of a whole cell
    CornerThresholds thresholds{};
    CellVectors forces{};  // N
    double least = 0;      // smallest J_c over its threshold
  };
  [[nodiscard]] CellVectors corners(std::uint32_t cell, const std::vector<Vec3>& values) const;
  [[nodiscard]] CornerThresholds thresholds(std::uint32_t cell) const;
  [[nodiscard]] bool may_fold(std::uint32_t cell, const CellKind& kind, const State& state,
                              double ahead) const;
  [[nodiscard]] double energy_of(const Watched& at, const State& state) const;

  const Problem& problem_;
  std::vector<CellKind> kinds_;                                 // (parts)
  std::unordered_map<std::uint32_t, CornerThresholds> shaped_;  // of cells with a rest shape of their own
  std::vector<Watched> watched_;                                // ascending by cell
  double least_seen_ = 1,
         least_ = 1;  // smallest J_c over its threshold: at the last look, at the last forces
  bool looked_ = false;
};

}  // namespace flexel::simulate
