// Gaps, pressures and phases of the candidate pairs in the state that was evaluated last.
#pragma once
#include <utility>

#include "simulate/contact/pairs/carrying_cells.h"
#include "simulate/contact/pairs/overlap_release.h"
#include "simulate/contact/pairs/pair_schedule.h"

namespace flexel::simulate {

// Of this machine.
[[nodiscard]] const contact_kernels::ContactTable& contact_kernel_table();

class PairStates {
 public:
  // All outlive this. The phases of pairs are kept in `memory`, where initial penetrations are entered too.
  PairStates(const ContactSettings& settings, const ContactSurface& surface, const PairList& list,
             PairMemory& memory, OverlapRelease& release);

  // To a new list: no pair is evaluated.
  void reset();
  // Evaluates the pairs of the list in `state`, unless that was done for it already: the hooks of one step
  // ask for the same state several times. Those that cannot touch are left out (PairSchedule), unless `all`.
  void update(const State& state, bool all = false);

  // Until thaw() evaluations are of trials within an implicit step: phases stay what they are, and a pair that
  // was pressed stays active beyond its limit, as `deep`.
  void freeze() { frozen_ = true; }
  void thaw() {
    frozen_ = false;
    evaluated_builds_ = 0;  // the trial that was last evaluated counts from now on
  }

  // After a step of `drift` s that led to `state`, which is evaluated: how softly pairs begin to press. What
  // this changes is evaluated again: the states are those that a run which goes on from here would find.
  void finish_step(const State& state, double drift);
  // J, that pairs have lost as they hardened.
  [[nodiscard]] double hardened() const { return hardened_; }
  void set_hardened(double energy) { hardened_ = energy; }
  [[nodiscard]] double take_hardened() { return std::exchange(hardened_, 0); }

  // Whether the displacements are those that were evaluated last, of the list as it is.
  [[nodiscard]] bool is_at(const State& state) const;
  [[nodiscard]] const CarryingCells& cells() const { return cells_; }
  [[nodiscard]] std::uint64_t evaluations() const { return evaluations_; }
  [[nodiscard]] const std::vector<PointState>& points() const { return points_; }  // (PairList::points())
  [[nodiscard]] const std::vector<PairState>& states() const { return states_; }   // (pairs)
  [[nodiscard]] const PairState& operator[](std::size_t pair) const { return states_[pair]; }
  // Evaluated pairs whose state is `near`, ascending: most candidates are not.
  [[nodiscard]] const std::vector<std::uint32_t>& active() const { return active_; }
  [[nodiscard]] const std::vector<contact_kernels::PairSides>& sides() const { return sides_; }  // (pairs)
  [[nodiscard]] bool is_active(std::size_t pair) const { return is_active_[pair] != 0; }
  [[nodiscard]] contact_kernels::PairView view(const std::uint32_t* pairs, std::size_t count) const;

 private:
  [[nodiscard]] std::span<const BodyMotion> motion_to(const State& state);
  [[nodiscard]] Box body_box(std::size_t body) const;
  void find_points(const State& state);
  // The numbers of pairs that are evaluated together, and what they are evaluated with.
  struct Batch {
    static constexpr std::size_t kMost = 256;
    std::array<std::uint32_t, kMost> pairs;
    std::array<double, kMost> allowed, soft;
    std::size_t count = 0;
  };
  void look_at(std::span<const std::uint32_t> pairs, Batch& batch);
  void add_to(Batch& batch, std::uint32_t pair) const;
  void evaluate_batch(const Batch& batch, std::vector<std::uint8_t>& entering);
  [[nodiscard]] ContactSide other_side(const ContactPair& pair) const;
  [[nodiscard]] ContactSide own_side(const ContactPair& pair) const;
  // `allowed` [m]: penetration without pressure; `soft` [m]: of PairRecord.
  [[nodiscard]] PairState evaluate(const ContactPair& pair, double allowed, double soft) const {
    return pair_state(own_side(pair), other_side(pair), pair.properties.constants, allowed, soft);
  }
  [[nodiscard]] Vec3 velocity(std::uint32_t point, const State& state) const;
  [[nodiscard]] double softness_after(std::size_t pair, const State& state, double drift) const;
  void find_initial_penetrations(const State& state);
  [[nodiscard]] std::vector<std::uint8_t> evaluate_pairs();
  void admit(const std::vector<std::uint8_t>& entering);
  void set(std::size_t pair, const PairState& now);
  void settle(std::size_t pair);
  void update_phase(const ContactPair& pair, PairState& now, PairPhase& phase) const;

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  const PairList& list_;
  PairMemory& memory_;
  OverlapRelease& release_;
  PairSchedule schedule_;
  CarryingCells cells_;
  std::vector<contact_kernels::PairSides> sides_;  // (pairs)
  std::vector<ContactSide> planes_;                // (settings_.planes)
  std::vector<std::uint32_t> wanted_points_;       // of the evaluation
  std::vector<PointState> points_;                 // of pairs that are awake
  std::vector<std::uint64_t> point_evaluation_;    // (points_) that they are of
  std::vector<PairState> states_;                  // of active pairs
  std::vector<std::uint32_t> active_;
  static constexpr std::uint8_t kWasPressed = 2;  // in the evaluation before, while pairs are evaluated
  std::vector<std::uint8_t> is_active_;           // (pairs)
  std::vector<Vec3> moved_from_;  // (PairList::elements()) m, displacements of the last evaluation
  std::vector<Vec3> moves_;       // likewise, from those before
  std::vector<WideBox> of_body_;  // (parts) of moves_
  std::vector<BodyMotion> motions_;
  std::vector<double> lost_;  // (active_) J, of finish_step()
  std::uint64_t evaluated_builds_ = 0, evaluations_ = 0;
  bool evaluated_all_ = false, frozen_ = false;
  double hardened_ = 0;  // J
};

}  // namespace flexel::simulate
