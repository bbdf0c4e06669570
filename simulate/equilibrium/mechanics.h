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
  double scale = 0;     // 2-norm of what acts from outside: loads, ties, and matter on prescribed components
  double smallest = 1;  // J of a cell, where the kernels of timed runs tell it (Mechanics::set_inertia())
};

// Where matter is compressed most.
struct MostCompressed {
  double value = 1;          // J: volume now over that at rest, of a cell or around an element
  std::string name;          // "cell 12", "element 7"
  Vec3 rest = Vec3::Zero();  // m, of an element there
  std::uint32_t part = 0;
};

// What other processes do of the mechanics of the cells (distributed/team.h), for a body at equilibrium that they share.
class CellsElsewhere {
 public:
  virtual ~CellsElsewhere() = default;
  struct Figures {
    double energy = 0;  // J
    SmallestJacobian smallest, smallest_corner;
  };
  [[nodiscard]] virtual Figures figures(const State& state) = 0;
  // Adds the forces of the cells on their elements [N].
  virtual void add_forces(const State& state, std::vector<Vec3>& forces) = 0;
  // simulate/equilibrium/positive_tangent.h
  [[nodiscard]] virtual std::optional<bool> has_positive_tangent(const State& state) = 0;
  // The product with the tangent at rest, effects added and prescribed components eliminated, and its diagonal [N/m]; 0 at elements
  // of no cell that resists.
  virtual void multiply(const std::vector<Vec3>& x, std::vector<Vec3>& y) = 0;
  [[nodiscard]] virtual std::vector<Vec3> diagonal() = 0;
};

// Whether the tangent stiffness is stored: `automatic` where it is small or CellStiffness does not fit.
enum class StiffnessStorage { automatic, stored, made };

class Mechanics {
 public:
  // `problem`'s body must outlive it. `made`: CellStiffness must fit. What is made of the cells takes some 800 bytes a cell beside
  // the body.
  Mechanics(const Problem& problem, std::vector<ActiveEffect> effects,
            StiffnessStorage storage = StiffnessStorage::automatic);
  Mechanics(const Mechanics&) = delete;
  Mechanics& operator=(const Mechanics&) = delete;

  [[nodiscard]] const Body& body() const { return body_; }
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }
  [[nodiscard]] const Stencil& stencil() const { return lattice().pattern.stencil; }
  [[nodiscard]] const Cells& cells() const { return lattice().cells; }
  [[nodiscard]] const PaperModel& paper() const { return paper_; }
  // The tangent at the last assemble().
  [[nodiscard]] const LinearOperator& tangent() const { return lattice().tangent(); }
  // Some load follows the shape (Effect::follows()): the energy tells nothing of it.
  [[nodiscard]] bool follows() const { return followed_.has_value(); }
  // Some effect is (Effect::unilateral()).
  [[nodiscard]] bool unilateral() const;
  // Likewise with what such loads add, not symmetric; tangent() where none follows.
  [[nodiscard]] const LinearOperator& whole_tangent() const {
    return follows() ? static_cast<const LinearOperator&>(*followed_) : tangent();
  }
  // Likewise; `symmetric`: its symmetric part.
  [[nodiscard]] FollowedTangent followed(bool symmetric) const;
  // Likewise, where it is stored.
  [[nodiscard]] const BlockMatrix& stiffness() const {
    assert(!lattice().made);
    return lattice().pattern.matrix;
  }
  [[nodiscard]] const std::vector<ActiveEffect>& effects() const { return effects_; }

  // Total energy [J]; infinity where a cell or an element has J <= 0.
  [[nodiscard]] double energy(const State& state);
  [[nodiscard]] double elastic_energy(const State& state);
  // Adds the forces of the models alone [N] (elements).
  void add_elastic_forces(const State& state, std::vector<Vec3>& forces);
  [[nodiscard]] MostCompressed most_compressed(const State& state) const;
  [[nodiscard]] SmallestJacobian smallest_corner_jacobian(const State& state) const;
  [[nodiscard]] Forces forces(const State& state);
  // What effects alone do: their forces [N] (elements), and their stiffness [N/m], which must couple only elements of
  // one cell that they pull at.
  [[nodiscard]] std::vector<Vec3> forces_of_effects(const State& state) const;
  [[nodiscard]] BlockMatrix stiffness_of_effects(const State& state) const;
  // Tangent stiffness into tangent(), prescribed components not yet eliminated.
  void assemble(const State& state, const TangentOptions& tangent = {});
  void eliminate_prescribed();
  // Whether the energy is finite; `forces`: those of the state.
  [[nodiscard]] bool is_sound(const State& state, const Forces& forces);
  // kg/s^2 (elements): from here on tangents hold what inertia resists in an implicit step, and cells whose
  // stiffness is made are evaluated by the kernels of timed runs.
  void set_inertia(std::vector<double> inertia);
  // Effects add to other elements than they did, of the same cells or couples.
  void renew_effects_pattern();
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
  void grow_free_strain(bool grows) { lattice().cells.grow_free_strain(grows); }

  // From here on, or until null is given, others do what a CellsElsewhere does, and what is made of the cells here is freed; what else
  // needs it makes it again. All effects must be constant loads and supports.
  void move_cells(std::shared_ptr<CellsElsewhere> to) {
    elsewhere_ = std::move(to);
    lattice_.reset();
  }
  [[nodiscard]] CellsElsewhere* elsewhere() const { return elsewhere_.get(); }
  // (cells) 1: resists
  [[nodiscard]] std::vector<std::uint8_t> active() const { return active_cells(problem_); }

 private:
  // What is made of the cells.
  struct Lattice {
    Lattice(const Problem& problem, const PaperModel& paper, const std::vector<ActiveEffect>& effects,
            bool stored);
    Lattice(const Lattice&) = delete;
    Lattice& operator=(const Lattice&) = delete;
    [[nodiscard]] const LinearOperator& tangent() const {
      return made ? static_cast<const LinearOperator&>(*made) : stored;
    }
    // Where effects add their stiffness.
    [[nodiscard]] BlockMatrix& added() { return made ? made->added() : pattern.matrix; }

    StiffnessPattern pattern;
    Cells cells;
    std::optional<CellStiffness> made;  // nothing where the matrix of the pattern has values
    StoredMatrix stored;
  };
  static std::vector<CoupledElements> coupled(const std::vector<ActiveEffect>& effects);
  void follow_loads();
  double add_forces_of_models(const State& state, std::vector<Vec3>& forces);
  [[nodiscard]] double energy_of_cells(const State& state);
  [[nodiscard]] Lattice& lattice() const {
    if (!lattice_) lattice_ = std::make_unique<Lattice>(problem_, paper_, effects_, stored_);
    return *lattice_;
  }

  Problem problem_;
  const Body& body_;
  PaperModel paper_;
  bool stored_, by_kernels_ = false;
  std::vector<ActiveEffect> effects_;
  mutable std::unique_ptr<Lattice> lattice_;   // null until it is asked for
  std::shared_ptr<CellsElsewhere> elsewhere_;  // null: all is done here
  Constraints constraints_;
  std::optional<FollowedTangent> followed_;
  std::vector<double> inertia_;  // of set_inertia(), where the tangent is stored
  State linearised_;             // of the last assemble(), where loads follow
  double free_scale_ = 0;        // N, the norm of the forces that free strain makes at rest
  double cell_seconds_ = 0, paper_seconds_ = 0;
};

}  // namespace flexel::simulate
