// The whole load is tried at once (or in the steps that the scene asks for). A step that fails is halved and
// tried again from the last equilibrium; one that succeeds lets the next be twice as long.
#include "simulate/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/error.h"
#include "formats/program.h"
#include "formats/units.h"
#include "simulate/newton.h"

namespace flexel {
namespace {

constexpr double kSmallestIncrement = 1.0 / 1024;  // of the first load step
constexpr int kEasyIterations = 10;
constexpr double kHopelessReach = 300;  // diagonals of the body

std::string axis_name(const Vec3& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(direction[axis]) > 0.999) return std::string(1, static_cast<char>('x' + axis));
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
}

std::string motion_name(const FreeMotion& motion) {
  if (motion.rotation == Vec3::Zero()) return "translate along " + axis_name(motion.translation);
  return "rotate about " + axis_name(motion.rotation);
}

std::string point_name(const Vec3& at) {
  return fmt::format("({}, {}, {})", human_length(at.x()), human_length(at.y()), human_length(at.z()));
}

[[noreturn]] void diverge(Mechanics& mechanics, const State& reached, double done, double tried,
                          const NewtonOutcome& outcome) {
  const SmallestJacobian worst = mechanics.cells().smallest_jacobian(reached);
  const Body& body = mechanics.body();
  const std::uint32_t element = body.cell_elements[worst.cell][0];
  const std::uint32_t part = element_parts(body)[element];
  throw DivergedError(
      fmt::format("no equilibrium beyond {:.4g} % of the load (tried {:.4g} %, Newton iteration {}): {}; the "
                  "most compressed cell is {} near "
                  "{} of part \"{}\" with J = {:.3g}. Use a smaller load or move, a smaller spacing or a "
                  "stiffer material; a part that "
                  "buckles or snaps through has no equilibrium nearby",
                  100 * done, 100 * tried, outcome.iterations + 1, outcome.trouble, worst.cell,
                  point_name(body.rest[element]), body.parts[part].name, worst.value));
}

}  // namespace

void refuse_free_motions(Mechanics& mechanics, const std::string& scene) {
  const State rest{std::vector<Vec3>(mechanics.body().element_count(), Vec3::Zero()), 1};
  mechanics.assemble(rest, false);
  mechanics.eliminate_prescribed();
  const std::vector<FreeMotion> free =
      free_motions(mechanics.stiffness(), node_geometry(mechanics.body(), rest));
  if (free.empty()) return;
  std::vector<std::string> names;
  for (const FreeMotion& motion : free) {
    const std::string name = "to " + motion_name(motion);
    if (motion.part == free.front().part && std::find(names.begin(), names.end(), name) == names.end())
      names.push_back(name);
  }
  throw InputError(scene,
                   fmt::format("part \"{}\" is free {}: add a [[fix]] that stops it",
                               mechanics.body().parts[free.front().part].name, fmt::join(names, " and ")));
}

EquilibriumResult find_equilibrium(Mechanics& mechanics, State& state, const RunSettings& settings,
                                   Progress& progress) {
  EquilibriumResult result;
  const double first = 1.0 / settings.load_steps;
  double done = 0, increment = first;
  NewtonOptions options;
  options.tolerance = settings.tolerance;
  options.hopeless_reach = kHopelessReach * bounding_box(mechanics.body().rest).diagonal();
  while (done < 1) {
    State trial = state;
    trial.share = done + increment > 1 - 1e-9 ? 1 : done + increment;
    const NewtonOutcome outcome = newton(mechanics, trial, options, [&](const std::string& note) {
      throw_if_interrupted();
      progress.update(done, fmt::format("load {:.3g} %, {}", 100 * trial.share, note));
    });
    result.newton_iterations += outcome.iterations;
    result.cg_iterations += outcome.cg_iterations;
    result.linear_seconds += outcome.linear_seconds;
    if (!outcome.converged) {
      if (outcome.hopeless || increment <= kSmallestIncrement * first)
        diverge(mechanics, trial, done, trial.share, outcome);
      increment /= 2;
      continue;
    }
    done = trial.share;
    state = std::move(trial);
    ++result.load_steps;
    result.relative_residual = outcome.relative_residual;
    if (outcome.iterations <= kEasyIterations) increment = std::min(first, 2 * increment);
  }
  return result;
}

}  // namespace flexel
