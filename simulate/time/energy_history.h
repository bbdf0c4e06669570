// The books of a timed run, a row per sample: energies, momenta, probes (docs/reference/motion.md gives every column).
//
// At the time of step n, with the velocities of the half steps before and after it, the kinetic energy is 1/2
// sum m v(n-1/2) . v(n+1/2). It changes from step to step by exactly the mean of the forces at both ends
// times the displacement between, and so the work of every force is summed up; elastic and potential energy
// follow to second order in the step, exactly where they are quadratic. Momentum and angular momentum use the
// mean velocity.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simulate/effects/effect.h"
#include "simulate/models/cells.h"
#include "simulate/models/paper_model.h"
#include "simulate/probes/probes.h"
#include "simulate/stepping/stepper.h"

namespace flexel::simulate {

// J, at one time
struct Energies {
  double kinetic = 0, elastic = 0, potential = 0, work = 0, dissipated = 0;
  // What is missing: kinetic + elastic + potential + dissipated - work, less its value at the start.
  double residual = 0;
};

// A column of energy that one kind of force, or what happens in cells, gave the body (work), took from it, or
// took to give it back.
struct Account {
  std::string name;  // "loads"
  enum class Kind : std::uint8_t { work, dissipation, storage } kind = Kind::work;
  double energy = 0;  // J, given to the body so far
};

struct BookRow {
  double time = 0;  // s
  Energies energies;
  std::vector<double> accounts;  // J, work, dissipated or stored energy; of those that were there
  Vec3 momentum = Vec3::Zero(), angular = Vec3::Zero();
  std::vector<double> probes;  // m, (probes x 3)
  std::vector<double> values;  // (columns)
};

// What the books have summed up: all that goes on when the run does.
struct EnergyBalance {
  std::vector<Account> accounts;
  std::vector<BookRow> rows;
  std::vector<std::string> probes;   // names
  std::vector<std::string> columns;  // of effects, with their units
  std::optional<double> start;       // J: the sum of the first row
  bool changed = false;       // an event came since the last row: what it gave is entered as work of "events"
  double worst_residual = 0;  // J, largest absolute one
  double largest_term = 0;    // J, of any energy
  double unstored = 0;        // J, what stores gave back short of what they took, until they were last empty
  double unstored_now = 0;    // J, with what is stored at the last row
  double worst_unstored = 0;  // J, largest absolute one of these

  [[nodiscard]] std::string csv() const;
  // What the summary tells: the energies of the last row, and the worst [J].
  [[nodiscard]] std::vector<std::pair<std::string, double>> sums() const;
  // Place of the account of that name; a new one is made at the end.
  std::size_t account(const std::string& name, Account::Kind kind);
};

class EnergyHistory {
 public:
  // Refers to all but the balance, which it goes on with, while it lives. `paper`: of the centre-placed parts;
  // null: there are none.
  EnergyHistory(const Problem& problem, const std::vector<ActiveEffect>& effects,
                const std::vector<ProbePoints>& probes, const std::vector<double>& mass,
                const PaperModel* paper, const KernelEffects& plan, EnergyBalance balance = {});

  // Before a step: keeps the velocities and, where `sample`, the energies of the state. `folding`: of the
  // barriers of cells [J], which those that the step itself tells the energy of do not know.
  void before(const State& state, bool sample, double folding = 0);
  // The forces of effect p [N] (elements) at the state before the step.
  [[nodiscard]] std::vector<Vec3>& forces_of(std::size_t effect) { return forces_[effect]; }
  // Likewise of the damping of connections.
  [[nodiscard]] std::vector<Vec3>& connection_damping() { return connection_damping_; }
  // After it: what the stepper says of its energies, the forces of damping and supports [N] (elements; or
  // none), the length [s] of the step before it (0 for the first), and its own. `half_kick`: the velocities
  // before it were those of the state's own time, as Verlet's first ones are.
  void after(const State& state, const StepOutcome& outcome, const std::vector<Vec3>& damping,
             const std::vector<Vec3>& supports, double previous_step, double step, bool half_kick);

  // In place of before() and after() where the velocities are those of the state's own time, as in implicit
  // steps: a row of `state` with the forces of supports [N] (elements; or none) there, and the forces there
  // times how far they moved [m] (elements), with what the method itself dissipated [J].
  void add_row_of(const State& state, const std::vector<Vec3>& supports);
  void enter(const std::vector<Vec3>& moved, const std::vector<Vec3>& damping,
             const std::vector<Vec3>& supports, double numerical);

  // The next step is thrown away: what it says of the state before it counts, nothing else.
  void close() { closing_ = true; }

  // Throws DivergedError where more than half of the largest energy has come from nowhere or gone there.
  void refuse_broken_books(const State& state) const;

  [[nodiscard]] const EnergyBalance& balance() const { return balance_; }
  [[nodiscard]] EnergyBalance take_balance() { return std::move(balance_); }

 private:
  struct Momenta {
    double kinetic = 0;
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    Momenta& operator+=(const Momenta& other) {
      kinetic += other.kinetic;
      linear += other.linear;
      angular += other.angular;
      return *this;
    }
  };
  void book_stored_by_event();
  void add_row(const State& state, const std::vector<Vec3>& supports, bool half_kick);
  [[nodiscard]] Momenta momenta(const State& state, bool half_kick) const;

  const Problem& problem_;
  const std::vector<ActiveEffect>& effects_;
  const std::vector<ProbePoints>& probes_;
  const std::vector<double>& mass_;
  const PaperModel* paper_;
  Stencil no_stencil_;
  Cells cells_;
  std::vector<std::vector<Vec3>> forces_;  // (effects x elements)
  bool remembers_;
  std::vector<Vec3> connection_damping_;  // (elements) or empty
  std::vector<Vec3> velocity_;            // before the step
  EnergyBalance balance_;
  std::vector<std::size_t> own_;  // (effects) places in the balance
  std::vector<double> stored_;    // (effects) J, in those that store, at the sample
  double least_ = 0;              // J, less is not judged
  std::size_t supports_ = 0, damping_ = 0;
  std::optional<std::size_t> plasticity_, fracture_;
  bool sample_ = false, closing_ = false;
  double time_ = 0, elastic_ = 0, potential_ = 0;
  State sampled_;
};

}  // namespace flexel::simulate
