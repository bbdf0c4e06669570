// Gaps, pressures and phases of the candidate pairs in the state that was evaluated last.
#pragma once
#include <utility>

#include "simulate/contact/pairs/carrying_cells.h"
#include "simulate/contact/pairs/overlap_release.h"
#include "simulate/contact/pairs/pair_schedule.h"

namespace flexel::simulate {

// Of an active pair: N, on j; from i to j [m], of which `share` is where they meet. A row of
// simulate/kernels/kernel_contact.h.
struct alignas(64) PairRubbing {
  Vec3 force = Vec3::Zero(), way = Vec3::Zero();
  double share = 0;
};

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

  // Likewise after a step of `drift` s that led to `state`, which changes how softly pairs begin to press (the
  // states are those that a run which goes on from here would find) and, if they rub, slips; with a damping of
  // `damping` s.
  void go_through(const State& state, double drift, bool rubs, double damping);
  // rubbing() in `state`, which is evaluated, by its velocities.
  void rub(const State& state, double damping);
  // Friction and damping of active pairs that do not stick, since the last of these two.
  [[nodiscard]] const std::vector<PairRubbing>& rubbing() const { return rubbing_; }  // (pairs)
  [[nodiscard]] PairRubbing& rubbing(std::size_t pair) { return rubbing_[pair]; }
  // Active pairs that press or stick, ascending, and their points.
  [[nodiscard]] const std::vector<std::uint32_t>& acting() const { return acting_; }
  [[nodiscard]] const std::vector<std::uint32_t>& acting_points() const { return acting_points_; }
  void choose_acting();  // anew, when others stick
  // Whether pairs may act that do not press, or whose depths are released.
  [[nodiscard]] bool others_act() const { return others_act_; }
  // Whether any may be more than contact_kernels::kStiffening times as stiff as in the linear range.
  [[nodiscard]] bool stiffens() const { return stiffens_; }

  // J, that pairs have lost as they hardened.
  [[nodiscard]] double hardened() const { return hardened_; }
  void set_hardened(double energy) { hardened_ = energy; }
  [[nodiscard]] double take_hardened() { return std::exchange(hardened_, 0); }

  // Whether the displacements are those that were evaluated last, of the list as it is.
  [[nodiscard]] bool is_at(const State& state) const;
  [[nodiscard]] const CarryingCells& cells() const { return cells_; }
  [[nodiscard]] std::uint64_t evaluations() const { return evaluations_; }
  [[nodiscard]] const std::vector<PointState>& points() const {
    return cells_.states();
  }                                                                               // (PairList::points())
  [[nodiscard]] const std::vector<PairState>& states() const { return states_; }  // (pairs)
  [[nodiscard]] const PairState& operator[](std::size_t pair) const { return states_[pair]; }
  // Evaluated pairs whose state is `near`, ascending: most candidates are not.
  [[nodiscard]] const std::vector<std::uint32_t>& active() const { return active_; }
  [[nodiscard]] const std::vector<contact_kernels::PairSides>& sides() const { return sides_; }  // (pairs)
  [[nodiscard]] bool is_active(std::size_t pair) const { return is_active_[pair] != 0; }
  [[nodiscard]] contact_kernels::PairView view(const std::uint32_t* pairs, std::size_t count) const;

 private:
  [[nodiscard]] std::span<const BodyMotion> motion_to(const State& state);
  [[nodiscard]] Box body_box(std::size_t body) const;
  // The numbers of pairs that are evaluated together, and what they are evaluated with.
  struct Batch {
    static constexpr std::size_t kMost = 256;
    std::array<std::uint32_t, kMost> pairs, places;  // places: in awake pairs
    std::array<double, kMost> allowed;
    std::size_t count = 0;
  };
  [[nodiscard]] contact_kernels::PairStep step(double drift, bool moving, bool rubs, double damping);
  void evaluate(const State& state, bool all, const contact_kernels::PairStep& step);
  void evaluate_again(const State& state, const contact_kernels::PairStep& step);
  void place_points(const State& state, bool moving);
  [[nodiscard]] bool evaluate_steady(const contact_kernels::PairStep& step);
  void look_at(std::span<const std::uint32_t> pairs, std::span<const std::uint32_t> places, Batch& batch);
  void add_to(Batch& batch, std::uint32_t pair, std::uint32_t place) const;
  void evaluate_batch(const Batch& batch, const contact_kernels::PairStep& step,
                      std::vector<std::uint8_t>* entering);
  void choose_active(bool changed);
  void take_marks();
  [[nodiscard]] ContactSide other_side(const ContactPair& pair) const;
  [[nodiscard]] ContactSide own_side(const ContactPair& pair) const;
  // `allowed` [m]: penetration without pressure; `soft` [m]: of PairRecord.
  [[nodiscard]] PairState evaluate(const ContactPair& pair, double allowed, double soft) const {
    return pair_state(own_side(pair), other_side(pair), pair.properties.constants, allowed, soft);
  }
  void find_initial_penetrations(const State& state);
  [[nodiscard]] std::vector<std::uint8_t> evaluate_others(const contact_kernels::PairStep& step);
  void admit(const std::vector<std::uint8_t>& entering, const contact_kernels::PairStep& step);
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
  std::vector<PairState> states_;                  // of active pairs
  std::vector<PairRubbing> rubbing_;               // likewise
  std::vector<std::uint32_t> active_, acting_;
  std::vector<std::uint32_t> acting_points_;
  // Pairs that press stay so from step to step, mostly: without others, acting_ is evaluated by itself.
  bool others_act_ = false;                                // what may stick, or is released
  static constexpr std::uint8_t kActive = 1, kSteady = 2;  // kSteady: of those
  std::vector<std::uint8_t> is_active_;                    // (pairs)
  // What an evaluation says of the steady pairs and, behind them, of those that are awake.
  std::vector<std::uint8_t> marks_;  // contact_kernels::kPresses and so on
  std::vector<double> lost_;         // J, where kHardens
  std::vector<Vec3> moved_from_;     // (PairList::elements()) m, displacements of the last evaluation
  std::vector<Vec3> moves_;          // likewise, from those before
  std::vector<WideBox> of_body_;     // (parts) of moves_
  std::vector<BodyMotion> motions_;
  std::uint64_t evaluated_builds_ = 0, evaluations_ = 0;
  bool evaluated_all_ = false, frozen_ = false, stiffens_ = true;
  double hardened_ = 0;  // J
};

}  // namespace flexel::simulate
