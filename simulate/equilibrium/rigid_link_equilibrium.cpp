// The links' motions q (six numbers each, rotations times the reach) are the unknowns of an outer Newton
// method; for each q the elements' own Newton method brings the body into equilibrium, the links leading
// their matter there. What a link lacks, b(q) = load - pull, falls to 0 by dq = -(db/dq)^-1 b. The slope is
// taken from the tangent (a Schur complement): the answer x of the free elements to dq, K x = df/dq, is one
// linear solution per number with one preconditioner, and db/dq is the difference of b along (x, dq). It is
// kept as long as it serves and mended by what each step shows (Broyden 1965). So the body's system is as
// well conditioned as one with held faces, and a small deflection needs one equilibrium and six linear
// solutions a link. Differences are central, over two steps (Richardson), of 1e-4 of the smaller of reach and spacing: what
// is cut off and what rounding leaves are both some 1e-12 of the elements' stiffness then, which a cantilever thousands of
// times as long as thick still has.
#include "simulate/equilibrium/rigid_link_equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "simulate/conditions/link_stability.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/multigrid.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr int kMostLinkSteps = 12;    // steps of the links
constexpr double kLooser = 10;        // tolerance of the links over that of the elements
constexpr double kServes = 0.1;       // a step that leaves more than this of b: take the slope anew
constexpr double kAstray = 4;         // ... and more than this: give up
constexpr double kDifference = 1e-4;  // of the reach, or the spacing where that is smaller
constexpr double kResponse = 1e-8;    // relative residual of the linear solutions
constexpr int kMaxLinkCgIterations = 3000;
// Of the elements' mean stiffness, some times what differences leave: nothing resists.
constexpr double kFree = 1e-11;
constexpr double kSlopeShare = 0.5;  // of the run's time: the first slope
constexpr double kOthers = 1e-3;     // of the links' loads: other loads count

// The derivative of f: sum of weight f(steps h) / h.
constexpr std::array<std::pair<double, double>, 4> kCentral = {
    {{1, 2. / 3}, {-1, -2. / 3}, {2, -1. / 12}, {-2, 1. / 12}}};

using LinkVector = Eigen::VectorXd;

std::vector<std::shared_ptr<RigidLink>> rigid_links(const Constraints& constraints) {
  std::vector<std::shared_ptr<RigidLink>> links;
  for (const Motion& motion : constraints.motions)
    if (motion.link) links.push_back(motion.link);
  return links;
}

std::vector<RigidLink> copies(const std::vector<std::shared_ptr<RigidLink>>& links) {
  std::vector<RigidLink> result;
  for (const auto& link : links) result.push_back(*link);
  return result;
}

void restore(const std::vector<std::shared_ptr<RigidLink>>& links, const std::vector<RigidLink>& before) {
  for (std::size_t l = 0; l < links.size(); ++l) *links[l] = before[l];
}

class Balance {
 public:
  Balance(Mechanics& mechanics, State& state, const NewtonOptions& options, const NewtonProgress& progress)
      : mechanics_(mechanics),
        state_(state),
        options_(options),
        progress_(progress),
        links_(rigid_links(mechanics.constraints())) {}

  NewtonOutcome run();
  // links_are_stable()
  std::optional<bool> stable(const Preconditioner& preconditioner);

 private:
  [[nodiscard]] Eigen::Index unknowns() const { return static_cast<Eigen::Index>(6 * links_.size()); }
  // The elements' equilibrium, which takes the run from one share of its time to another.
  NewtonOutcome settle(double from, double to);
  void move(const LinkVector& step);
  [[nodiscard]] double difference(Eigen::Index j) const;  // m
  [[nodiscard]] State led(const std::vector<Vec3>& response, double step) const;
  LinkVector lacking(const State& state);
  std::vector<Vec3> free_forces(const State& state);
  Eigen::MatrixXd slope();
  bool take_slope(const Preconditioner& preconditioner, Eigen::MatrixXd& slope);
  bool add_column(const Preconditioner& preconditioner, Eigen::Index j, Eigen::MatrixXd& slope);
  void correct(Eigen::MatrixXd& slope) const;
  void refuse_free(const Eigen::MatrixXd& slope) const;
  bool is_rounding(const LinkVector& left);
  bool find();

  Mechanics& mechanics_;
  State& state_;
  const NewtonOptions& options_;
  const NewtonProgress& progress_;
  std::vector<std::shared_ptr<RigidLink>> links_;
  NewtonOutcome outcome_;
  double scale_ = 0;    // N: loads and reactions
  double stiff_ = 0;    // N/m, mean of the tangent's diagonal
  double gone_ = 0;     // share of the run's time
  LinkVector answers_;  // (unknowns) m/m, root of the mean square of the elements' answers
  // (unknowns) answers of the elements to a unit of each [m/m], and what their linear solutions left [N/m]
  std::vector<std::vector<Vec3>> response_, left_over_;
};

void Balance::move(const LinkVector& step) {
  for (std::size_t l = 0; l < links_.size(); ++l) {
    const auto at = static_cast<Eigen::Index>(6 * l);
    links_[l]->translation += step.segment<3>(at);
    links_[l]->turn += step.segment<3>(at + 3) / links_[l]->reach;
  }
}

double Balance::difference(Eigen::Index j) const {
  double least = links_[static_cast<std::size_t>(j / 6)]->reach;
  for (const Part& part : mechanics_.body().parts) least = std::min(least, part.lattice.spacing.minCoeff());
  return kDifference * least;
}

// `state_`, its free elements moved by step * response, the others led to where the links are.
State Balance::led(const std::vector<Vec3>& response, double step) const {
  State result = state_;
  for (std::size_t e = 0; e < response.size(); ++e) result.displacement[e] += step * response[e];
  apply(mechanics_.constraints(), mechanics_.body(), result, result.displacement);
  return result;
}

// What each link's load has more than its ties pull: force, and moment about the middle over the reach. [N]
LinkVector Balance::lacking(const State& state) {
  SimulateResult told;
  mechanics_.report(state, told);
  LinkVector result(unknowns());
  scale_ = 0;
  for (const AppliedLoad& load : told.loads) scale_ += load.force.norm();
  for (const Reaction& reaction : told.reactions) scale_ += reaction.force.norm();
  for (std::size_t l = 0; l < links_.size(); ++l) {
    const RigidLink& link = *links_[l];
    const Vec3 arm = link.at - link.middle + link.displacement(link.at) - link.translation;
    const Vec3 force = state.share * link.now(link.force);
    const Vec3 moment = state.share * link.now(link.torque) + arm.cross(force);
    const auto at = static_cast<Eigen::Index>(6 * l);
    result.segment<3>(at) = force - link.pull;
    result.segment<3>(at + 3) = (moment - link.pull_moment) / link.reach;
    scale_ += moment.norm() / link.reach;
  }
  return result;
}

std::vector<Vec3> Balance::free_forces(const State& state) {
  std::vector<Vec3> forces = mechanics_.forces(state).total;
  clear_prescribed(mechanics_.constraints(), forces);
  return forces;
}

// One column of db/dq. False when the tangent has negative curvature.
bool Balance::add_column(const Preconditioner& preconditioner, Eigen::Index j, Eigen::MatrixXd& slope) {
  const double step = difference(j);
  const LinkVector along = LinkVector::Unit(unknowns(), j) * step;
  const std::vector<Vec3> none;
  const auto at = [&](double steps, const std::vector<Vec3>& answer) {
    move(steps * along);
    return led(answer, steps * step);
  };
  std::vector<Vec3> pushed;
  for (const auto& [steps, weight] : kCentral) {
    const std::vector<Vec3> forces = free_forces(at(steps, none));
    move(-steps * along);
    pushed.resize(forces.size(), Vec3::Zero());
    for (std::size_t e = 0; e < pushed.size(); ++e) pushed[e] += weight / step * forces[e];
  }
  std::vector<Vec3> response(pushed.size(), Vec3::Zero());
  const LinearResult solved = conjugate_gradients(
      mechanics_.tangent(), pushed, response, preconditioner, kResponse, kMaxLinkCgIterations,
      [&](int iteration, double relative) {
        const double column = std::clamp(std::log(relative) / std::log(kResponse), 0.0, 1.0);
        const double share = (static_cast<double>(j) + column) / static_cast<double>(unknowns());
        progress_(std::max(gone_, kSlopeShare * share),
                  fmt::format("rigid link {}, cg {}, {:.0e}", j / 6 + 1, iteration, relative));
      });
  outcome_.cg_iterations += solved.iterations;
  if (solved.indefinite) return false;
  for (const auto& [steps, weight] : kCentral) {
    slope.col(j) += weight / step * lacking(at(steps, response));
    move(-steps * along);
  }
  std::vector<Vec3> resisted(pushed.size());
  multiply(mechanics_.tangent(), response, resisted);
  for (std::size_t e = 0; e < pushed.size(); ++e) pushed[e] -= resisted[e];
  response_.push_back(std::move(response));
  left_over_.push_back(std::move(pushed));
  return true;
}

// Makes the slope the energy's second derivative along the answers: what the linear solutions left over
// enters squared then, and a motion that nothing resists stands out.
void Balance::correct(Eigen::MatrixXd& slope) const {
  for (Eigen::Index i = 0; i < unknowns(); ++i)
    for (Eigen::Index j = 0; j < unknowns(); ++j) {
      const std::vector<Vec3>& x = response_[static_cast<std::size_t>(i)];
      const std::vector<Vec3>& r = left_over_[static_cast<std::size_t>(j)];
      slope(i, j) += parallel_sum<double>(x.size(), [&](std::size_t e) { return x[e].dot(r[e]); });
    }
}

// With the tangent as it is; false when that has negative curvature.
bool Balance::take_slope(const Preconditioner& preconditioner, Eigen::MatrixXd& slope) {
  slope.setZero(unknowns(), unknowns());
  response_.clear();
  left_over_.clear();
  bool good = true;
  for (Eigen::Index j = 0; good && j < unknowns(); ++j) good = add_column(preconditioner, j, slope);
  if (good) correct(slope);
  answers_.setZero(unknowns());
  for (std::size_t j = 0; j < response_.size(); ++j)
    answers_[static_cast<Eigen::Index>(j)] =
        std::sqrt(dot(response_[j], response_[j]) / static_cast<double>(response_[j].size()));
  response_.clear();
  left_over_.clear();
  return good;
}

// db/dq [N/m], the free elements following. A tangent with negative curvature is taken with the cells' moduli
// projected to their positive part.
Eigen::MatrixXd Balance::slope() {
  const ScopeTimer timer(outcome_.linear_seconds);
  Eigen::MatrixXd slope;
  for (const bool project : {false, true}) {
    mechanics_.assemble(state_, {project, nullptr});
    mechanics_.eliminate_prescribed();
    const auto preconditioner =
        aggregation_multigrid(mechanics_.tangent(), node_geometry(mechanics_.body(), state_));
    const std::vector<Block> diagonal = mechanics_.tangent().diagonal();
    stiff_ = parallel_sum<double>(diagonal.size(), [&](std::size_t e) { return diagonal[e].trace(); }) /
             (3.0 * static_cast<double>(diagonal.size()));
    if (take_slope(*preconditioner, slope)) break;
  }
  return slope;
}

std::optional<bool> Balance::stable(const Preconditioner& preconditioner) {
  Eigen::MatrixXd slope;
  if (!take_slope(preconditioner, slope)) return std::nullopt;
  std::vector<const RigidLink*> links;
  for (const auto& link : links_) links.push_back(link.get());
  return link_motions_are_stable(slope, links);
}

void Balance::refuse_free(const Eigen::MatrixXd& slope) const {
  const SingularValues svd = singular_values(slope);
  if (svd.values.minCoeff() > kFree * stiff_) return;
  const LinkVector freest = svd.v.col(unknowns() - 1);
  Eigen::Index most = 0;
  freest.cwiseAbs().maxCoeff(&most);
  throw InputError(
      links_[static_cast<std::size_t>(most / 6)]->origin,
      fmt::format(
          "load \"{}\": nothing holds what its rigid link moves, which is free to {} {}: add a [[fix]] "
          "that stops it",
          links_[static_cast<std::size_t>(most / 6)]->name, most % 6 < 3 ? "translate along" : "rotate about",
          "xyz"[most % 3]));
}

NewtonOutcome Balance::settle(double from, double to) {
  return newton(mechanics_, state_, options_, [&](double gone, const std::string& note) {
    gone_ = from + gone * (to - from);
    progress_(gone_, note);
  });
}

// What the elements' forces are off by, as rounding leaves them, comes to the links by their answers: on a slender part,
// whose end goes far where its link turns, that is more than the tolerance.
bool Balance::is_rounding(const LinkVector& left) {
  const std::vector<Vec3> off = free_forces(state_);
  return (left.cwiseAbs() - std::sqrt(dot(off, off)) * answers_).cwiseMax(0).norm() <=
         kLooser * options_.tolerance * scale_;
}

// Moves the links until nothing is lacking. False when it did not get there.
bool Balance::find() {
  // Where a step of the links makes the body touch something, its slope is another.
  const bool touches = mechanics_.unilateral();
  LinkVector left = lacking(state_);
  const std::vector<Vec3> others = free_forces(led({}, 0));
  const bool alone = std::sqrt(dot(others, others)) <= kOthers * scale_;
  Eigen::MatrixXd slope;
  bool serves = false;
  for (int k = 0; k < kMostLinkSteps; ++k) {
    if (!serves) {
      slope = this->slope();
      refuse_free(slope);
    }
    const LinkVector step = -solve_dense(slope, left);
    move(step);
    const double from = std::max(gone_, kSlopeShare);
    const NewtonOutcome one = settle(from, 0.5 * (1 + from));
    // Beside other loads the first linear answer is that of a body whose links are held.
    if (outcome_.iterations == 0 && alone) outcome_.first_reach = one.first_reach;
    outcome_.iterations += one.iterations;
    outcome_.cg_iterations += one.cg_iterations;
    outcome_.linear_seconds += one.linear_seconds;
    outcome_.relative_residual = one.relative_residual;
    outcome_.trouble = one.trouble;
    if (!one.converged) return false;
    const LinkVector now = lacking(state_);
    serves = now.norm() < kServes * left.norm();
    if (now.norm() <= kLooser * options_.tolerance * scale_ || (!serves && is_rounding(now))) return true;
    outcome_.trouble =
        fmt::format("the rigid link \"{}\" lacks {:.1e} of its load", links_[0]->name, now.norm() / scale_);
    // The first step does not know yet what other loads, as weight, lay on the links.
    if (!touches && k > 0 && !(now.norm() < kAstray * left.norm())) return false;
    slope += (now - left - slope * step) * step.transpose() / step.squaredNorm();
    left = now;
  }
  return false;
}

NewtonOutcome Balance::run() {
  const std::vector<RigidLink> before = copies(links_);
  outcome_.converged = find();
  if (!outcome_.converged) restore(links_, before);
  return outcome_;
}

}  // namespace

NewtonOutcome newton_with_links(Mechanics& mechanics, State& state, const NewtonOptions& options,
                                const NewtonProgress& progress, NewtonMemory* memory) {
  if (rigid_links(mechanics.constraints()).empty())
    return newton(mechanics, state, options, progress, memory);
  return Balance(mechanics, state, options, progress).run();
}

std::optional<bool> links_are_stable(Mechanics& mechanics, State state,
                                     const Preconditioner& preconditioner) {
  const std::vector<std::shared_ptr<RigidLink>> links = rigid_links(mechanics.constraints());
  if (links.empty()) return true;
  if (mechanics.follows()) return std::nullopt;
  struct Stopped {};
  const auto ask = [](double, const std::string&) {
    check_stop();
    if (stop_is_due()) throw Stopped();
  };
  const std::vector<RigidLink> before = copies(links);
  std::optional<bool> stable;
  try {
    stable = Balance(mechanics, state, {}, ask).stable(preconditioner);
  } catch (const Stopped&) {
  }
  restore(links, before);
  return stable;
}

}  // namespace flexel::simulate
