// The run: what the model does not have is refused first; then one linear solution, and what is reported of it.
#include "simulate/quadratic/quadratic_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/error.h"
#include "base/human.h"
#include "base/stop.h"
#include "formats/lattice/column_names.h"
#include "formats/lattice/fused_points.h"
#include "simulate/effects/rigid.h"
#include "simulate/estimate/stress_singularity.h"
#include "simulate/matter/fragments.h"
#include "simulate/matter/interpolation_weights.h"
#include "simulate/matter/joined_parts.h"
#include "simulate/models/cells.h"
#include "simulate/models/stiffness.h"
#include "simulate/probes/probes.h"
#include "simulate/probes/report.h"
#include "simulate/quadratic/local_stress.h"
#include "simulate/quadratic/quadratic_newton.h"
#include "simulate/quadratic/quadratic_solve.h"
#include "simulate/quadratic/quadratic_stress.h"
#include "simulate/result/memory_limit.h"
#include "simulate/thermal/thermal.h"

namespace flexel::simulate {
namespace {

// Stress is taken as proportional to strain: an answer is off by about the strain.
constexpr double kNoticeable = 0.03, kTooLarge = 0.25;

// The warning that strains are not small; "" where they are. Throws DivergedError where they are large.
std::string judge_strain(double strain) {
  constexpr const char* kAssumed = "model \"quadratic\" takes stress as proportional to strain";
  if (strain > kTooLarge)
    throw DivergedError(
        fmt::format("matter is strained by {}, and {}: that answer would be worth nothing; use "
                    "model \"cells\"",
                    human_share(strain), kAssumed));
  if (!(strain > kNoticeable)) return "";
  return fmt::format(
      "matter is strained by {}, and {}: about so much of the answer is left out; use model \"cells\"",
      human_share(strain), kAssumed);
}

// Walls of a few hundredths of a cell are held by what keeps cells of slivers regular.
void judge_outside(double share, Progress& progress) {
  constexpr double kTold = 0.01, kRefused = 0.1;
  const std::string what = fmt::format(
      "{} of the elastic energy lies where there is no matter: the walls are too thin for these cells, "
      "and the answer is too stiff by about as much; use a smaller --size",
      human_share(share));
  if (share > kRefused) throw DivergedError("model \"quadratic\": " + what);
  if (share > kTold) progress.warn(what);
}

// What the model leaves out, and what speaks against the answer.
void judge(const QuadraticSystem& system, const QuadraticSolution& solution, SimulateResult& result,
           Progress& progress) {
  result.strain_warning = judge_strain(typical_strain(system, solution));
  if (!result.strain_warning.empty()) progress.warn(result.strain_warning);
  judge_outside(energy_outside(system, solution, result.elastic_energy), progress);
  if (system.follows() || system.links_follow())
    report_following(solution.stable == true, progress);
  else if (!solution.stable)
    progress.warn(
        "whether this equilibrium is stable was not found out: the part may buckle, which model \"cells\" "
        "follows");
  else if (!*solution.stable)
    progress.warn(
        "this equilibrium is not stable: the part buckles under less than this load, somewhere at least, and "
        "what is told is as if it did not; model \"cells\" with a small load to the side shows where");
}

ProbeResult measure_probe(const Probe& probe, const ProbePoints& placed, const QuadraticSystem& system,
                          const Body& body, const State& state) {
  const QuadraticField field(body, state.displacement);
  const std::vector<std::uint32_t> part = cell_parts(body);
  if (placed.cell)
    return {placed.name, placed.where,
            field.displacement(*placed.cell, cell_coordinates(body, body.parts[part[*placed.cell]],
                                                              *placed.cell, placed.where))};
  const Selected selected = resolve(*probe.where, body);
  const std::vector<FacePoint> points =
      selected.polygons.empty() ? std::vector<FacePoint>{}
                                : face_points(system.problem(), system.nodes(), selected.polygons);
  if (points.empty()) return measure(placed, state);
  ProbeResult result{placed.name, Vec3::Zero(), Vec3::Zero()};
  double area = 0;
  for (const FacePoint& point : points) {
    const double share = point.area_vector.norm();
    area += share;
    result.where += share * point.position;
    result.displacement += share * field.displacement(system.nodes().cells[point.cell], point.at);
  }
  result.where /= area;
  result.displacement /= area;
  return result;
}

// For singular_beside(): where supports hold, and where parts are bonded, whose edges are corners of two materials.
std::vector<std::uint8_t> singular_elements(const QuadraticSystem& system) {
  std::vector<std::uint8_t> found = system.tied_elements();
  for (const std::vector<std::uint32_t>& elements : system.bonded_elements())
    for (const std::uint32_t e : elements)
      if (found[e] != 2) found[e] = 3;
  return found;
}

// What bonds, held cells and links take is not known before they are placed.
void refuse_too_large(const QuadraticSystem& system, const Body& body, const std::string& scene) {
  constexpr double kBond = 105e3, kLink = 6 * 2 * sizeof(Vec3);  // bytes; of a link, a node
  const std::size_t cells = system.nodes().cells.size(), links = system.linked().size();
  std::size_t held = 0;
  for (std::size_t c = 0; c < cells; ++c) held += system.is_supported(c) ? 1 : 0;
  const double needed = quadratic_memory(body, held).bytes +
                        kBond * static_cast<double>(system.bonds().size()) +
                        kLink * static_cast<double>(links * system.nodes().size());
  refuse_beyond_memory(
      needed,
      fmt::format("model \"quadratic\", cells {}, held or bonded {}, bonded pairs {}, rigid "
                  "bodies {}",
                  human_count(cells), human_count(held), human_count(system.bonds().size()), links),
      scene);
}

void count_work(const QuadraticSystem& system, const QuadraticSolution& solution, SimulateResult& result) {
  result.unknowns = 3 * system.nodes().size();  // supports hold by Nitsche's method: nothing is prescribed
  result.load_steps = std::max(solution.load_steps, 1);
  result.newton_iterations = solution.newton_iterations + 1;
  result.cg_iterations = solution.iterations;
  result.relative_residual = solution.relative_residual;
}

// s: `solving` of the linear solver.
void share_time(const std::vector<ActiveEffect>& effects, double solving, bool explain,
                SimulateResult& result, Progress& progress) {
  for (const ActiveEffect& effect : effects)
    result.shares.push_back({effect.name, effect.why, effect.seconds});
  if (!explain) return;
  std::vector<EffectShare> shares = result.shares;
  shares.push_back({"linear solver", "", solving});
  explain_times(shares, result.seconds, progress);
}

[[noreturn]] void refuse_closer_look_at(const std::string& what, const Scene& scene) {
  throw InputError(scene.name, "the closer look at the largest stress does not take " + what);
}

void refuse_what_closer_look_lacks(const QuadraticSystem& system, const Scene& scene) {
  if (const std::string lacks = local_stress_lacks(system); !lacks.empty())
    refuse_closer_look_at(lacks, scene);
}

// The largest stress on finer cells around it. What the run has stays where they cannot be solved.
void take_closer_look(const QuadraticSystem& system, const QuadraticSolution& solution, const Scene& scene,
                      const SimulateOptions& options, const Stresses& field, Body& body,
                      SimulateResult& result, Progress& progress) {
  try {
    progress.stage("largest stress");
    LocalStressField found =
        look_closer(system, solution, scene, options.cut_box, field, singular_elements(system), progress);
    StressSummary& stress = found.found.stress;
    if (!result.stress->beside.empty() && !found.found.bar) {
      result.no_local_stress =
          fmt::format("it lies beside {}, and farther away none comes to a limit", result.stress->beside);
      return;
    }
    if (found.found.values.empty()) return;
    SimulateResult same;
    report_stress(system.problem(), found.field, body, same);
    if (same.stress->yield_share && same.stress->value > 0)
      stress.yield_share = *same.stress->yield_share * stress.value / same.stress->value;
    result.stress->beside.clear();
    if (same.stress->value > stress.value) {
      result.stress = same.stress;
      mark_singular(body, singular_elements(system), result, kBesideInField);
    }
    result.local_stress = std::move(found.found);
  } catch (const InputError& error) {
    result.no_local_stress = error.what();
  } catch (const DivergedError& error) {
    result.no_local_stress = error.what();
  } catch (const TimeoutError& error) {  // a limit of the whole command ends what comes next
    result.no_local_stress = error.what();
  }
}

// What a run finds at the vertices goes by these names.
void tell_replaced_columns(const Body& body, Progress& progress) {
  if (has_surface_stress(body)) return;  // an earlier run's
  for (const char* name : {kVonMisesColumn, kPrincipalColumn, kYieldColumn})
    if (body.surface.vertex_columns.contains(name))
      progress.warn(
          fmt::format("the part's own column \"{}\" is replaced by what this run finds: give it "
                      "another name in the part's file to keep it",
                      name));
}

}  // namespace

void refuse_what_quadratic_lacks(const Scene& scene, const Body& body,
                                 const std::vector<ActiveEffect>& effects) {
  const std::string needs = "model \"quadratic\" finds equilibria at small strain: ";
  if (scene.run.time) throw InputError(scene.name, needs + "it has no [run] time; use model \"cells\"");
  if (scene.run.renormalise)
    throw InputError(scene.name, needs + "it has no renormalise; use model \"cells\"");
  for (const ActiveEffect& effect : effects)
    if (effect.name != Supports::name && effect.name != Loads::name && effect.name != Bonds::name &&
        effect.name != "gravity" && effect.name != Thermal::name && effect.name != RigidParts::name)
      throw InputError(scene.name, fmt::format("{}it has no {} ({}); use model \"cells\"", needs, effect.name,
                                               effect.why));
  for (const ActiveEffect& effect : effects)
    if (effect.acts > ActsIn::all && effect.name != RigidParts::name)
      throw InputError(scene.name,
                       fmt::format("{} ({}) acts in timed runs only: give [run] time = \"1 s\", or "
                                   "leave it out",
                                   effect.name, effect.why));
  const auto acts = [&](std::string_view name) {
    return std::any_of(effects.begin(), effects.end(),
                       [&](const ActiveEffect& each) { return each.name == name; });
  };
  if (acts(Thermal::name) && acts(Bonds::name))
    throw InputError(scene.name, needs + "it has no heat and shrinkage across bonds; use model \"cells\"");
  for (const Columns* columns : {&body.cell_columns, &body.element_columns})
    for (const auto& [name, column] : *columns)
      if (!is_stress_column(name) && name != "velocity" && name != kQuadraticColumn &&
          name != kTemperatureColumn && !is_temperature_column(scene.get<Thermal>(), name))
        throw InputError(scene.name,
                         fmt::format("{}it does not know what an earlier run left in the body (\"{}\"); use "
                                     "model \"cells\"",
                                     needs, name));
  if (body.notes.contains(kFusedNote) || body.notes.contains(kJoinedNote))
    throw InputError(
        scene.name,
        fmt::format("{}it does not know parts that an earlier run fused or brought; use model \"cells\"",
                    needs));
  for (const Manipulator& each : scene.get<RigidParts>().manipulators)
    throw InputError(
        each.origin,
        fmt::format("{}it has no [[manipulator]] (\"{}\"); make the part rigid, and lead one of its "
                    "faces with [[move]]",
                    needs, each.name));
  for (const Part& part : body.parts)
    if (part.placement == Placement::centre)
      throw InputError(scene.name,
                       fmt::format("model \"quadratic\" needs elements at the corners of the voxels: "
                                   "voxelize part \"{}\" with --placement corner",
                                   part.name));
}

QuadraticSolution quadratic_equilibrium(const QuadraticSystem& system, const Scene& scene, double& seconds,
                                        Progress& progress) {
  constexpr double kRough = 1e-3;  // of a linear solution that large deflections may change
  const ScopeTimer timer(seconds);
  const auto linear = [&](int iteration, double residual) {
    check_stop();
    progress.update(0.05 + 0.4 * std::min(1.0, std::log(residual) / std::log(scene.run.tolerance)),
                    fmt::format("iteration {}", iteration));
  };
  const double rough = system.linked().empty() ? std::max(kRough, scene.run.tolerance) : scene.run.tolerance;
  QuadraticSolution solution = solve(system, rough, 1, scene.name, linear);
  const auto large = [&](double share, double residual) {
    check_stop();
    progress.update(0.45 + 0.5 * share, fmt::format("residual {:.1e}", residual));
  };
  if (solve_large(system, scene.run, scene.name, linear, large, solution)) return solution;
  solution = solve(system, scene.run.tolerance, solution.safety * kMoreSafety, scene.name, linear);
  if (!solve_large(system, scene.run, scene.name, linear, large, solution))
    throw DivergedError(scene.name +
                        ": model \"quadratic\" did not converge; use a smaller --size, or model \"cells\"");
  return solution;
}

void refuse_closer_look(const Body& body, const Scene& scene) {
  const Problem problem{body,
                        materials_of_parts(scene, body),
                        stray_cells(find_fragments(body)),
                        models_of_parts(scene, body),
                        {},
                        {},
                        {},
                        {}};
  refuse_what_quadratic_lacks(scene, body, active_effects(scene.effects, problem));
  if (scene.get<Thermal>().expands())  // its temperatures are not known yet
    refuse_closer_look_at("heat and shrinkage", scene);
  refuse_what_closer_look_lacks(QuadraticSystem(problem, scene), scene);
}

bool asks_for_quadratic(const Scene& scene) {
  return scene.model == "quadratic" ||
         std::any_of(scene.parts.begin(), scene.parts.end(),
                     [](const auto& part) { return part.second.model == "quadratic"; });
}

bool is_quadratic(const Scene& scene, const Body& body) {
  const std::vector<Model> models = models_of_parts(scene, body);
  const auto other =
      std::find_if(models.begin(), models.end(), [](Model each) { return each != Model::quadratic; });
  if (other == models.end()) return true;
  if (std::find(models.begin(), models.end(), Model::quadratic) == models.end()) return false;
  throw InputError(scene.name,
                   fmt::format("model \"quadratic\" is for all parts or none: write [parts.\"{}\"] "
                               "model = \"quadratic\" too",
                               body.parts[static_cast<std::size_t>(other - models.begin())].name));
}

SimulateResult run_quadratic(Body& body, const Scene& scene, const SimulateOptions& options,
                             Progress& progress, double* linear_reach) {
  const auto began = std::chrono::steady_clock::now();
  const Fragments fragments = find_fragments(body);
  const Problem problem{
      body, materials_of_parts(scene, body), stray_cells(fragments), models_of_parts(scene, body), {}, {}, {},
      {}};
  SimulateResult result;
  report_materials(problem, progress);
  const std::vector<ProbePoints> probes = place_probes(scene, problem);
  const std::vector<ActiveEffect> effects = active_effects(scene.effects, problem);
  refuse_what_quadratic_lacks(scene, body, effects);
  report_effects(effects,
                 "cells with quadratic shape functions, which turn with their matter where that matters",
                 options.explain, progress);
  report_strays(fragments, result, progress);
  const QuadraticSystem system(problem, scene);
  refuse_too_large(system, body, scene.name);
  if (options.cut_box) refuse_what_closer_look_lacks(system, scene);
  for (const std::string& warning : system.warnings()) progress.warn(warning);
  refuse_loose_fragments(fragments, body, system.tied_elements(), system.bonded_elements(), scene.name);
  double solving = 0;
  const QuadraticSolution solution = quadratic_equilibrium(system, scene, solving, progress);
  std::optional<StopWaits> answered(std::in_place);
  name_materials(body, problem.materials);
  State state;
  state.displacement = element_displacement(system, solution);
  report(system, solution, result);
  result.bonds = system.bonded_parts();
  judge(system, solution, result, progress);
  sum_up_imbalance(result);
  for (const std::string& warning : warnings_of(result)) progress.warn(scene.name + ": " + warning);
  if (options.stress) tell_replaced_columns(body, progress);
  Stresses field;
  if (options.stress) report_stress(problem, field = field_stresses(system, solution, state), body, result);
  if (options.estimate || options.cut_box)
    mark_singular(body, singular_elements(system), result, kBesideInField);
  const StiffnessPattern pattern =
      stiffness_pattern(body, active_cells(problem), connection_rows({}, body.element_count()), {}, false);
  carry_strays(fragments, problem, pattern.stencil, state);
  write_field(system.nodes(), solution, state, body);
  for (std::size_t p = 0; p < probes.size(); ++p)
    result.probes.push_back(measure_probe(scene.probes[p], probes[p], system, body, state));
  for (std::size_t e = 0; e < body.element_count(); ++e)
    body.position[e] = body.rest[e] + state.displacement[e];
  measure_displacement(body, state, result);
  if (linear_reach != nullptr) *linear_reach = result.largest_displacement / solution.amplification;
  result.mass = mass_of(problem);
  refuse_not_finite(result, scene.name);
  count_work(system, solution, result);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  share_time(effects, solving, options.explain, result, progress);
  answered.reset();
  if (options.cut_box && result.stress)
    take_closer_look(system, solution, scene, options, field, body, result, progress);
  return result;
}

}  // namespace flexel::simulate
