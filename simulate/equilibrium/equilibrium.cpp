// The whole load is tried at once (or in the steps that the scene asks for), with full Newton steps. A load
// step that fails is halved and tried again from the last equilibrium; from a thirty-second on it is tried
// with steps that lower the energy too, which also pass a buckling or a snap. An easy one lets the next be
// twice as long, later each time that this was in vain (load_step_length.h). The Newton iterations of a run are
// bounded: a scene without an equilibrium ends in the time of some hundred linear solutions.
//
// A rotation is followed along its arc, an eighth of a turn a load step at most: further on the straight way
// to its end is none, and a whole turn would end where it began. Where the load steps shrink to nothing
// though the forces are all but balanced, the part buckles, and symmetry keeps Newton's method on the branch
// that is not stable any more. There a small, smooth push to a side starts steps that lower the energy; what
// they end in is an equilibrium like any other, without the push.
//
// Free strain acts whole in every load step. Where the first attempt fails, the run begins again with free strain
// that grows with the load, by full steps down to a thirty-second. Where that comes to a bifurcation, it begins for
// the last time, whole: so a part that heat would buckle keeps to its branch, and the caller warns of it.
#include "simulate/equilibrium/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/human.h"
#include "base/math/eigenvalues.h"
#include "base/program/progress_stretch.h"
#include "base/program/share_scope.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/equilibrium/load_step_length.h"
#include "simulate/equilibrium/rigid_link_equilibrium.h"
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
constexpr int kIterations = 100;            // of Newton in a run, unless the scene says
constexpr int kTimesWithLinks = 7;          // of those with rigid links
constexpr int kUnilateralIterations = 300;  // likewise where surfaces touch: some attempts go through
constexpr int kOverloadIterations = 40;     // likewise where the load is out of proportion
constexpr int kIterationsPerLoadStep = 10;  // that one which ends in equilibrium adds to those of the run
constexpr int kIterationsPerUnilateralStep = 40;  // likewise, where surfaces touch
constexpr double kLargestTurn = 0.125;            // turns, of a rotation in one load step
constexpr double kBalanced = 1e-2;         // relative residual of an attempt that fails as buckling does
constexpr double kPush = 0.01;             // of the spacing, to leave a branch with
constexpr double kPushedIncrement = 0.25;  // of the first load step: how far beyond the branching
constexpr int kPushedIterations = 300;
constexpr int kMostPushes = 4;         // of a run
constexpr double kUnsupported = 1e-9;  // of the stiffness of an element in its stiffest direction
constexpr double kSmallShare = 1e-3;   // of load and free strain: all goes in proportion
constexpr double kStarted = 0.4;   // share of the run's time until a start from a coarser lattice is found
constexpr double kFarReach = 0.1;  // diagonals: a first linear answer beyond this makes a start elsewhere pay
constexpr double kOverload = 3;    // diagonals: a first linear answer beyond this suggests a wrong unit
// ... and one beyond this many diagonals, or times the way that moves lead, is one. A strip rolled up by two
// turns is at 6; a foil that membrane forces hold may be further, and can be asked for by load steps.
constexpr double kOutOfProportion = 30;

std::string point_name(const Vec3& at) {
  return fmt::format("({}, {}, {})", human_length(at.x()), human_length(at.y()), human_length(at.z()));
}

// Load steps that follow every rotation along its arc, and are short enough for every effect.
int least_load_steps(const Mechanics& mechanics) {
  double steps = 1;
  for (const Motion& motion : mechanics.constraints().motions)
    steps = std::max(steps, std::abs(motion.angle) / (2 * std::numbers::pi) / kLargestTurn);
  for (const ActiveEffect& effect : mechanics.effects())
    steps = std::max(steps, 1 / effect->longest_load_step());
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

// What a run begins from, once more where free strain is to act otherwise.
struct RunBeginning {
  std::vector<Vec3> displacement;  // m (elements)
  FollowerMemory followers;
  std::vector<RigidLink> links;
};

// How free strain acts in the load steps.
enum class FreeStrainMode { whole, growing, whole_again };

void restore_links(const Constraints& constraints, const std::vector<RigidLink>& links) {
  auto link = links.begin();
  for (const Motion& motion : constraints.motions)
    if (motion.link) *motion.link = *link++;
}

// m: how far linear answers reach.
struct LinearReach {
  double farthest = std::numeric_limits<double>::infinity();  // of an attempt
  double hopeless = std::numeric_limits<double>::infinity();  // likewise, for the whole load
  double first = 0;                                           // the first one, for the whole load
};

// A run over load steps.
class LoadStepping {
 public:
  LoadStepping(Mechanics& mechanics, State& state, const RunSettings& settings, Progress& progress,
               const CoarseStart& start, const LoadStepHooks* hooks, const LoadStepSolver& solver)
      : mechanics_(mechanics),
        state_(state),
        settings_(settings),
        progress_(progress),
        start_(start),
        hooks_(hooks),
        solver_(solver),
        beginning_{state.displacement, follower_memory(mechanics), links_now(mechanics.constraints())},
        first_(1.0 / std::max(settings.load_steps, least_load_steps(mechanics))),
        length_(first_),
        unilateral_(mechanics.unilateral()) {
    if (!hooks || !hooks->begin) return;
    done_ = hooks->begin->share;
    reach_.first = hooks->begin->reach;
    result_.relative_residual = hooks->begin->residual;
    result_.buckled = hooks->begin->buckled;
    if (result_.buckled)
      progress_.warn(
          "the part buckled before the load step that this run goes on from; beyond it, one of several "
          "shapes that it may take");
    state_.displacement = hooks->begin->displacement;
    state_.share = done_;
  }

  EquilibriumResult operator()();

 private:
  void solve();
  // Tries the next share; true and moved on when it converged.
  bool attempt(NewtonSteps steps, int max_iterations);
  // What was found is no equilibrium where an effect refuses the way to it.
  void refuse_way(const std::vector<RigidLink>& links_before);
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
    return reach_.first >
           (mechanics_.follows() ? kOutOfProportion : kOverload) * whole_box(mechanics_.body()).diagonal();
  }
  // After an attempt: begins again with free strain in the next mode, where its time has come.
  bool change_free_strain();
  void begin_again(FreeStrainMode mode);
  // Followers and links as at the beginning, and free strain that grows or acts whole.
  void begin_as(bool growing);
  // m: the largest displacement in proportion to loads and free strain, without the stresses that hindered free strain
  // makes: they stiffen or soften the first answer, which says nothing of buckling then. 0: nothing to say.
  double reach_beside_free_strain();
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
  const LoadStepHooks* hooks_;    // may be null
  const LoadStepSolver& solver_;  // empty: newton_with_links()
  const RunBeginning beginning_;
  double first_;  // share of the load: the first step; none is longer
  LoadStepLength length_;
  double done_ = 0;                  // share of the load
  double begun_ = kBeforeFirstStep;  // share of the run's time that its start takes
  EquilibriumResult result_;
  State trial_;  // of the last attempt
  NewtonOutcome outcome_;
  LinearReach reach_;
  std::optional<NearStart> near_;  // where the next attempt starts in place of `state_`
  int spent_ = 0;  // iterations from there, or in earlier modes of free strain, that came to nothing
  FreeStrainMode free_strain_ = FreeStrainMode::whole;
  bool pushed_ = false;  // the next attempt starts beside the last equilibrium
  int pushes_ = 0;
  double least_residual_ = 1;  // relative, of the attempts since the last equilibrium
  bool unilateral_;       // a whole step is no good where what touches changes, and the energy tells the way
  bool lowers_ = false;   // ... and one has not been
  bool refused_ = false;  // the last attempt, by an effect: so will other steps as long be
};

int LoadStepping::iterations_left() const {
  const int usual = unilateral_ ? kUnilateralIterations : kIterations;
  const bool linked = !links_now(mechanics_.constraints()).empty();  // each of their steps is an equilibrium
  const int allowed = settings_.newton_iterations.value_or((linked ? kTimesWithLinks : 1) *
                                                           (overloaded() ? kOverloadIterations : usual));
  const int more = unilateral_ ? kIterationsPerUnilateralStep : kIterationsPerLoadStep;
  return allowed + more * result_.load_steps + kPushedIterations * pushes_ + spent_ -
         result_.newton_iterations;
}

double LoadStepping::out_of_proportion() const {
  if (settings_.load_steps > 1 || settings_.newton_iterations) return std::numeric_limits<double>::infinity();
  State whole = state_;
  whole.share = 1;
  apply(mechanics_.constraints(), mechanics_.body(), whole, whole.displacement);
  double largest = whole_box(mechanics_.body()).diagonal();
  for (const Vec3& moved : whole.displacement) largest = std::max(largest, moved.norm());
  if (other_pieces()) (void)other_pieces()->take_of_largest(largest, std::span(&largest, 1));
  return kOutOfProportion * largest;
}

void LoadStepping::refuse_load() const {
  SimulateResult told;
  mechanics_.report(trial_, told);
  constexpr double kCouple = 1e-6;  // of a moment over the size: what rounding leaves of a couple's force
  const double diagonal = whole_box(mechanics_.body()).diagonal();
  double force = 0, moment = 0;
  for (const AppliedLoad& load : told.loads) {
    force += load.force.norm();
    moment += load.moment.norm();
  }
  const std::string in_all = force * diagonal > kCouple * moment ? human_force(force)
                             : moment > 0                        ? human_number(moment) + " N m"
                                                                 : "";
  std::vector<std::string> materials;
  for (const Part& part : mechanics_.body().parts)
    if (std::find(materials.begin(), materials.end(), part.material) == materials.end())
      materials.push_back(part.material);
  throw OverloadError(fmt::format(
      "the load{} would move the part by {} at its first stiffness, {} times its size of {}: check the unit "
      "of "
      "the part (--unit), the load, and the stiffness of {}; in a scene, [run] load_steps = 10 tries it all "
      "the same",
      in_all.empty() ? "" : fmt::format(" ({} in all)", in_all), human_length(reach_.first),
      human_count(static_cast<std::size_t>(std::min(reach_.first / diagonal, 1e15))), human_length(diagonal),
      fmt::join(materials, ", ")));
}

bool LoadStepping::attempt(NewtonSteps steps, int max_iterations) {
  const double next = done_ + length_.get() > 1 - 1e-9 ? 1 : done_ + length_.get();
  NewtonOptions options;
  options.steps = steps;
  options.tolerance = settings_.tolerance;
  options.max_iterations = std::min(max_iterations, iterations_left());
  options.farthest_reach = std::min(reach_.farthest, reach_.hopeless * next);
  trial_ = state_;
  if (near_) trial_.displacement = near_->displacement;
  trial_.share = next;
  if (pushed_) push(trial_);
  std::optional<ShareScope> preparing;
  const bool first = reach_.first == 0 && done_ == 0;
  if (first) preparing.emplace(progress_, kBeforeSearch, kBeforeFirstStep, "preparing");
  const std::vector<RigidLink> links = links_now(mechanics_.constraints());
  double most_gone = 0;  // a residual may rise again
  const NewtonProgress tell = [&](double gone, const std::string& note) {
    check_stop();
    preparing.reset();
    most_gone = std::max(most_gone, gone);
    progress_.update(begun_ + (1 - begun_) * (done_ + most_gone * (trial_.share - done_)),
                     fmt::format("load {:.3g} %, {}", 100 * trial_.share, note));
  };
  result_.preconditioner.reset();
  NewtonMemory memory;
  outcome_ = solver_ ? solver_(trial_, options, tell)
                     : newton_with_links(mechanics_, trial_, options, tell, &memory);
  result_.preconditioner = std::move(memory.preconditioner);
  if (first) reach_.first = outcome_.first_reach / trial_.share;  // from rest: a near start moves by less
  result_.newton_iterations += outcome_.iterations;
  result_.cg_iterations += outcome_.cg_iterations;
  result_.linear_seconds += outcome_.linear_seconds;
  refuse_way(links);
  least_residual_ = outcome_.converged ? 1 : std::min(least_residual_, outcome_.relative_residual);
  if (!outcome_.converged) return false;
  done_ = trial_.share;
  state_ = trial_;
  if (near_) restore_followers(mechanics_, near_->followers);
  for (const ActiveEffect& effect : mechanics_.effects()) effect->accept(state_);
  ++result_.load_steps;
  result_.relative_residual = outcome_.relative_residual;
  if (hooks_ && hooks_->done)
    hooks_->done({done_, reach_.first, outcome_.relative_residual, result_.buckled, state_.displacement});
  length_.succeeded(outcome_.iterations <= kEasyIterations);
  return true;
}

void LoadStepping::refuse_way(const std::vector<RigidLink>& links_before) {
  refused_ = false;
  if (!outcome_.converged) return;
  std::string why;
  if (unilateral_) {
    const State before{state_.displacement, done_};
    for (const ActiveEffect& effect : mechanics_.effects())
      if (why.empty()) why = effect->refuses_load_step(before, trial_);
  }
  refused_ = !why.empty();
  if (!refused_) return;
  outcome_.converged = false;
  outcome_.relative_residual = 1;
  outcome_.trouble = why;
  restore_links(mechanics_.constraints(), links_before);
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
  const double diagonal = whole_box(body).diagonal();
  const std::string advice =
      overloaded()
          ? fmt::format(
                "At its first stiffness the load would move the part by {}, {} times its size: "
                "check the unit of the part and the load",
                human_length(reach_.first), human_number(reach_.first / diagonal, 2))
          : "Use a smaller load or move, a smaller spacing or a stiffer material; a part that buckles or "
            "snaps through has no equilibrium nearby";
  std::string chains = said_of_chains(mechanics_.cells().drawn_chains(state_), body);
  if (chains.empty()) chains = said_of_chains(mechanics_.cells().drawn_chains(trial_), body);
  throw DivergedError(fmt::format(
      "no equilibrium beyond {:.4g} % of the load{} (tried {:.4g} %): {}; most compressed "
      "is {} near {} of part \"{}\" with J = {:.3g}{}. {}{}",
      100 * done_, limit, 100 * trial_.share, outcome_.trouble, worst.name, point_name(worst.rest),
      body.parts[worst.part].name, worst.value, chains, advice, said_of_dead_torques(mechanics_, state_)));
}

// Linear over the body, in directions that no symmetry of a part is likely to have.
void LoadStepping::push(State& state) const {
  const Body& body = mechanics_.body();
  const Box box = whole_box(body);
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
  const bool far = outcome_.first_reach > reach_.farthest;
  reach_.farthest = std::numeric_limits<double>::infinity();
  if (!far) return false;
  if (!overloaded()) {
    ProgressStretch stretch(progress_, kBeforeFirstStep, kStarted);
    near_ = start_(stretch.inner());
    begun_ = kStarted;
  }
  const int before = result_.newton_iterations;
  if (near_ && !attempt(NewtonSteps::full, kFullStepIterations)) spent_ = result_.newton_iterations - before;
  near_.reset();
  return true;
}

void LoadStepping::begin_as(bool growing) {
  mechanics_.grow_free_strain(growing);
  restore_followers(mechanics_, beginning_.followers);
  restore_links(mechanics_.constraints(), beginning_.links);
}

void LoadStepping::begin_again(FreeStrainMode mode) {
  free_strain_ = mode;
  begin_as(mode == FreeStrainMode::growing);
  state_.displacement = beginning_.displacement;
  done_ = 0;
  length_ = LoadStepLength(first_);
  least_residual_ = 1;
  lowers_ = false;
  result_.load_steps = 0;
  if (!settings_.newton_iterations) spent_ = result_.newton_iterations;
}

bool LoadStepping::change_free_strain() {
  const bool may = !settings_.newton_iterations || iterations_left() > 0;
  if (!may || !mechanics_.has_free_strain()) return false;
  const bool whole_fails = free_strain_ == FreeStrainMode::whole && done_ == 0;
  const bool growing_fails = free_strain_ == FreeStrainMode::growing &&
                             (length_.get() <= kLoweringIncrement * first_ || iterations_left() <= 0);
  if (whole_fails) begin_again(FreeStrainMode::growing);
  if (growing_fails) begin_again(FreeStrainMode::whole_again);
  return whole_fails || growing_fails;
}

EquilibriumResult LoadStepping::operator()() {
  try {
    solve();
  } catch (const TimeoutError& error) {
    throw TimeoutError(fmt::format("{} in equilibrium with {:.4g} % of the load, {} Newton iterations",
                                   error.what(), 100 * done_, result_.newton_iterations));
  }
  result_.linear_reach = mechanics_.has_free_strain() ? reach_beside_free_strain() : reach_.first;
  return result_;
}

double LoadStepping::reach_beside_free_strain() {
  const std::vector<ActiveEffect>& effects = mechanics_.effects();
  const auto drives = [](const ActiveEffect& effect) { return effect->drives(); };
  const auto moved = [](const Vec3& u) { return !u.isZero(0); };
  if (std::none_of(effects.begin(), effects.end(), drives) || unilateral_ || result_.buckled ||
      std::any_of(beginning_.displacement.begin(), beginning_.displacement.end(), moved))
    return 0;
  const auto quiet = [](double, const std::string&) { check_stop(); };
  State small{beginning_.displacement, 1};
  NewtonOptions options;
  options.steps = NewtonSteps::full;
  const std::vector<RigidLink> links = links_now(mechanics_.constraints());
  if (links.empty() && !mechanics_.follows()) {
    options.max_iterations = 1;
    options.unstressed = true;
    return newton(mechanics_, small, options, quiet).first_reach;
  }
  const FollowerMemory followers = follower_memory(mechanics_);
  small.share = kSmallShare;
  begin_as(true);
  const bool found = newton_with_links(mechanics_, small, options, quiet).converged;
  begin_as(false);
  restore_followers(mechanics_, followers);
  restore_links(mechanics_.constraints(), links);
  if (!found) progress_.warn("whether the part is near buckling was not found out");
  double reach = 0;
  for (const Vec3& u : small.displacement) reach = std::max(reach, u.norm() / kSmallShare);
  return found ? reach : 0;
}

void LoadStepping::solve() {
  const std::vector<Motion>& motions = mechanics_.constraints().motions;
  const bool linked = std::any_of(motions.begin(), motions.end(),
                                  [](const Motion& motion) { return motion.link != nullptr; });
  if (start_ && first_ == 1 && !linked) reach_.farthest = kFarReach * whole_box(mechanics_.body()).diagonal();
  reach_.hopeless = out_of_proportion();
  while (done_ < 1) {
    refused_ = false;
    if (!lowers_ && attempt(NewtonSteps::full, kFullStepIterations)) continue;
    if (reach_.first > reach_.hopeless) refuse_load();
    reach_.hopeless = std::numeric_limits<double>::infinity();  // the first answer alone counts
    if (begin_near() || change_free_strain()) continue;
    if (iterations_left() > 0 && !refused_ && (unilateral_ || length_.get() <= kLoweringIncrement * first_) &&
        !mechanics_.follows() && attempt(NewtonSteps::lowering, NewtonOptions().max_iterations)) {
      lowers_ = unilateral_;
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

namespace {

// Of the whole body's groups the elements that are this process's own. `number`: (elements) of the set of each, here.
std::vector<std::vector<std::uint32_t>> coupled_over_pieces(const Mechanics& mechanics,
                                                            std::vector<std::uint32_t> number) {
  const std::vector<std::uint8_t>& mask = mechanics.constraints().mask;
  for (std::size_t e = 0; e < number.size(); ++e)
    if (mask[e] == 7) number[e] = OtherPieces::kNoSet;
  std::vector<std::vector<std::uint32_t>> groups(other_pieces()->join_sets(number));
  for (std::uint32_t e = 0; e < number.size(); ++e)
    if (number[e] != OtherPieces::kNoSet && counts_element(e)) groups[number[e]].push_back(e);
  return groups;
}

// Elements that cells couple, but for those that are held in all directions.
std::vector<std::vector<std::uint32_t>> coupled_by_cells(const Mechanics& mechanics) {
  const Body& body = mechanics.body();
  const std::vector<std::uint8_t>&mask = mechanics.constraints().mask, active = mechanics.active();
  DisjointSets sets(body.element_count());
  for (std::size_t c = 0; c < active.size(); ++c) {
    if (!active[c]) continue;
    std::optional<std::uint32_t> first;
    for (const std::uint32_t e : body.cell_elements[c]) {
      if (mask[e] == 7) continue;
      if (first) sets.unite(*first, e);
      if (!first) first = e;
    }
  }
  const std::vector<std::uint32_t> number = sets.numbered();
  std::vector<std::vector<std::uint32_t>> groups;
  if (other_pieces()) return coupled_over_pieces(mechanics, number);
  std::vector<std::uint32_t> group(number.size(), 0);  // by set; 0: none yet
  for (std::uint32_t e = 0; e < number.size(); ++e) {
    if (mask[e] == 7) continue;
    std::uint32_t& own = group[number[e]];
    if (own == 0) {
      groups.emplace_back();
      own = static_cast<std::uint32_t>(groups.size());
    }
    groups[own - 1].push_back(e);
  }
  return groups;
}

std::vector<FreeMotion> free_motions_elsewhere(Mechanics& mechanics, const State& start) {
  CellsElsewhere& cells = *mechanics.elsewhere();
  MatrixElsewhere matrix{coupled_by_cells(mechanics),
                         [&](const std::vector<Vec3>& x, std::vector<Vec3>& y) { cells.multiply(x, y); },
                         cells.diagonal()};
  if (other_pieces()) matrix.sum = [](std::span<double> values) { other_pieces()->sum(values); };
  return free_motions(matrix, node_geometry(mechanics.body(), start));
}

std::vector<FreeMotion> free_motions_here(Mechanics& mechanics, const State& start) {
  // Without the stresses that a rest shape gives the body where it starts: what they do to a motion as a whole
  // says nothing of what holds it.
  const bool stressed = RestShapes(mechanics.body()).any();
  const std::vector<Mat3> none(stressed ? mechanics.body().cell_count() : 0, Mat3::Zero());
  // What touches holds nothing: it is taken where it begins.
  State begun = start;
  begun.share = 0;
  mechanics.assemble(begun, {false, stressed ? &none : nullptr});
  mechanics.eliminate_prescribed();
  return free_motions(mechanics.tangent(), node_geometry(mechanics.body(), start));
}

}  // namespace

void refuse_free_motions(Mechanics& mechanics, const State& start, const std::string& scene) {
  const std::vector<FreeMotion> free =
      mechanics.elsewhere() ? free_motions_elsewhere(mechanics, start) : free_motions_here(mechanics, start);
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

EquilibriumResult find_equilibrium(Mechanics& mechanics, State& state, const RunSettings& settings,
                                   Progress& progress, const CoarseStart& start, const LoadStepHooks* hooks,
                                   const LoadStepSolver& solver) {
  return LoadStepping(mechanics, state, settings, progress, start, hooks, solver)();
}

}  // namespace flexel::simulate
