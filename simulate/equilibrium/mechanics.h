// Everything that acts on a body in a run: the models of its parts and its effects, summed up.
#pragma once
#include <cassert>
#include <optional>

#include "simulate/effects/effect.h"
#include "simulate/equilibrium/cell_stiffness.h"
#include "simulate/followers/followed_tangent.h"
#include "simulate/models/cells.h"
#include "simulate/models/paper_model.h"

namespace flexel::simulate {

// Forces on the elements [N].
struct Forces {
  std::vector<Vec3> total;  // (elements) of the models and of every effect
  double scale = 0;  // 2-norm of what acts from outside: loads, ties, and matter on prescribed components
};

// Where matter is compressed most.
struct MostCompressed {
  double value = 1;          // J: volume now over that at rest, of a cell or around an element
  std::string name;          // "cell 12", "element 7"
  Vec3 rest = Vec3::Zero();  // m, of an element there
  std::uint32_t part = 0;
};

// Whether the tangent stiffness is stored: `automatic` where it is small or CellStiffness does not fit.
enum class StiffnessStorage { automatic, stored, made };

class Mechanics {
 public:
  // `problem`'s body must outlive it. `made`: CellStiffness must fit.
  Mechanics(const Problem& problem, std::vector<ActiveEffect> effects,
            StiffnessStorage storage = StiffnessStorage::automatic);
  Mechanics(const Mechanics&) = delete;
  Mechanics& operator=(const Mechanics&) = delete;

  [[nodiscard]] const Body& body() const { return body_; }
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }
  [[nodiscard]] const Stencil& stencil() const { return pattern_.stencil; }
  [[nodiscard]] const Cells& cells() const { return cells_; }
  [[nodiscard]] const PaperModel& paper() const { return paper_; }
  // The tangent at the last assemble().
  [[nodiscard]] const LinearOperator& tangent() const { return *tangent_; }
  // Some load follows the shape (Effect::follows()): the energy tells nothing of it.
  [[nodiscard]] bool follows() const { return followed_.has_value(); }
  // Some effect is (Effect::unilateral()).
  [[nodiscard]] bool unilateral() const;
  // Likewise with what such loads add, not symmetric; tangent() where none follows.
  [[nodiscard]] const LinearOperator& whole_tangent() const {
    return follows() ? static_cast<const LinearOperator&>(*followed_) : *tangent_;
  }
  // Likewise; `symmetric`: its symmetric part.
  [[nodiscard]] FollowedTangent followed(bool symmetric) const;
  // Likewise, where it is stored.
  [[nodiscard]] const BlockMatrix& stiffness() const {
    assert(stored_);
    return pattern_.matrix;
  }
  [[nodiscard]] const std::vector<ActiveEffect>& effects() const { return effects_; }

  // Total energy [J]; infinity where a cell or an element has J <= 0.
  [[nodiscard]] double energy(const State& state);
  [[nodiscard]] double elastic_energy(const State& state) {
    return cells_.energy(state) + paper_.energy(state);
  }
  // Adds the forces of the models alone [N] (elements).
  void add_elastic_forces(const State& state, std::vector<Vec3>& forces);
  [[nodiscard]] MostCompressed most_compressed(const State& state) const;
  [[nodiscard]] Forces forces(const State& state);
  // What effects alone do: their forces [N] (elements), and their stiffness [N/m], which must couple only elements of
  // one cell.
  [[nodiscard]] std::vector<Vec3> forces_of_effects(const State& state) const;
  [[nodiscard]] BlockMatrix stiffness_of_effects(const State& state) const;
  // Tangent stiffness into tangent(), prescribed components not yet eliminated.
  void assemble(const State& state, const TangentOptions& tangent = {});
  void eliminate_prescribed();
  // Of the tangent only what effects add is made anew, at `state`; what was eliminated stays so. False, and nothing has
  // changed, where that is stored together with the rest, or a load follows the shape.
  [[nodiscard]] bool renew_effects(const State& state);
  // Groups of elements that effects couple (bonds).
  [[nodiscard]] std::vector<CoupledElements> coupled_elements() const { return coupled(effects_); }
  // (elements) 1 where a tie holds or leads an element along some directions, 2 along all, else 0.
  [[nodiscard]] std::vector<std::uint8_t> tied_elements();

  void report(const State& state, SimulateResult& result);

  [[nodiscard]] bool has_free_strain() const { return free_scale_ > 0; }
  // From here on it acts in proportion to State::share, or whole.
  void grow_free_strain(bool grows) { cells_.grow_free_strain(grows); }

 private:
  static std::vector<CoupledElements> coupled(const std::vector<ActiveEffect>& effects);
  void make_tangent(const Problem& problem);
  void follow_loads();
  // Where effects add their stiffness.
  [[nodiscard]] BlockMatrix& added_stiffness() { return made_ ? made_->added() : pattern_.matrix; }

  const Body& body_;
  PaperModel paper_;
  bool stored_;
  StiffnessPattern pattern_;
  Cells cells_;
  std::vector<ActiveEffect> effects_;
  std::optional<CellStiffness> made_;  // nothing where the matrix of the pattern has values
  std::unique_ptr<LinearOperator> stored_tangent_;
  const LinearOperator* tangent_ = nullptr;
  Constraints constraints_;
  std::optional<FollowedTangent> followed_;
  State linearised_;       // of the last assemble(), where loads follow
  double free_scale_ = 0;  // N, the norm of the forces that free strain makes at rest
  double cell_seconds_ = 0, paper_seconds_ = 0;
};

}  // namespace flexel::simulate
