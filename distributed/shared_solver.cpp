// What acts on a rank's own cells is its own: forces are summed up at the elements that several have.
#include "distributed/shared_solver.h"

#include <exception>
#include <optional>

#include "base/error.h"
#include "base/stop.h"
#include "distributed/newton_snes.h"
#include "distributed/refusals.h"

namespace flexel::distributed {
namespace {

using simulate::Mechanics;
using simulate::NewtonOptions;
using simulate::NewtonOutcome;
using simulate::NewtonProgress;
using simulate::State;

// The cells of this rank, as distributed/piece.h has them.
Piece own_piece(Mechanics& mechanics, SharedBody& shared) {
  const Body& body = mechanics.body();
  Partition parts{std::vector<std::int32_t>(body.cell_count(), -1), shared.numbers(),
                  std::vector<PetscInt>(static_cast<std::size_t>(ranks()), 0)};
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (shared.owns_cell(c)) parts.rank[c] = rank();
  parts.owned[static_cast<std::size_t>(rank())] = shared.owned();
  const State rest{std::vector<Vec3>(body.element_count(), Vec3::Zero()), 1};
  Piece piece =
      cut_piece(body, parts, rank(), mechanics.constraints().mask, mechanics.stiffness_of_effects(rest));
  for (std::uint32_t c = 0; c < piece.cell.size(); ++c) piece.cell[c] = shared.first_cell() + c;
  return piece;
}

class SharedSolver : public simulate::CellsElsewhere {
 public:
  SharedSolver(Mechanics& mechanics, SharedBody& body, const simulate::Scene& scene)
      : mechanics_(mechanics),
        body_(body),
        solved_(std::make_unique<Solved>(own_piece(mechanics, body), scene)) {}
  // Freeing what all ranks share would wait for those that know of no error.
  ~SharedSolver() override {
    if (std::uncaught_exceptions() > 0) (void)solved_.release();
  }
  SharedSolver(const SharedSolver&) = delete;
  SharedSolver& operator=(const SharedSolver&) = delete;

  NewtonOutcome operator()(State& state, const NewtonOptions& options, const NewtonProgress& progress) {
    body_.give(state.displacement, solved_->displacement);
    {
      std::vector<Vec3> prescribed = state.displacement;
      apply(mechanics_.constraints(), mechanics_.body(), state, prescribed);
      body_.give(prescribed, solved_->prescribed);
    }
    const State rest{std::vector<Vec3>(state.displacement.size(), Vec3::Zero()), state.share};
    body_.give_sum(mechanics_.forces_of_effects(rest), solved_->outer);
    const NewtonOutcome outcome =
        solved_->newton.solve(solved_->displacement, solved_->outer, solved_->prescribed, options,
                              rank() == 0 ? &progress : nullptr);
    state.displacement = body_.take(solved_->displacement);
    stop_together();
    return outcome;
  }

  [[nodiscard]] Figures figures(const State& state) override {
    body_.give(state.displacement, solved_->displacement);
    return solved_->system.figures(solved_->displacement);
  }
  void add_forces(const State& state, std::vector<Vec3>& forces) override {
    body_.give(state.displacement, solved_->displacement);
    ok(VecZeroEntries(solved_->outer));
    solved_->system.forces(solved_->displacement, solved_->outer, solved_->answer, solved_->prescribed);
    add(solved_->answer, forces);
  }
  [[nodiscard]] std::optional<bool> has_positive_tangent(const State& state) override {
    body_.give(state.displacement, solved_->displacement);
    return solved_->newton.has_positive_tangent(solved_->displacement);
  }
  [[nodiscard]] std::vector<Vec3> diagonal() override {
    assemble_at_rest();
    solved_->system.diagonal(solved_->answer);
    return body_.take(solved_->answer);
  }
  void multiply(const std::vector<Vec3>& x, std::vector<Vec3>& y) override {
    assemble_at_rest();
    body_.give(x, solved_->displacement);
    solved_->system.multiply(solved_->displacement, solved_->answer);
    y = body_.take(solved_->answer);
  }

 private:
  struct Solved {
    Solved(Piece piece, const simulate::Scene& scene) : system(std::move(piece), scene), newton(system) {
      for (Vector* each : {&displacement, &outer, &prescribed, &answer}) *each = system.vector();
    }
    PieceSystem system;
    NewtonSnes newton;
    Vector displacement, outer, prescribed, answer;
  };
  // Throws on all ranks or on none: what follows a time limit, they write together.
  void stop_together() {
    int stop = rank() != 0 ? 0 : interrupted() ? 2 : stop_is_due() ? 1 : 0;
    ok(MPI_Bcast(&stop, 1, MPI_INT, 0, PETSC_COMM_WORLD));
    if (stop == 0) return;
    stop_waits_.reset();
    check_stop();  // rank 0
    if (stop == 2) throw Interrupted();
    throw TimeoutError("stopped with rank 0");
  }
  void assemble_at_rest() {
    ok(VecZeroEntries(solved_->prescribed));
    solved_->system.assemble(solved_->prescribed, {}, nullptr, nullptr);
  }
  void add(Vec values, std::vector<Vec3>& to) {
    const std::vector<Vec3> all = body_.take(values);
    for (std::size_t e = 0; e < all.size(); ++e) to[e] += all[e];
  }

  Mechanics& mechanics_;
  SharedBody& body_;
  std::unique_ptr<Solved> solved_;
  std::optional<StopWaits> stop_waits_{std::in_place};  // rank 0 stops in stop_together() alone
};

}  // namespace

simulate::LoadStepSolver make_shared_solver(Mechanics& mechanics, SharedBody& body,
                                            const simulate::Scene& scene) {
  refuse_unsupported(scene, mechanics.effects());
  const auto solver = std::make_shared<SharedSolver>(mechanics, body, scene);
  mechanics.move_cells(solver);
  return [solver](State& state, const NewtonOptions& options, const NewtonProgress& progress) {
    return (*solver)(state, options, progress);
  };
}

}  // namespace flexel::distributed
