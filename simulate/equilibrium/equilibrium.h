// Equilibrium: Newton's method under load steps that cut themselves.
#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "base/program/progress.h"
#include "simulate/equilibrium/mechanics.h"
#include "simulate/equilibrium/newton.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Shares of a run's time: before the equilibrium is looked for; until the first linear solution begins.
inline constexpr double kBeforeSearch = 0.065, kBeforeFirstStep = 0.25;

struct EquilibriumResult {
  int load_steps = 0, newton_iterations = 0, cg_iterations = 0;
  double relative_residual = 0;
  double linear_seconds = 0;
  bool buckled = false;  // left a branch that was not stable any more
  // m: the largest displacement in proportion to the whole load, as if free strain made no stresses; 0 where only free
  // strain moves the body, or it was not found
  double linear_reach = 0;
  // Of Mechanics::tangent(), as the last load step left it; null where that had another solver.
  std::shared_ptr<Preconditioner> preconditioner;
};

// What loads that follow the shape remember of the way to where they are: Effect::memory() of each, in their
// order. It is the same on every lattice.
using FollowerMemory = std::vector<std::vector<double>>;
[[nodiscard]] FollowerMemory follower_memory(const Mechanics& mechanics);

// A place near an equilibrium, and the way there.
struct NearStart {
  std::vector<Vec3> displacement;  // m (elements)
  FollowerMemory followers;
};

// The rigid motions that the ties leave free at `start`: throws InputError(scene, ...) naming part and
// motion.
void refuse_free_motions(Mechanics& mechanics, const State& start, const std::string& scene);

// Elements of centre-placed parts whose connections lie in one plane or line, and that no tie holds across
// it, resist nothing in that direction: throws InputError(scene, ...) naming part, number and place.
void refuse_unsupported_elements(Mechanics& mechanics, const State& start, const std::string& scene);

// Moves `state` to equilibrium under the whole load. Throws DivergedError naming load step, iteration, the
// worst cell and a suggestion; Interrupted and TimeoutError (base/stop.h). `state` is then the last one in
// equilibrium.
//
// `start` is asked for a place near the equilibrium under the whole load, once, where the linear answer
// reaches so far that the way there is long; it may be empty, or give nothing. Its Progress is a stretch of
// this run's.
using CoarseStart = std::function<std::optional<NearStart>(Progress&)>;

// What solves one load step in place of newton(), with the same arguments but for the Mechanics that it was made for.
using LoadStepSolver = std::function<NewtonOutcome(State&, const NewtonOptions&, const NewtonProgress&)>;

// An equilibrium on the way to the whole load.
struct LoadStepDone {
  double share = 0;                // of the load
  double reach = 0;                // m, of the first linear answer, for the whole load
  double residual = 0;             // relative, as NewtonOutcome has it
  bool buckled = false;            // as EquilibriumResult has it
  std::vector<Vec3> displacement;  // m (elements)
};

// `make_solver` is asked once for each search for an equilibrium, those on coarser lattices too; it may take the cells of the
// mechanics elsewhere (Mechanics::move_cells()). `done` hears of each
// load step that ended in equilibrium, but of none on a coarser lattice. `begin`: the load steps go on from there.
struct LoadStepHooks {
  std::function<LoadStepSolver(Mechanics&)> make_solver;
  std::function<void(const LoadStepDone&)> done;
  std::optional<LoadStepDone> begin;
  // Of a body in pieces (formats/pieces/other_pieces.h): writes the last state in equilibrium, as a list of pieces.
  std::function<void(Body&, const std::string& path)> save = {};
};
// For a search on a coarser lattice; null where `hooks` is.
[[nodiscard]] std::shared_ptr<const LoadStepHooks> hooks_on_coarser(
    const std::shared_ptr<const LoadStepHooks>& hooks);

[[nodiscard]] EquilibriumResult find_equilibrium(Mechanics& mechanics, State& state,
                                                 const RunSettings& settings, Progress& progress,
                                                 const CoarseStart& start = {},
                                                 const LoadStepHooks* hooks = nullptr,
                                                 const LoadStepSolver& solver = {});

}  // namespace flexel::simulate
