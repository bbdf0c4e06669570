// Each item of the scene becomes one of the analysis; what has no counterpart is refused by name.
#include "flexel/export/translate.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "base/human.h"
#include "base/program/progress_stretch.h"
#include "base/units.h"
#include "flexel/export/analysis.h"
#include "flexel/export/nodal_forces.h"
#include "flexel/export/support_constraints.h"
#include "flexel/export/touching_faces.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/gravity.h"
#include "simulate/result/options.h"
#include "simulate/simulate.h"
#include "voxelize/voxelize.h"

namespace flexel::mesh_export {
namespace {

constexpr double kTouching = 1e-2;  // of the spacing or the mesh's edge: surfaces this near touch
constexpr double kTied = 0.1;       // of a tetrahedron's edge: gap that is tied
constexpr std::size_t kProbeCells = 3000;
constexpr double kSmallShare = 1e-3, kDifference = 0.01;
constexpr double kSmallAngle = 0.01;                  // rad
constexpr double kVoxelizing = 0.2, kSmallRun = 0.5;  // shares of the look's time that are gone after each

std::string kind_of(const simulate::Load& load) {
  if (load.pressure) return "pressure";
  if (load.bearing) return "bearing load";
  if (load.torque && !load.force) return "torque";
  if (load.at || load.torque) return "remote force";
  return "force";
}

AnalysisLoad translate_load(const simulate::Load& load, const AnalysisMesh& mesh,
                            const simulate::Problem& problem) {
  AnalysisLoad result;
  result.name = load.name;
  result.kind = kind_of(load);
  const std::vector<Vec3> forces = nodal_forces(load, mesh, problem);
  for (std::uint32_t node = 0; node < forces.size(); ++node)
    if (forces[node] != Vec3::Zero()) {
      result.forces.emplace_back(node, forces[node]);
      result.total += forces[node];
    }
  return result;
}

// Mean length of the elements' sides [m].
double mesh_size(const AnalysisMesh& mesh) {
  if (mesh.kind == AnalysisMesh::Kind::hexahedra) {
    double sum = 0;
    for (const Part& part : mesh.body.parts) sum += part.lattice.spacing.mean();
    return sum / static_cast<double>(mesh.body.parts.size());
  }
  double sum = 0;
  for (std::size_t e = 0; e < mesh.element_count(); ++e)
    sum += (mesh.body.rest[mesh.element(e)[0]] - mesh.body.rest[mesh.element(e)[1]]).norm();
  return sum / static_cast<double>(mesh.element_count());
}

void add_ties(const simulate::Scene& scene, Analysis& analysis) {
  if (!scene.get<simulate::Bonds>().bond || analysis.mesh.body.parts.size() < 2) return;
  const double size = mesh_size(analysis.mesh);
  const bool lattice = analysis.mesh.kind == AnalysisMesh::Kind::hexahedra;
  analysis.ties = touching_faces(analysis.mesh, kTouching * size);
  for (TiedFaces& tie : analysis.ties) tie.tolerance = lattice ? size : kTied * size;
  if (lattice && !analysis.ties.empty())
    analysis.warnings.push_back(
        "parts that touch are tied by *TIE between the lattices' skins, which lie up to a cell apart; "
        "--mesh tet ties the faces themselves");
}

void scale_actions(simulate::Scene& scene, double factor) {
  for (simulate::Load& load : scene.get<simulate::Loads>().loads) {
    if (load.force) *load.force *= factor;
    if (load.torque) *load.torque *= factor;
    if (load.pressure) *load.pressure *= factor;
  }
  for (simulate::Tie& tie : scene.get<simulate::Supports>().ties) {
    tie.motion.translation *= factor;
    tie.motion.angle *= factor;
    if (tie.link) {
      tie.link->force *= factor;
      tie.link->torque *= factor;
    }
  }
  if (auto& g = scene.get<simulate::Gravity>().acceleration) *g *= factor;
}

}  // namespace

void refuse_untranslatable(const simulate::Scene& scene, const simulate::Problem& problem) {
  if (scene.run.time)
    throw InputError(
        scene.name,
        "this scene is a timed run ([run] time): only equilibrium is exported; leave \"time\" and "
        "what needs it out, or use --scene with another file");
  if (!scene.events.empty())
    throw InputError(scene.name, "[[event]] has no translation: only equilibrium is exported");
  for (const simulate::Tie& tie : scene.get<simulate::Supports>().ties)
    if (tie.link)
      throw InputError(tie.origin, fmt::format("load \"{}\": a rigid link has no translation; export it with "
                                               "link = \"averaging\"",
                                               tie.name));
  for (const simulate::Load& load : scene.get<simulate::Loads>().loads)
    if (load.follower)
      throw InputError(load.origin,
                       fmt::format("load \"{}\": follower = true has no translation: leave it out to "
                                   "export the load as it is at rest",
                                   load.name));
  simulate::EffectParameters others = scene.effects;
  others.get<simulate::Gravity>().acceleration.reset();
  others.get<simulate::Loads>() = {};
  others.get<simulate::Supports>() = {};
  others.get<simulate::Bonds>().bond = false;
  for (const simulate::ActiveEffect& effect : simulate::active_effects(others, problem))
    throw InputError(scene.name,
                     fmt::format("{} ({}) has no translation: gravity, loads, fixes, moves and bonded parts "
                                 "are exported; leave it out",
                                 effect.name, effect.why));
}

std::vector<std::string> drop_models(simulate::Scene& scene) {
  std::vector<std::string> lines;
  if (!scene.model.empty() && scene.model != "cells")
    lines.push_back(
        fmt::format("model \"{}\" is exported as ordinary elastic matter of the same material", scene.model));
  scene.model.clear();
  for (auto& [name, settings] : scene.parts) {
    if (!settings.model.empty() && settings.model != "cells")
      lines.push_back(
          fmt::format("part \"{}\": model \"{}\" is exported as ordinary elastic matter of the same material",
                      name, settings.model));
    settings.model.clear();
    settings.hooke.clear();
  }
  return lines;
}

namespace {

std::string series_of_chains(const simulate::Material& material) {
  return fmt::format(
      "material \"{}\": CalculiX has the first five terms of Arruda and Boyce's series, whose chains do not "
      "end: softer by 1 % "
      "where I1 is {:.3g} (0.41 of 3 lambda_m^2), by 12 % where it is {:.3g}",
      material.name, 0.41 * 3 * material.lambda_m * material.lambda_m,
      0.66 * 3 * material.lambda_m * material.lambda_m);
}

}  // namespace

Analysis translate(AnalysisMesh mesh, const simulate::Scene& scene, const simulate::Problem& problem) {
  Analysis analysis;
  analysis.mesh = std::move(mesh);
  analysis.materials = problem.materials;
  for (const simulate::Material& material : analysis.materials)
    if (material.law == simulate::LawName::arruda_boyce)
      analysis.warnings.push_back(series_of_chains(material));
  HeldValues taken;
  std::size_t shared = 0;
  for (const simulate::Tie& tie : scene.get<simulate::Supports>().ties)
    analysis.supports.push_back(hold(tie, analysis.mesh, problem, taken, shared));
  if (shared > 0)
    analysis.warnings.push_back(fmt::format(
        "{} displacement(s) of nodes that two supports share are led differently by them: the first holds",
        human_count(shared)));
  for (const simulate::Load& load : scene.get<simulate::Loads>().loads) {
    analysis.loads.push_back(translate_load(load, analysis.mesh, problem));
    if (!load.course.time.empty())
      analysis.warnings.push_back(fmt::format("load \"{}\": its course in time is left out", load.name));
  }
  analysis.gravity = scene.get<simulate::Gravity>().acceleration;
  add_ties(scene, analysis);
  for (const simulate::Probe& probe : scene.probes)
    analysis.probes.push_back(place_probe(probe, analysis.mesh, problem));
  analysis.load_steps = scene.run.load_steps;
  if (scene.run.renormalise)
    analysis.warnings.push_back(
        "\"renormalise\" is left out: the deformed shape does not become the rest shape");
  return analysis;
}

bool large_deflection(const Surface& surface, simulate::Scene scene, int threads, std::string& why,
                      Progress& progress) {
  simulate::SimulateOptions options;
  options.threads = threads;
  options.stress = options.estimate = false;
  for (const simulate::Tie& tie : scene.get<simulate::Supports>().ties)
    if (std::abs(tie.motion.angle) > kSmallAngle) {
      why = fmt::format("\"{}\" is turned by {:.3g} degrees", tie.name, tie.motion.angle * 180 / M_PI);
      return true;
    }
  double moved[2] = {0, 0};
  try {
    voxelize::VoxelizeOptions coarse;
    coarse.count = kProbeCells;
    ProgressStretch voxelizing(progress, 0, kVoxelizing);
    Body body = voxelize::voxelize(surface, coarse, voxelizing.inner()).body;
    for (const bool small : {true, false}) {
      simulate::Scene scaled = scene;
      if (small) scale_actions(scaled, kSmallShare);
      Body copy = body;
      ProgressStretch run(progress, small ? kVoxelizing : kSmallRun, small ? kSmallRun : 1);
      moved[small] = simulate::simulate(copy, scaled, options, run.inner()).largest_displacement /
                     (small ? kSmallShare : 1);
    }
  } catch (const DivergedError&) {
    if (moved[1] > 0) {
      why = "a coarse run of Flexel finds no equilibrium under the whole load";
      return true;
    }
    why = "could not be told: a coarse run of Flexel diverged";
    return false;
  } catch (const InputError& error) {
    why = fmt::format("could not be told by a coarse run of Flexel ({})", error.what());
    return false;
  }
  if (!(moved[1] > 0)) {
    why = "nothing moves";
    return false;
  }
  const double difference = std::abs(moved[0] / moved[1] - 1);
  why = fmt::format("in a coarse run of Flexel large rotations change the largest displacement by {}",
                    human_share(difference));
  return difference > kDifference;
}

}  // namespace flexel::mesh_export
