// The answers of the elements to the last motions of the tools predict that to the next, and Newton's method begins there. What it
// then finds is the equilibrium, whatever was predicted. While a hand moves, a step of the linear model or two is enough: a residual
// of a hundredth is some micrometres of a bracket of 80 mm.
#include "flexel/clay/pulled_body.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/conditions/rigid_link.h"
#include "simulate/effects/supports.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/events/fused.h"
#include "simulate/indent/indenters.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/vector_products.h"
#include "simulate/matter/coplanar_elements.h"
#include "simulate/models/rest_shape.h"
#include "simulate/models/set_rest_shape.h"
#include "simulate/quadratic/quadratic_run.h"
#include "simulate/scene/scene_checks.h"
#include "simulate/thermal/thermal.h"
#include "simulate/time/dynamic_relaxation.h"

namespace flexel::clay {
namespace {

constexpr int kLoweringIterations = 40;
constexpr double kLeastScale = 1e-2;  // of the strongest force so far
// Following
constexpr int kMostSteps = 4, kMostGradients = 8;
constexpr double kLeastForcing = 0.05, kMostForcing = 0.2;  // of the linear solution
constexpr double kServes = 0.6;  // a step with a tangent that serves leaves at most this of the residual
// Likewise where tools push: points come to touch, and cease to, with each step
constexpr int kMostTouchingSteps = 16, kTouchingGradients = 12, kStepsOfATangent = 6;
constexpr double kTouchingForcing = 0.1, kArmijo = 1e-4, kShortestStep = 1.0 / 1024, kFar = 0.3;

simulate::Problem problem_of(const simulate::Scene& scene, const Body& body,
                             const simulate::Fragments& fragments) {
  simulate::Problem problem{body,
                            materials_of_parts(scene, body),
                            stray_cells(fragments),
                            models_of_parts(scene, body),
                            hooke_of_parts(scene, body),
                            stray_elements(fragments, body),
                            {},
                            simulate::settled_displacement(body)};
  const std::vector<std::uint8_t> unsupported = unsupported_elements(problem);
  for (std::size_t e = 0; e < unsupported.size(); ++e)
    if (unsupported[e]) problem.stray_element[e] = 1;
  return problem;
}

std::size_t pushers_of(const std::vector<LedTool>& tools) {
  return static_cast<std::size_t>(
      std::count_if(tools.begin(), tools.end(), [](const LedTool& tool) { return tool.pushes; }));
}

}  // namespace

void refuse_unled(const simulate::Scene& scene, std::size_t pushers) {
  const auto refuse = [&](const char* what) {
    throw InputError(scene.name, std::string(what) + ": hands lead parts at equilibrium, without contact");
  };
  if (scene.run.time) refuse("a run in time");
  if (!scene.events.empty()) refuse("[[event]]");
  if (scene.run.modes) refuse("[run] modes");
  if (scene.run.buckling) refuse("[run] buckling");
  if (scene.run.renormalise)
    throw InputError(scene.name, "[run] renormalise: a hand keeps the shape with \"Keep the shape\"");
  const simulate::ThermalSettings& thermal = scene.get<simulate::Thermal>();
  if (thermal.expands()) refuse("[thermal] or [shrinkage]");
  if (thermal.conducts()) refuse("a face of conduction of heat");
  if (simulate::settles(scene)) refuse("contact or rigid parts");
  for (const simulate::Tie& tie : scene.get<simulate::Supports>().ties)
    if (tie.link) refuse("a load with a rigid link");
  if (scene.get<simulate::Indenters>().indenters.size() != pushers)
    throw InputError(scene.name, "[[indenter]]: a hand pushes with balls and plates of its own");
}

std::optional<std::array<double, 2>> ways_clear(const Body& body, const simulate::Scene& scene,
                                                const simulate::IndenterShape& shape,
                                                const simulate::IndenterPlace& place, const Vec3& away,
                                                const std::vector<Vec3>& now) {
  const simulate::Problem problem = problem_of(scene, body, simulate::find_fragments(body));
  const std::optional<double> first = way_clear(shape, place, away, problem, now);
  if (!first) return std::nullopt;
  const simulate::IndenterPlace next{place.centre + *first * away, place.normal};
  const std::optional<double> second = way_clear(shape, next, away, problem, problem.settled);
  if (!second) return std::nullopt;
  return std::array{*first, *second};
}

std::string led_through(const Body& body, const simulate::Scene& scene, const std::vector<Vec3>& now) {
  const simulate::Problem problem = problem_of(scene, body, simulate::find_fragments(body));
  const std::optional<simulate::Indenters> indenters =
      simulate::Indenters::make(scene.get<simulate::Indenters>(), problem);
  if (!indenters) return "";
  const std::vector<Vec3> rest =
      problem.settled.empty() ? std::vector<Vec3>(now.size(), Vec3::Zero()) : problem.settled;
  const std::vector<simulate::IndenterPlace> start = indenters->places(0);
  const simulate::State end{now, 1};
  return indenters->gone_through(start, now, end).empty() ? "" : indenters->gone_through(start, rest, end);
}

void refuse_unled(const simulate::Scene& scene, const Body& body, std::size_t pushers) {
  refuse_unled(scene, pushers);
  if (simulate::is_quadratic(scene, body))
    throw InputError(scene.name, "model \"quadratic\": hands lead parts of the other models");
}

PulledBody::~PulledBody() = default;

PulledBody::PulledBody(const Body& body, simulate::Scene scene, std::vector<LedTool> tools, double arm,
                       std::vector<Vec3> start, std::vector<ToolPose> started)
    : body_(body),
      fragments_(simulate::find_fragments(body)),
      problem_((refuse_unled(scene, body, pushers_of(tools)), problem_of(scene, body, fragments_))),
      tools_(std::move(tools)),
      poses_(std::move(started)),
      felt_(tools_.size()),
      answers_(arm),
      rested_(start),
      rested_poses_(poses_) {
  std::vector<simulate::Tie>& ties = scene.get<simulate::Supports>().ties;
  std::vector<simulate::Indenter>& indenters = scene.get<simulate::Indenters>().indenters;
  std::size_t tie = ties.size() - (tools_.size() - indenters.size()), indenter = 0;
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    reaction_.push_back(tools_[t].pushes ? ties.size() + indenter : tie);
    simulate::Motion& motion = tools_[t].pushes ? indenters[indenter++].motion : ties[tie++].motion;
    motion.link = links_.emplace_back(std::make_shared<simulate::RigidLink>());
    motion.link->middle = tools_[t].middle;
  }
  lead_ties(poses_);
  std::vector<simulate::ActiveEffect> effects = active_effects(scene.effects, problem_);
  if (std::vector<FusedPoint> fused = fused_points(body_); !fused.empty())
    effects.push_back(simulate::activate(simulate::FusedPoints(body_, std::move(fused))));
  simulate::refuse_timed(effects, simulate::ActsIn::all, scene.name);
  mechanics_ = std::make_unique<simulate::Mechanics>(problem_, std::move(effects));
  state_.displacement = std::move(start);
  refuse_loose_fragments(fragments_, body_, mechanics_->tied_elements(), mechanics_->coupled_elements(),
                         scene.name);
  refuse_unsupported_elements(*mechanics_, state_, scene.name);
  refuse_free_motions(*mechanics_, state_, scene.name);
}

bool PulledBody::lead(const std::vector<ToolPose>& poses, double tolerance, int iterations,
                      const std::function<void()>& stop) {
  return solve(poses, tolerance, iterations, true, stop) ||
         (!answers_.empty() && solve(poses, tolerance, iterations, false, stop));
}

bool PulledBody::solve(const std::vector<ToolPose>& poses, double tolerance, int iterations, bool predicted,
                       const std::function<void()>& stop) {
  const simulate::Indenters* indenters = simulate::find_indenters(mechanics_->effects());
  const std::vector<simulate::IndenterPlace> places =
      indenters ? indenters->places(state_.share) : std::vector<simulate::IndenterPlace>{};
  lead_ties(poses);
  simulate::State trial = state_;
  if (predicted) answers_.add(way_between(poses_, poses), trial.displacement);
  simulate::NewtonOptions options;
  options.steps = simulate::NewtonSteps::full;
  options.tolerance = tolerance;
  options.max_iterations = iterations;
  // A tool that leaves the part, or comes back to where it began, leaves no force to measure the others by.
  options.least_scale = kLeastScale * strongest_;
  const simulate::State begun = trial;
  const auto asked = [&](double, const std::string&) { stop(); };
  simulate::NewtonOutcome outcome = simulate::newton(*mechanics_, trial, options, asked, &memory_);
  // Where what touches changes a whole step may be no good; the energy tells the way.
  if (!outcome.converged && pushers_of(tools_) > 0) {
    memory_ = {};
    trial = begun;
    options.steps = simulate::NewtonSteps::lowering;
    options.max_iterations = std::max(iterations, kLoweringIterations);
    outcome = simulate::newton(*mechanics_, trial, options, asked, &memory_);
  }
  if (!outcome.converged ||
      (indenters && !indenters->gone_through(places, state_.displacement, trial).empty())) {
    memory_ = {};
    lead_ties(poses_);
    return false;
  }
  // Where nothing acts rounding is all that is out of balance, and all that there is to measure it by.
  accept(std::move(trial), poses, std::min(outcome.relative_residual, tolerance));
  measure(mechanics_->forces(state_).total);
  if (tolerance > kRest) return true;
  rested_ = state_.displacement;
  rested_poses_ = poses_;
  rested_residual_ = residual_;
  return true;
}

bool PulledBody::follow(const std::vector<ToolPose>& poses, double tolerance) {
  if (!memory_.factored || memory_.projected || mechanics_->follows()) return false;
  const simulate::Indenters* indenters = simulate::find_indenters(mechanics_->effects());
  const std::vector<simulate::IndenterPlace> places =
      indenters ? indenters->places(state_.share) : std::vector<simulate::IndenterPlace>{};
  lead_ties(poses);
  simulate::State begun = state_;
  answers_.add(way_between(poses_, poses), begun.displacement);
  apply(mechanics_->constraints(), body_, begun, begun.displacement);
  Iterate at = iterate(std::move(begun));
  bool found = indenters ? improve_touching(at, tolerance) : at.residual <= tolerance;
  for (int step = 0; !indenters && !found && step < kMostSteps && improve(at, tolerance); ++step)
    found = at.residual <= tolerance;
  if (!found || !std::isfinite(mechanics_->energy(at.state)) ||
      (indenters && !indenters->gone_through(places, state_.displacement, at.state).empty())) {
    if (indenters) memory_.model_error = 1;  // the tangent is of nowhere
    lead_ties(poses_);
    return false;
  }
  accept(std::move(at.state), poses, at.residual);
  measure(at.forces.total);
  return true;
}

PulledBody::Iterate PulledBody::iterate(simulate::State state) {
  Iterate at{std::move(state), {}, {}};
  at.forces = mechanics_->forces(at.state);
  at.unbalanced = at.forces.total;
  clear_prescribed(mechanics_->constraints(), at.unbalanced);
  const double scale = std::max(at.forces.scale, kLeastScale * strongest_);
  at.left = std::sqrt(simulate::dot(at.unbalanced, at.unbalanced));
  at.residual = at.left / scale;
  return at;
}

// One step of the linear model, or a new tangent where the old one does not serve any more. False where neither helps.
bool PulledBody::improve(Iterate& at, double tolerance) {
  if (!std::isfinite(at.residual)) return false;
  const double forcing = std::clamp(0.3 * tolerance / at.residual, kLeastForcing, kMostForcing);
  std::vector<Vec3> step;
  const simulate::LinearResult linear = conjugate_gradients(mechanics_->whole_tangent(), at.unbalanced, step,
                                                            *memory_.preconditioner, forcing, kMostGradients);
  if (linear.indefinite) return false;
  simulate::State moved = at.state;
  parallel_for_each(step.size(), [&](std::size_t e) { moved.displacement[e] += step[e]; });
  Iterate next = iterate(std::move(moved));
  if (next.residual <= tolerance || next.left <= kServes * at.left)
    at = std::move(next);
  else
    renew_tangent(at.state);
  return true;
}

// One step where tools push. What touches changes from step to step, so what the tools add to the tangent is made anew at
// each, the rest seldom; how far it goes the energy tells, for the forces that are left rise where more points touch. Forces
// on points that are hardly inside go by the square of the depth, and Newton's step gets them half the way out: far from the
// solution twice the step is tried too. Gives how far it went; 0: no step lowers the energy.
double PulledBody::touch(Iterate& at, bool renew) {
  if (!std::isfinite(at.residual)) return 0;
  if (renew || !mechanics_->renew_effects(at.state))
    renew_tangent(at.state);
  else
    memory_.preconditioner->refresh_smoother();
  memory_.stale = true;
  std::vector<Vec3> way;
  const simulate::LinearResult linear =
      conjugate_gradients(mechanics_->whole_tangent(), at.unbalanced, way, *memory_.preconditioner,
                          kTouchingForcing, kTouchingGradients);
  if (linear.indefinite) return 0;
  const auto moved = [&](double share) {
    simulate::State state = at.state;
    parallel_for_each(way.size(), [&](std::size_t e) { state.displacement[e] += share * way[e]; });
    return state;
  };
  const double before = mechanics_->energy(at.state), falls = simulate::dot(at.unbalanced, way);
  double share = 1, energy = mechanics_->energy(moved(share));
  while (!(energy <= before - kArmijo * share * falls)) {
    if ((share /= 4) < kShortestStep) return 0;
    energy = mechanics_->energy(moved(share));
  }
  if (share == 1 && at.residual > kFar && mechanics_->energy(moved(2)) < energy) share = 2;
  at = iterate(moved(share));
  return share;
}

// A tangent none of whose steps serves is of another shape.
bool PulledBody::improve_touching(Iterate& at, double tolerance) {
  bool renew = false;
  for (int step = 1; at.residual > tolerance && step <= kMostTouchingSteps; ++step) {
    const double share = touch(at, renew || step % kStepsOfATangent == 0);
    if (share == 0 && renew) return false;
    renew = share == 0;
  }
  return at.residual <= tolerance;
}

void PulledBody::renew_tangent(const simulate::State& state) {
  mechanics_->assemble(state, {});
  mechanics_->eliminate_prescribed();
  memory_.preconditioner->refresh_smoother();
  memory_.stale = true;
}

void PulledBody::accept(simulate::State state, const std::vector<ToolPose>& poses, double residual) {
  answers_.learn(way_between(poses_, poses), state_.displacement, state.displacement);
  state_ = std::move(state);
  poses_ = poses;
  residual_ = residual;
}

void PulledBody::retreat() {
  state_.displacement = rested_;
  poses_ = rested_poses_;
  residual_ = rested_residual_;
  memory_ = {};
  lead_ties(poses_);
  measure(mechanics_->forces(state_).total);
}

// Ties and indenters hold the links, at the load's whole share.
void PulledBody::lead_ties(const std::vector<ToolPose>& poses) {
  for (std::size_t t = 0; t < poses.size(); ++t) {
    links_[t]->translation = poses[t].displacement;
    links_[t]->turn = poses[t].turn;
  }
}

// `unbalanced`: all forces on the elements [N], those on prescribed components too.
void PulledBody::measure(const std::vector<Vec3>& unbalanced) {
  simulate::SimulateResult found;
  for (const simulate::ActiveEffect& effect : mechanics_->effects())
    effect->report(state_, unbalanced, found);
  for (std::size_t t = 0; t < felt_.size(); ++t) {
    const simulate::Reaction& reaction = found.reactions[reaction_[t]];
    const Vec3 middle = tools_[t].middle + poses_[t].displacement;
    felt_[t].force = -reaction.force;
    strongest_ = std::max(strongest_, reaction.force.norm());
    felt_[t].torque = -(reaction.moment - middle.cross(reaction.force));
  }
}

std::vector<Vec3> PulledBody::whole_displacement() const {
  simulate::State state = state_;
  carry_strays(fragments_, problem_, mechanics_->stencil(), state);
  return state.displacement;
}

void PulledBody::renormalise(Body& body) const {
  simulate::renormalise_all(body, problem_, whole_displacement());
}

}  // namespace flexel::clay
