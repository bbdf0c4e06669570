// The run: materials, loose crumbs, effects, the check for free motions, equilibrium, what is reported.
#include "simulate/simulate.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/result/options.h"
#include "simulate/result/overload.h"
#include "simulate/result/result.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/human.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/fused_points.h"
#include "formats/lattice/quadratic_field.h"
#include "simulate/conduction/conduction.h"
#include "simulate/contact/pairs/stuck_places.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/equilibrium/equilibrium_problem.h"
#include "simulate/equilibrium/positive_tangent.h"
#include "simulate/estimate/coarsen.h"
#include "simulate/estimate/error_bars.h"
#include "simulate/estimate/stress_singularity.h"
#include "simulate/events/fused.h"
#include "simulate/joints/joints.h"
#include "simulate/matter/fragments.h"
#include "simulate/matter/stress.h"
#include "simulate/memory.h"
#include "simulate/models/rest_shape.h"
#include "simulate/models/set_rest_shape.h"
#include "simulate/modes/modes_run.h"
#include "simulate/probes/probes.h"
#include "simulate/probes/report.h"
#include "simulate/quadratic/quadratic_run.h"
#include "simulate/scene/coming_parts.h"
#include "simulate/scene/scene.h"
#include "simulate/scene/scene_checks.h"
#include "simulate/thermal/free_strain.h"
#include "simulate/thermal/temperature_column.h"
#include "simulate/thermal/thermal.h"
#include "simulate/time/before_equilibrium.h"
#include "simulate/time/dynamic_relaxation.h"
#include "simulate/time/timed_run.h"

namespace flexel::simulate {
namespace {

// Of a start from a coarser lattice
constexpr std::size_t kLeastCellsToCoarsen = 4000;
constexpr double kMostThinWalls = 0.2;  // share of the matter, in walls thinner than a coarse cell
constexpr double kStartTolerance = 1e-5;

void refuse_empty(const Body& body) {
  if (body.parts.empty() || body.element_count() == 0) throw InputError("the body holds no matter");
}

void move_body(Body& body, const State& state) {
  for (std::size_t e = 0; e < body.element_count(); ++e)
    body.position[e] = body.rest[e] + state.displacement[e];
}

// From the lattice's shape; where the rest shape is another, that may be far from any equilibrium, and the
// present one is near.
std::vector<Vec3> where_to_begin(const Body& body) {
  std::vector<Vec3> displacement(body.element_count(), Vec3::Zero());
  if (RestShapes(body).any())
    for (std::size_t e = 0; e < displacement.size(); ++e) displacement[e] = body.position[e] - body.rest[e];
  return displacement;
}

void report_unsupported(std::size_t elements, SimulateResult& result, Progress& progress) {
  if (elements == 0) return;
  result.stray_cells += elements;
  progress.warn(fmt::format(
      "{} element(s) at tips or edges have connections in one plane only, which resist nothing across it; "
      "they are carried along with the matter nearest to them",
      human_count(elements)));
}

// A load P that softens a part as it bends it gives u = u_linear / (1 - P / P_critical) (Southwell 1932), so
// the share of u that a linear answer misses is P over the load at which it buckles. A lattice that is too
// stiff by an error bar's share takes that load for larger by as much.
std::string near_buckling(double linear, const SimulateResult& result) {
  constexpr double kNear = 0.8;
  const double found = result.largest_displacement, share = 1 - linear / found;
  double bar = 0;
  for (const ErrorBar& each : result.error_bars.bars)
    if (each.of == ErrorBar::Of::largest_displacement && each.value > 0)
      bar = each.bar.half_width / each.value;
  if (!(found > 0 && linear > 0 && share * (1 + bar) > kNear)) return "";
  constexpr double kBuckled = 0.95;  // beyond buckling the share tends to 1
  if (share > kBuckled)
    return fmt::format(
        "the part has buckled, or is about to: it moves {} times as far as in proportion to the load, and a "
        "little less stiffness moves it further than any error bar here says",
        human_number(found / linear, 2));
  return fmt::format(
      "the part is about to buckle: it moves {} times as far as in proportion to the load, {}, so a little "
      "more load, or a little less stiffness, moves it much further than any error bar here says",
      human_number(found / linear, 2),
      bar > 1 - kNear ? fmt::format("on a lattice that may be off by {}", human_share(bar))
                      : fmt::format("which is about {} of what buckles it", human_share(share)));
}

// Outputs that only a timed run has.
void refuse_timed(const SimulateOptions& options, const std::string& scene) {
  if (!options.history.empty() || !options.series.empty())
    throw InputError(scene, "--history and a .pvd series are for timed runs: give [run] time = \"1 s\"");
  if (options.on_frame) throw InputError(scene, "frames are of timed runs: give [run] time = \"1 s\"");
  if (!options.live.empty()) throw InputError(scene, "--live is for timed runs: give [run] time = \"1 s\"");
  if (!options.checkpoint.empty())
    throw InputError(scene, "--checkpoint is for timed runs: give [run] time = \"1 s\"");
}

// Newton's method has no kernel of explicit steps.
void refuse_kernel(const SimulateOptions& options, const std::string& scene) {
  if (!options.isa.empty())
    throw InputError(scene, "--isa is for timed runs: give [run] time = \"1 s\", or leave it out");
}

// refuse_loose_fragments() of a body in pieces, which is one piece of matter.
void refuse_loose_piece(const std::vector<std::uint8_t>& tied, const Body& body, const std::string& scene) {
  double held = 0;  // ghosts far from own cells are held so that nothing is asked of them
  for (std::uint32_t e = 0; e < tied.size(); ++e) held += counts_element(e) && tied[e];
  if (over_pieces(held) > 0) return;
  Fragments one;
  one.list.resize(1);
  one.of_cell.assign(body.cell_count(), 0);
  one.of_element.assign(body.element_count(), 0);
  refuse_loose_fragments(one, body, std::vector<std::uint8_t>(tied.size(), 0), {}, scene);
}

// Cells of other processes bear stresses too.
Problem with_ghosts(const Problem& problem) {
  Problem whole = problem;
  whole.stray_cell.clear();
  return whole;
}

class Run {
 public:
  // `judged`: asks whether the equilibrium is stable, which takes a linear solution.
  Run(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress, bool judged)
      : body_(body),
        scene_(scene),
        options_(options),
        progress_(progress),
        judged_(judged),
        fragments_(other_pieces() ? Fragments() : find_fragments(body)),  // a body in pieces is one
        problem_(equilibrium_problem(body_, scene, fragments_, unsupported_)) {
    constexpr double kPosed = 0.2;
    prepared(kPosed);
  }

  SimulateResult operator()();
  // m: the largest displacement of the first linear answer, where that is one from rest; else 0.
  [[nodiscard]] double linear_reach() const { return linear_reach_; }

 private:
  // So much of what goes before the search for the equilibrium is done.
  void prepared(double share) { progress_.update(share * kBeforeSearch, "preparing"); }
  EquilibriumResult solve(Mechanics& mechanics);
  void warn_of_buckling(Mechanics& mechanics, const EquilibriumResult& solved);
  [[nodiscard]] std::optional<NearStart> coarse_equilibrium(Progress& stretch);
  [[nodiscard]] std::string save_failed();

  Body& body_;
  const Scene& scene_;
  const SimulateOptions& options_;
  Progress& progress_;
  bool judged_;
  Fragments fragments_;
  std::size_t unsupported_ = 0;  // elements at tips and edges that springs do not hold
  Problem problem_;
  bool buckled_ = false;
  double linear_reach_ = 0;
  FollowerMemory followers_;  // where the run ended
  int start_newton_iterations_ = 0;
  std::vector<std::uint8_t> tied_;  // (elements) Mechanics::tied_elements()
  State state_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

EquilibriumResult Run::solve(Mechanics& mechanics) {
  const LoadStepHooks* hooks = options_.hooks.get();
  const LoadStepSolver solver =
      hooks && hooks->make_solver ? hooks->make_solver(mechanics) : LoadStepSolver();
  tied_ = mechanics.tied_elements();
  if (other_pieces())
    refuse_loose_piece(tied_, body_, scene_.name);
  else
    refuse_loose_fragments(fragments_, body_, tied_, mechanics.coupled_elements(), scene_.name);
  refuse_unsupported_elements(mechanics, state_, scene_.name);
  refuse_free_motions(mechanics, state_, scene_.name);
  try {
    CoarseStart start;
    if (body_.cell_count() >= kLeastCellsToCoarsen && !other_pieces())
      start = [&](Progress& stretch) { return coarse_equilibrium(stretch); };
    return find_equilibrium(mechanics, state_, scene_.run, progress_, start, hooks, solver);
  } catch (const OverloadError& error) {
    throw OverloadError(error.what() + save_failed());
  } catch (const DivergedError& error) {
    throw DivergedError(error.what() + save_failed());
  } catch (const TimeoutError& error) {
    throw TimeoutError(error.what() + save_failed());
  }
}

// Where the elements are in equilibrium on a lattice twice as coarse: nothing where there is none, or where
// the coarse lattice says little of this one.
std::optional<NearStart> Run::coarse_equilibrium(Progress& stretch) {
  try {
    Coarsening coarse = coarsening(body_);
    if (share_of_thin_walls(coarse.body, 1) > kMostThinWalls) return std::nullopt;
    Scene same = scene_;
    same.probes.clear();
    same.run.tolerance = std::max(scene_.run.tolerance, kStartTolerance);
    SimulateOptions options = options_;
    options.stress = options.explain = false;
    options.failed_output.clear();
    options.hooks = hooks_on_coarser(options_.hooks);
    Run run(coarse.body, same, options, stretch, false);
    const SimulateResult found = run();
    start_newton_iterations_ = std::max(found.newton_iterations, found.start_newton_iterations);
    if (run.buckled_) return std::nullopt;  // the lattices may go to different sides
    if (options_.explain)
      progress_.say(fmt::format("start: from the equilibrium of {} cells, {} Newton iterations",
                                human_count(coarse.body.cell_count()), found.newton_iterations));
    return NearStart{prolonged_displacement(coarse, body_), run.followers_};
  } catch (const InputError&) {
  } catch (const DivergedError&) {
  } catch (const TimeoutError&) {
    check_stop();  // said once, by the run itself
  }
  return std::nullopt;
}

// Writes the last state in equilibrium; says where it is.
std::string Run::save_failed() {
  const StopWaits saving;
  if (options_.failed_output.empty()) return "";
  if (other_pieces()) {
    move_body(body_, state_);
    options_.hooks->save(body_, options_.failed_output);
    return "; the last state in equilibrium is in " + options_.failed_output;
  }
  carry_strays(fragments_, problem_, lone_elements(problem_), state_);
  move_body(body_, state_);
  body_.cell_columns.erase(kFreeStrainColumn);  // of this run only
  write_body(body_, options_.failed_output);
  return "; the last state in equilibrium is in " + options_.failed_output;
}

// A load that is as symmetric as the part does not excite the shape that it buckles into, so no load step meets buckling.
// Nor do free strain, which acts whole from the first one on, and loads that follow, which have no energy.
void Run::warn_of_buckling(Mechanics& mechanics, const EquilibriumResult& solved) {
  const auto drives = [](const ActiveEffect& effect) { return effect->drives(); };
  bool linked = false, follows = mechanics.follows();
  for (const Motion& motion : mechanics.constraints().motions)
    if (motion.link) {
      linked = true;
      follows |= motion.link->follower;
    }
  if (follows) report_following(has_positive_tangent(mechanics, state_) == true, progress_);
  const bool strained = body_.cell_columns.contains(kFreeStrainColumn);
  const bool loaded = std::any_of(mechanics.effects().begin(), mechanics.effects().end(), drives);
  if (!strained && (follows || !loaded || !judged_)) return;
  Preconditioner* near = strained ? nullptr : solved.preconditioner.get();
  const std::optional<bool> stable = mechanics.elsewhere()
                                         ? mechanics.elsewhere()->has_positive_tangent(state_)
                                         : has_positive_tangent(mechanics, state_, near);
  if (stable == true) return;
  const std::string less = strained ? "less heat or shrinkage than this" : "less than this load";
  progress_.warn(
      scene_.name + ": " +
      (stable
           ? fmt::format("this equilibrium is not stable: the part buckles under {}, and what is "
                         "told is as if it did not; {}",
                         less,
                         strained ? "a small load to the side shows where it goes"
                         : linked ? "smaller loads show from which on"  // [run] buckling has no rigid links
                                  : "[run] buckling = 1 with model \"quadratic\" tells from which "
                                    "load on")
           : "whether this equilibrium is stable was not found out: the part may buckle"));
}

// Of the whole body.
std::size_t all_unknowns(const Constraints& constraints, std::size_t elements) {
  if (!other_pieces()) return count_unknowns(constraints, elements);
  Constraints own;
  for (std::uint32_t e = 0; e < elements; ++e)
    if (counts_element(e)) own.mask.push_back(constraints.mask[e]);
  return static_cast<std::size_t>(over_pieces(static_cast<double>(count_unknowns(own, own.mask.size()))));
}

void count_work(const EquilibriumResult& solved, SimulateResult& result) {
  result.load_steps = solved.load_steps;
  result.newton_iterations = solved.newton_iterations;
  result.cg_iterations = solved.cg_iterations;
  result.relative_residual = solved.relative_residual;
}

SimulateResult Run::operator()() {
  SimulateResult result;
  report_materials(problem_, progress_);
  name_materials(body_, problem_.materials);
  const std::vector<ProbePoints> probes = place_probes(scene_, problem_);
  std::vector<ActiveEffect> effects = active_effects(scene_.effects, problem_);
  if (std::vector<FusedPoint> fused = fused_points(body_); !fused.empty())
    effects.push_back(activate(FusedPoints(body_, std::move(fused))));
  refuse_timed(effects, ActsIn::all, scene_.name);
  refuse_timed(options_, scene_.name);
  refuse_kernel(options_, scene_.name);
  report_effects(effects, "the parts' models, equilibrium by Newton's method", options_.explain, progress_);
  report_strays(fragments_, result, progress_);
  report_unsupported(unsupported_, result, progress_);
  Mechanics mechanics(problem_, std::move(effects));
  constexpr double kAssembled = 0.65;
  prepared(kAssembled);
  state_.displacement = where_to_begin(body_);
  const bool from_rest = std::all_of(state_.displacement.begin(), state_.displacement.end(),
                                     [](const Vec3& u) { return u.isZero(0); });
  EquilibriumResult solved = solve(mechanics);
  // What touches stiffens or softens the first answer, which says nothing of buckling then.
  if (from_rest && !solved.buckled && !mechanics.unilateral()) linear_reach_ = solved.linear_reach;
  const StopWaits answered;  // what is found is told: the rest takes moments
  warn_of_buckling(mechanics, solved);
  solved.preconditioner.reset();
  buckled_ = solved.buckled;
  followers_ = follower_memory(mechanics);
  mechanics.report(state_, result);
  for (const std::string& warning : warnings_of(result)) progress_.warn(scene_.name + ": " + warning);
  for (const ActiveEffect& effect : mechanics.effects())
    for (const std::string& warning : effect->warnings(state_)) progress_.warn(warning);
  result.elastic_energy = mechanics.elastic_energy(state_);
  result.smallest_jacobian = mechanics.most_compressed(state_).value;
  measure_corners(mechanics.smallest_corner_jacobian(state_), body_, result, progress_);
  mechanics.move_cells(nullptr);
  if (options_.stress)
    measure_stress(other_pieces() ? with_ghosts(problem_) : problem_, state_, body_, result);
  if (options_.estimate) mark_singular(body_, tied_, result);
  if (!other_pieces()) carry_strays(fragments_, problem_, lone_elements(problem_), state_);
  move_body(body_, state_);
  if (scene_.run.renormalise) renormalise_all(body_, problem_, state_.displacement);
  for (const ProbePoints& probe : probes) result.probes.push_back(measure(probe, state_));
  sum_up_imbalance(result);
  measure_displacement(body_, state_, result);
  result.mass = mass_of(problem_);
  refuse_not_finite(result, scene_.name);
  count_work(solved, result);
  result.unknowns = all_unknowns(mechanics.constraints(), body_.element_count());
  result.start_newton_iterations = start_newton_iterations_;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  if (options_.explain) {
    std::vector<EffectShare> shares = result.shares;
    shares.push_back({"linear solver", "", solved.linear_seconds});
    explain_times(shares, result.seconds, progress_);
  }
  return result;
}

// Free strain as rest shapes of model `cells`, in the body while this lives.
class FreeStrainInBody {
 public:
  FreeStrainInBody(Body& body, const Scene& scene) : body_(body) {
    const ThermalSettings& settings = scene.get<Thermal>();
    if (!settings.expands()) return;
    const std::vector<Material> materials = materials_of_parts(scene, body);
    Thermal::refuse_unfit(settings, body, models_of_parts(scene, body), materials);
    if (RestShapes(body).any())
      throw InputError(
          scene.name,
          "the body has a rest shape of its own, which an earlier run left, and free strain needs that of "
          "the lattice: begin with the body as voxelized");
    body.cell_columns[kFreeStrainColumn] = free_strain_column(body, FreeStrain(body, settings, materials));
  }
  ~FreeStrainInBody() { body_.cell_columns.erase(kFreeStrainColumn); }
  FreeStrainInBody(const FreeStrainInBody&) = delete;
  FreeStrainInBody& operator=(const FreeStrainInBody&) = delete;

 private:
  Body& body_;
};

void refuse_heat(const Scene& scene) {
  const ThermalSettings& settings = scene.get<Thermal>();
  if ((settings.expands() || settings.conducts()) && (scene.run.time || settles(scene)))
    throw InputError(
        scene.name,
        "heat and shrinkage act at equilibrium without contact only: leave [run] time, "
        "contact, rigid parts and manipulators out, or [thermal], [shrinkage] and faces of conduction");
}

// The runs at equilibrium without contact, by the model. `linear_reach` [m]: the largest displacement in proportion to
// the load; 0: not known; null: of a coarser lattice, for whose answer nobody is warned.
SimulateResult run_at_rest(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress,
                           double* linear_reach = nullptr) {
  if (is_quadratic(scene, body)) return run_quadratic(body, scene, options, progress, linear_reach);
  const FreeStrainInBody free(body, scene);
  Run run(body, scene, options, progress, linear_reach != nullptr);
  SimulateResult result = run();
  if (linear_reach != nullptr) *linear_reach = run.linear_reach();
  return result;
}

ErrorBars bars_at_rest(Body& body, const Scene& scene, const SimulateOptions& options,
                       const SimulateResult& result, Progress& progress) {
  const TakenTemperatures temperatures(body, scene.get<Thermal>());
  const SolveCoarse solve = [&](Body& coarse, const Scene& same, const SimulateOptions& how,
                                Progress& stretch) {
    temperatures.give(coarse);
    if (scene.get<Thermal>().conducts()) conduct(coarse, same, stretch);
    const SimulateResult found = run_at_rest(coarse, same, how, stretch);
    temperatures.take_back(coarse);
    return found;
  };
  return estimate_errors(body, scene, options, result, solve, progress);
}

// Where time is up meanwhile the equilibrium is written as the last one is, and not lost. Of a body in pieces only the first process
// knows of it.
void judge(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress,
           SimulateResult& result) {
  try {
    result.error_bars = bars_at_rest(body, scene, options, result, progress);
    check_stop();
  } catch (const TimeoutError& error) {
    if (options.failed_output.empty() || other_pieces()) throw;
    const StopWaits saving;
    write_body(body, options.failed_output);
    throw TimeoutError(
        fmt::format("{} in the error bars; the equilibrium is in {}", error.what(), options.failed_output));
  }
}

// What the closer look found is the largest stress, with its own bar.
void prefer_local_stress(bool estimate, SimulateResult& result) {
  if (!result.local_stress) return;
  const LocalStress& local = *result.local_stress;
  if (!result.stress->beside.empty()) return;  // it is of a peak elsewhere
  result.stress = local.stress;
  if (!estimate) return;
  const std::size_t last = local.values.size() - 1;
  result.error_bars.von_mises = {{local.values[0], local.values[std::min<std::size_t>(1, last)],
                                  local.values[std::min<std::size_t>(2, last)]},
                                 local.bar};
}

// run_at_rest() with its error bars.
SimulateResult run_and_judge(Body& body, const Scene& scene, const SimulateOptions& options,
                             Progress& progress) {
  double linear_reach = 0;
  SimulateResult result = run_at_rest(body, scene, options, progress, &linear_reach);
  if (options.estimate) {
    progress.stage("error bars");
    judge(body, scene, options, progress, result);
  }
  prefer_local_stress(options.estimate, result);
  if (const std::string told = near_buckling(linear_reach, result); !told.empty())
    progress.warn(scene.name + ": " + told);
  return result;
}

// Only contact in runs in time, or that settle, goes on with them.
void drop_stuck_places(Body& body, const Scene& scene, Progress& progress) {
  if (scene.get<Contact>().on && (scene.run.time || settles(scene))) return;
  if (const std::size_t count = stuck_places(body).size(); count > 0)
    progress.warn(
        fmt::format("{}: {} places of surfaces stuck together at the end of an earlier run; without "
                    "[contact] they are apart",
                    scene.name, count));
  body.notes.erase(kStuckNote);
}

void explain_memory(const Body& body, const Scene& scene, Progress& progress) {
  const std::optional<MemoryNeeded> needed = memory_needed(body, scene);
  if (!needed) return;
  const bool more = needed->with_large_deflections > needed->bytes;
  progress.say(
      fmt::format("memory: about {}{}", human_bytes(needed->bytes),
                  more ? ", with large deflections up to " + human_bytes(needed->with_large_deflections)
                       : std::string()));
}

}  // namespace

double parse_timeout(const std::string& text, const std::string& option) {
  const double seconds = parse_quantity(text, Dimension::time);
  if (!(seconds > 0)) throw InputError(option + ": must be above zero");
  return seconds;
}

SimulateResult simulate(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress) {
  const ThreadLimit limit(options.threads);
  refuse_empty(body);
  refuse_damaged_columns(body);
  if (!scene.run.time && !scene.events.empty()) {
    if (is_quadratic(scene, body))
      throw InputError(scene.name, "model \"quadratic\" has no [[event]]; use model \"cells\"");
    happen_before_equilibrium(body, scene, progress);
    Scene after = scene;
    after.events.clear();
    return simulate(body, after, options, progress);
  }
  erase_stress_columns(body);
  body.cell_columns.erase(kFreeStrainColumn);  // a run's own
  progress.stage("simulate");
  drop_stuck_places(body, scene, progress);
  const Scene first = scene.events.empty() ? scene : at_the_beginning(scene, body);
  check_actions(first, body, progress);
  if (!options.resume) {
    Bonds::refuse_joined_apart(first.get<Bonds>(), body);
    Joints::refuse_fused(first.get<Joints>(), body);
  }
  refuse_heat(scene);
  const bool alone = !options.hooks;  // others' memory is not known here
  if (alone) refuse_beyond_memory(body, scene);
  if (alone && options.explain) explain_memory(body, scene, progress);
  if (scene.get<Thermal>().conducts()) conduct(body, scene, progress);
  if (asks_for_modes(scene)) {
    SimulateResult result = run_modes(body, scene, options, progress);
    progress.finish();
    return result;
  }
  if (is_quadratic(scene, body)) {
    refuse_timed(options, scene.name);
    refuse_kernel(options, scene.name);
    SimulateResult result = run_and_judge(body, scene, options, progress);
    progress.finish();
    return result;
  }
  body.cell_columns.erase(kQuadraticColumn);
  if (scene.run.time) {
    SimulateResult result = run_in_time(body, scene, options, progress);
    progress.finish();
    return result;
  }
  if (settles(scene)) {
    refuse_timed(options, scene.name);
    SimulateResult result = settle(body, scene, options, progress);
    progress.finish();
    return result;
  }
  SimulateResult result = run_and_judge(body, scene, options, progress);
  progress.finish();
  return result;
}

}  // namespace flexel::simulate
