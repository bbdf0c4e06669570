// The whole load is tried at once (or in the steps that the scene asks for), with full Newton steps. A load
// step that fails is halved and tried again from the last equilibrium; from a thirty-second on it is tried
// with steps that lower the energy too, which also pass a buckling or a snap. An easy one lets the next be
// twice as long, later each time that this was in vain (load_step_length.h). The Newton iterations of a run are
// bounded: a scene without an equilibrium ends in the time of some hundred linear solutions.
//
// A rotation is followed along its arc, a quarter of a turn a load step at most: further on the straight way
// to its end is none, and a whole turn would end where it began. Where the load steps shrink to nothing
// though the forces are all but balanced, the part buckles, and symmetry keeps Newton's method on the branch
// that is not stable any more. There a small, smooth push to a side starts steps that lower the energy; what
// they end in is an equilibrium like any other, without the push.
#include "simulate/equilibrium/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/human.h"
#include "base/math/eigenvalues.h"
#include "base/program/progress_stretch.h"
#include "base/program/share_scope.h"
#include "base/stop.h"
#include "base/units.h"
#include "simulate/equilibrium/load_step_length.h"
#include "simulate/equilibrium/rigid_link_equilibrium.h"
#include "simulate/indent/indenters.h"
#include "simulate/input/scene_words.h"
#include "simulate/models/rest_shape.h"
#include "simulate/result/overload.h"
#include "simulate/result/result.h"

namespace flexel::simulate {
namespace {

constexpr double kSmallestIncrement = 1.0 / 1024;  // of the first load step
constexpr double kLoweringIncrement = 1.0 / 32;    // from this one on energy-lowering steps are tried too
constexpr int kEasyIterations = 10;
constexpr int kFullStepIterations = 20;
constexpr int kIterations = 100;                // of Newton in a run, unless the scene says
constexpr int kIndentedIterations = 300;        // likewise with indenters: some attempts go through them
constexpr int kOverloadIterations = 40;         // likewise where the load is out of proportion
constexpr int kIterationsPerLoadStep = 10;      // that one which ends in equilibrium adds to those of the run
constexpr int kIterationsPerIndentedStep = 40;  // likewise, with indenters
constexpr double kLargestTurn = 0.25;           // turns, of a rotation in one load step
constexpr double kBalanced = 1e-2;              // relative residual of an attempt that fails as buckling does
constexpr double kPush = 0.01;                  // of the spacing, to leave a branch with
constexpr double kPushedIncrement = 0.25;       // of the first load step: how far beyond the branching
constexpr int kPushedIterations = 300;
constexpr int kMostPushes = 4;         // of a run
constexpr double kUnsupported = 1e-9;  // of the stiffness of an element in its stiffest direction
constexpr double kStarted = 0.4;   // share of the run's time until a start from a coarser lattice is found
constexpr double kFarReach = 0.1;  // diagonals: a first linear answer beyond this makes a start elsewhere pay
constexpr double kOverload = 3;    // diagonals: a first linear answer beyond this suggests a wrong unit
// ... and one beyond this many diagonals, or times the way that moves lead, is one. A strip rolled up by two
// turns is at 6; a foil that membrane forces hold may be further, and can be asked for by load steps.
constexpr double kOutOfProportion = 30;

std::string point_name(const Vec3& at) {
  return fmt::format("({}, {}, {})", human_length(at.x()), human_length(at.y()), human_length(at.z()));
}

// Load steps that follow every rotation along its arc, and lead no indenter too far.
int least_load_steps(const Mechanics& mechanics) {
  double steps = 1;
  for (const Motion& motion : mechanics.constraints().motions)
    steps = std::max(steps, std::abs(motion.angle) / (2 * std::numbers::pi) / kLargestTurn);
  if (const Indenters* indenters = find_indenters(mechanics.effects()))
    steps = std::max(steps, 1 / indenters->longest_share());
  return static_cast<int>(std::ceil(steps - 1e-9));
}

std::vector<RigidLink> links_now(const Constraints& constraints) {
  std::vector<RigidLink> links;
  for (const Motion& motion : constraints.motions)
    if (motion.link) links.push_back(*motion.link);
  return links;
}

void restore_followers(Mechanics& mechanics, const FollowerMemory& memory) {
  std::size_t next = 0;
  for (const ActiveEffect& effect : mechanics.effects())
    if (effect->follows() && next < memory.size()) effect->restore(memory[next++]);
}

// A run over load steps.
class LoadStepping {
 public:
  LoadStepping(Mechanics& mechanics, State& state, const RunSettings& settings, Progress& progress,
               const CoarseStart& start, const LoadStepHooks* hooks)
      : mechanics_(mechanics),
        state_(state),
        settings_(settings),
        progress_(progress),
        start_(start),
        hooks_(hooks),
        first_(1.0 / std::max(settings.load_steps, least_load_steps(mechanics))),
        length_(first_) {
    indented_ = find_indenters(mechanics.effects()) != nullptr;
    if (hooks && hooks->make_solver) solver_ = hooks->make_solver(mechanics);
    if (!hooks || !hooks->begin) return;
    done_ = hooks->begin->share;
    reach_ = hooks->begin->reach;
    state_.displacement = hooks->begin->displacement;
    state_.share = done_;
  }

  EquilibriumResult operator()();

 private:
  void solve();
  // Tries the next share; true and moved on when it converged.
  bool attempt(NewtonSteps steps, int max_iterations);
  // Where the part has gone through an indenter, what was found is none.
  void refuse_gone_through(const std::vector<RigidLink>& links_before);
  [[nodiscard]] bool gives_up() const {
    return length_.get() <= kSmallestIncrement * first_ || iterations_left() <= 0;
  }
  // After an attempt: where its linear answer reached too far, tries the whole load from what `start_` gives.
  // True where the whole load is still to be tried, or done.
  bool begin_near();
  // Tries to leave a branch that is not stable beyond what is done; true and moved on when it was left.
  bool branch_off();
  void push(State& state) const;
  [[nodiscard]] bool overloaded() const {
    return reach_ > (mechanics_.follows() ? kOutOfProportion : kOverload) *
                        bounding_box(mechanics_.body().rest).diagonal();
  }
  [[nodiscard]] int iterations_left() const;
  // Beyond this only a mistake puts the first linear answer [m]; infinite where the scene says how to go on.
  [[nodiscard]] double out_of_proportion() const;
  [[noreturn]] void refuse_load() const;
  [[noreturn]] void diverge() const;

  Mechanics& mechanics_;
  State& state_;
  const RunSettings& settings_;
  Progress& progress_;
  const CoarseStart& start_;
  const LoadStepHooks* hooks_;  // may be null
  LoadStepSolver solver_;       // empty: newton_with_links()
  double first_;                // share of the load: the first step; none is longer
  LoadStepLength length_;
  double done_ = 0;                  // share of the load
  double begun_ = kBeforeFirstStep;  // share of the run's time that its start takes
  EquilibriumResult result_;
  State trial_;  // of the last attempt
  NewtonOutcome outcome_;
  double farthest_reach_ = std::numeric_limits<double>::infinity();  // m, of an attempt's linear answer
  double hopeless_reach_ = std::numeric_limits<double>::infinity();  // m, likewise, for the whole load
  double reach_ = 0;               // m: of the first linear answer, for the whole load
  std::optional<NearStart> near_;  // where the next attempt starts in place of `state_`
  int spent_near_ = 0;             // iterations of an attempt from there that came to nothing
  bool pushed_ = false;            // the next attempt starts beside the last equilibrium
  int pushes_ = 0;
  double least_residual_ = 1;  // relative, of the attempts since the last equilibrium
  bool indented_ = false;  // a whole step is no good where what touches changes, and the energy tells the way
  bool lowers_ = false;    // ... and one has not been
  bool gone_through_ = false;  // the last attempt led the part through one: so will other steps as long
};

int LoadStepping::iterations_left() const {
  const int usual = indented_ ? kIndentedIterations : kIterations;
  const int allowed = settings_.newton_iterations.value_or(overloaded() ? kOverloadIterations : usual);
  const int more = indented_ ? kIterationsPerIndentedStep : kIterationsPerLoadStep;
  return allowed + more * result_.load_steps + kPushedIterations * pushes_ + spent_near_ -
         result_.newton_iterations;
}

double LoadStepping::out_of_proportion() const {
  if (settings_.load_steps > 1 || settings_.newton_iterations) return std::numeric_limits<double>::infinity();
  State whole = state_;
  whole.share = 1;
  apply(mechanics_.constraints(), mechanics_.body(), whole, whole.displacement);
  double largest = bounding_box(mechanics_.body().rest).diagonal();
  for (const Vec3& moved : whole.displacement) largest = std::max(largest, moved.norm());
  return kOutOfProportion * largest;
}

void LoadStepping::refuse_load() const {
  SimulateResult told;
  mechanics_.report(trial_, told);
  double force = 0;
  for (const AppliedLoad& load : told.loads) force += load.force.norm();
  std::vector<std::string> materials;
  for (const Part& part : mechanics_.body().parts)
    if (std::find(materials.begin(), materials.end(), part.material) == materials.end())
      materials.push_back(part.material);
  const double diagonal = bounding_box(mechanics_.body().rest).diagonal();
  throw OverloadError(fmt::format(
      "the load{} would move the part by {} at its first stiffness, {} times its size of {}: check the unit "
      "of "
      "the part (--unit), the load, and the stiffness of {}; in a scene, [run] load_steps = 10 tries it all "
      "the same",
      force > 0 ? fmt::format(" ({} in all)", human_force(force)) : "", human_length(reach_),
      human_count(static_cast<std::size_t>(std::min(reach_ / diagonal, 1e15))), human_length(diagonal),
      fmt::join(materials, ", ")));
}

bool LoadStepping::attempt(NewtonSteps steps, int max_iterations) {
  const double next = done_ + length_.get() > 1 - 1e-9 ? 1 : done_ + length_.get();
  NewtonOptions options;
  options.steps = steps;
  options.tolerance = settings_.tolerance;
  options.max_iterations = std::min(max_iterations, iterations_left());
  options.farthest_reach = std::min(farthest_reach_, hopeless_reach_ * next);
  trial_ = state_;
  if (near_) trial_.displacement = near_->displacement;
  trial_.share = next;
  if (pushed_) push(trial_);
  std::optional<ShareScope> preparing;
  if (reach_ == 0) preparing.emplace(progress_, kBeforeSearch, kBeforeFirstStep, "preparing");
  const std::vector<RigidLink> links = links_now(mechanics_.constraints());
  double most_gone = 0;  // a residual may rise again
  const NewtonProgress tell = [&](double gone, const std::string& note) {
    check_stop();
    preparing.reset();
    most_gone = std::max(most_gone, gone);
    progress_.update(begun_ + (1 - begun_) * (done_ + most_gone * (trial_.share - done_)),
                     fmt::format("load {:.3g} %, {}", 100 * trial_.share, note));
  };
  outcome_ = solver_ ? solver_(trial_, options, tell) : newton_with_links(mechanics_, trial_, options, tell);
  if (reach_ == 0) reach_ = outcome_.first_reach / trial_.share;  // from rest: a near start moves by less
  result_.newton_iterations += outcome_.iterations;
  result_.cg_iterations += outcome_.cg_iterations;
  result_.linear_seconds += outcome_.linear_seconds;
  refuse_gone_through(links);
  least_residual_ = outcome_.converged ? 1 : std::min(least_residual_, outcome_.relative_residual);
  if (!outcome_.converged) return false;
  done_ = trial_.share;
  state_ = trial_;
  if (near_) restore_followers(mechanics_, near_->followers);
  for (const ActiveEffect& effect : mechanics_.effects()) effect->accept(state_);
  ++result_.load_steps;
  result_.relative_residual = outcome_.relative_residual;
  if (hooks_ && hooks_->done) hooks_->done({done_, reach_, state_.displacement});
  length_.succeeded(outcome_.iterations <= kEasyIterations);
  return true;
}

void LoadStepping::refuse_gone_through(const std::vector<RigidLink>& links_before) {
  gone_through_ = false;
  const Indenters* indenters = find_indenters(mechanics_.effects());
  if (!outcome_.converged || !indenters) return;
  const std::string name = indenters->gone_through(indenters->places(done_), state_.displacement, trial_);
  gone_through_ = !name.empty();
  if (!gone_through_) return;
  outcome_.converged = false;
  outcome_.relative_residual = 1;
  outcome_.trouble = fmt::format("the part goes through indenter \"{}\"", name);
  auto link = links_before.begin();
  for (const Motion& motion : mechanics_.constraints().motions)
    if (motion.link) *motion.link = *link++;
}

// What a torque does that goes on turning what it acts on, at a state in equilibrium; "" where none turns it
// far. Its forces keep their direction, so past a right angle they turn nothing.
std::string said_of_dead_torques(Mechanics& mechanics, const State& state) {
  constexpr double kFar = 10 * std::numbers::pi / 180;
  SimulateResult told;
  mechanics.report(state, told);
  for (const AppliedLoad& load : told.loads)
    if (load.rotation && !load.displacement && !load.follower && load.rotation->norm() > kFar)
      return fmt::format(
          "; the forces of load \"{}\" keep the direction that they have at rest: follower = true in its "
          "[[load]] (\"..., follower\" in --torque) turns them with what they act on",
          load.name);
  return "";
}

void LoadStepping::diverge() const {
  const MostCompressed worst = mechanics_.most_compressed(trial_);
  const Body& body = mechanics_.body();
  const std::string limit =
      iterations_left() <= 0
          ? fmt::format(" within {} Newton iterations ([run] newton_iterations)", result_.newton_iterations)
          : "";
  const double diagonal = bounding_box(body.rest).diagonal();
  const std::string advice =
      overloaded()
          ? fmt::format(
                "At its first stiffness the load would move the part by {}, {} times its size: "
                "check the unit of the part and the load",
                human_length(reach_), human_number(reach_ / diagonal, 2))
          : "Use a smaller load or move, a smaller spacing or a stiffer material; a part that buckles or "
            "snaps through has no equilibrium nearby";
  throw DivergedError(fmt::format(
      "no equilibrium beyond {:.4g} % of the load{} (tried {:.4g} %): {}; most compressed "
      "is {} near {} of part \"{}\" with J = {:.3g}. {}{}",
      100 * done_, limit, 100 * trial_.share, outcome_.trouble, worst.name, point_name(worst.rest),
      body.parts[worst.part].name, worst.value, advice, said_of_dead_torques(mechanics_, state_)));
}

// Linear over the body, in directions that no symmetry of a part is likely to have.
void LoadStepping::push(State& state) const {
  const Body& body = mechanics_.body();
  const Box box = bounding_box(body.rest);
  const Vec3 middle = 0.5 * (box.min + box.max), half = 0.5 * (box.max - box.min).cwiseMax(1e-300);
  const std::vector<std::uint32_t> part = element_parts(body);
  const Constraints& constraints = mechanics_.constraints();
  Mat3 slope;
  slope << 0.2, 0.5, -0.7, -0.3, 0.1, 0.6, 0.4, -0.6, 0.3;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const Vec3 at = (body.rest[e] - middle).cwiseQuotient(half);
    const Vec3 way = Vec3(0.6, 0.7, 0.4) + slope * at;
    for (int axis = 0; axis < 3; ++axis)
      if (!(constraints.mask[e] >> axis & 1))
        state.displacement[e][axis] += kPush * body.parts[part[e]].lattice.spacing.mean() * way[axis];
  }
}

bool LoadStepping::branch_off() {
  if (!(done_ > 0) || overloaded() || mechanics_.follows() || least_residual_ > kBalanced ||
      pushes_ == kMostPushes)
    return false;
  ++pushes_;
  result_.buckled = true;
  const double from = done_;
  length_.set(kPushedIncrement * first_);
  pushed_ = true;
  const bool left = attempt(NewtonSteps::lowering, kPushedIterations);
  pushed_ = false;
  if (left)
    progress_.warn(
        fmt::format("the part buckles at {:.4g} % of the load; beyond it, one of several shapes "
                    "that it may take",
                    100 * from));
  return left;
}

bool LoadStepping::begin_near() {
  const bool far = outcome_.first_reach > farthest_reach_;
  farthest_reach_ = std::numeric_limits<double>::infinity();
  if (!far) return false;
  if (!overloaded()) {
    ProgressStretch stretch(progress_, kBeforeFirstStep, kStarted);
    near_ = start_(stretch.inner());
    begun_ = kStarted;
  }
  const int before = result_.newton_iterations;
  if (near_ && !attempt(NewtonSteps::full, kFullStepIterations))
    spent_near_ = result_.newton_iterations - before;
  near_.reset();
  return true;
}

EquilibriumResult LoadStepping::operator()() {
  try {
    solve();
  } catch (const TimeoutError& error) {
    throw TimeoutError(fmt::format("{} in equilibrium with {:.4g} % of the load, {} Newton iterations",
                                   error.what(), 100 * done_, result_.newton_iterations));
  }
  result_.linear_reach = reach_;
  return result_;
}

void LoadStepping::solve() {
  const std::vector<Motion>& motions = mechanics_.constraints().motions;
  const bool linked = std::any_of(motions.begin(), motions.end(),
                                  [](const Motion& motion) { return motion.link != nullptr; });
  if (start_ && first_ == 1 && !linked)
    farthest_reach_ = kFarReach * bounding_box(mechanics_.body().rest).diagonal();
  hopeless_reach_ = out_of_proportion();
  while (done_ < 1) {
    gone_through_ = false;
    if (!lowers_ && attempt(NewtonSteps::full, kFullStepIterations)) continue;
    if (reach_ > hopeless_reach_) refuse_load();
    hopeless_reach_ = std::numeric_limits<double>::infinity();  // the first answer alone counts
    if (begin_near()) continue;
    if (iterations_left() > 0 && !gone_through_ &&
        (indented_ || length_.get() <= kLoweringIncrement * first_) && !mechanics_.follows() &&
        attempt(NewtonSteps::lowering, NewtonOptions().max_iterations)) {
      lowers_ = indented_;
      continue;
    }
    if (!gives_up()) {
      length_.failed(trial_.share - done_);
      // a part that rolls up turns as far with each step of the load
      if (mechanics_.follows()) length_.stop_growing();
    } else if (!branch_off()) {
      diverge();
    }
  }
}

}  // namespace

std::shared_ptr<const LoadStepHooks> hooks_on_coarser(const std::shared_ptr<const LoadStepHooks>& hooks) {
  if (!hooks) return nullptr;
  return std::make_shared<const LoadStepHooks>(LoadStepHooks{hooks->make_solver, {}, {}});
}

FollowerMemory follower_memory(const Mechanics& mechanics) {
  FollowerMemory memory;
  for (const ActiveEffect& effect : mechanics.effects())
    if (effect->follows()) memory.push_back(effect->memory());
  return memory;
}

void refuse_free_motions(Mechanics& mechanics, const State& start, const std::string& scene) {
  // Without the stresses that a rest shape gives the body where it starts: what they do to a motion as a whole
  // says nothing of what holds it.
  const bool stressed = RestShapes(mechanics.body()).any();
  const std::vector<Mat3> none(stressed ? mechanics.body().cell_count() : 0, Mat3::Zero());
  // Indenters hold nothing: they are taken where they begin.
  State begun = start;
  begun.share = 0;
  mechanics.assemble(begun, {false, stressed ? &none : nullptr});
  mechanics.eliminate_prescribed();
  const std::vector<FreeMotion> free =
      free_motions(mechanics.tangent(), node_geometry(mechanics.body(), start));
  if (free.empty()) return;
  std::vector<std::string> names;
  for (const FreeMotion& motion : free) {
    const std::string name = "to " + motion_name(motion);
    if (motion.part == free.front().part && std::find(names.begin(), names.end(), name) == names.end())
      names.push_back(name);
  }
  throw InputError(scene, fmt::format("part \"{}\" is free {}: add {} that stops it",
                                      mechanics.body().parts[free.front().part].name,
                                      fmt::join(names, " and "), words_of(scene).a_fix));
}

void refuse_unsupported_elements(Mechanics& mechanics, const State& start, const std::string& scene) {
  const Body& body = mechanics.body();
  const std::vector<std::uint8_t>& active = mechanics.paper().active();
  if (std::find(active.begin(), active.end(), 1) == active.end()) return;
  mechanics.assemble(start);
  mechanics.eliminate_prescribed();
  const BlockMatrix& matrix = mechanics.stiffness();
  std::size_t count = 0;
  std::uint32_t first = 0;
  for (std::uint32_t e = 0; e < body.element_count(); ++e) {
    if (!active[e]) continue;
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(matrix.values[diagonal_position(matrix, e)]),
                                                    Eigen::EigenvaluesOnly);
    if (eigen.eigenvalues()[0] > kUnsupported * eigen.eigenvalues()[2]) continue;
    if (count++ == 0) first = e;
  }
  if (count == 0) return;
  throw InputError(
      scene,
      fmt::format("part \"{}\": the connections of {} element(s), the first near {}, lie in one plane, "
                  "and nothing resists across it; model \"paper\" needs two elements through every "
                  "wall: use a smaller spacing, or voxelize with --placement corner",
                  body.parts[element_parts(body)[first]].name, human_count(count),
                  point_name(body.rest[first])));
}

double linear_reach_beside_free_strain(Mechanics& mechanics) {
  const std::vector<ActiveEffect>& effects = mechanics.effects();
  const std::vector<Motion>& motions = mechanics.constraints().motions;
  if (mechanics.follows() ||
      std::none_of(effects.begin(), effects.end(),
                   [](const ActiveEffect& effect) { return effect->drives(); }) ||
      std::any_of(motions.begin(), motions.end(),
                  [](const Motion& motion) { return motion.link != nullptr; }))
    return 0;
  NewtonOptions options;
  options.steps = NewtonSteps::full;
  options.max_iterations = 1;
  options.unstressed = true;
  State rest{std::vector<Vec3>(mechanics.body().element_count(), Vec3::Zero()), 1};
  return newton(mechanics, rest, options, [](double, const std::string&) { check_stop(); }).first_reach;
}

EquilibriumResult find_equilibrium(Mechanics& mechanics, State& state, const RunSettings& settings,
                                   Progress& progress, const CoarseStart& start, const LoadStepHooks* hooks) {
  return LoadStepping(mechanics, state, settings, progress, start, hooks)();
}

}  // namespace flexel::simulate
