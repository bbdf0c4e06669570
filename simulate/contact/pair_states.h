// Gaps, pressures and phases of the candidate pairs in the state that was evaluated last.
#pragma once
#include "simulate/contact/overlap_release.h"

namespace flexel::simulate {

class PairStates {
 public:
  // All outlive this. The phases of pairs are kept in `memory`, where initial penetrations are entered too.
  PairStates(const ContactSettings& settings, const ContactSurface& surface, const PairList& list,
             PairMemory& memory, OverlapRelease& release);

  // To a new list: no pair is evaluated.
  void reset();
  // Evaluates the pairs of the list in `state`, unless that was done for it already: the hooks of one step
  // ask for the same state several times.
  void update(const State& state);

  // After a step of `drift` s that led to `state`, which is evaluated: how softly pairs begin to press.
  void finish_step(const State& state, double drift);

  [[nodiscard]] std::uint64_t evaluations() const { return evaluations_; }
  [[nodiscard]] const std::vector<PointState>& points() const { return points_; }  // (PairList::points())
  [[nodiscard]] const std::vector<PairState>& states() const { return states_; }   // (pairs)
  [[nodiscard]] const PairState& operator[](std::size_t pair) const { return states_[pair]; }
  // Pairs whose state is `near`, ascending: most candidates are not.
  [[nodiscard]] const std::vector<std::uint32_t>& active() const { return active_; }
  [[nodiscard]] bool is_active(std::size_t pair) const { return is_active_[pair] != 0; }

 private:
  [[nodiscard]] bool evaluated(const State& state);
  [[nodiscard]] bool out_of_reach(const ContactPair& pair) const;
  [[nodiscard]] ContactSide other_side(const ContactPair& pair) const;
  // `allowed` [m]: penetration without pressure; `soft` [m]: of PairRecord.
  [[nodiscard]] PairState evaluate(const ContactPair& pair, double allowed, double soft) const;
  [[nodiscard]] double approach(const ContactPair& pair, const Vec3& normal, const State& state) const;
  void find_initial_penetrations(const State& state);
  [[nodiscard]] std::vector<std::uint8_t> evaluate_pairs();
  void admit(const std::vector<std::uint8_t>& entering);
  void set(std::size_t pair, PairState now);
  void update_phase(const ContactPair& pair, PairState& now, PairPhase& phase) const;

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  const PairList& list_;
  PairMemory& memory_;
  OverlapRelease& release_;
  std::vector<PointState> points_;
  std::vector<PairState> states_;  // default where the pair is not active
  std::vector<std::uint32_t> active_;
  std::vector<std::uint8_t> is_active_;  // (pairs)
  std::vector<Vec3> evaluated_at_;       // (PairList::elements()) m, displacements
  std::uint64_t evaluated_builds_ = 0, evaluations_ = 0;
};

}  // namespace flexel::simulate
