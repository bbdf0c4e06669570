// The tangent lacks only terms of the order of the strains, so iterations converge nearly quadratically.
#include "simulate/quadratic/quadratic_newton.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/error.h"
#include "base/human.h"
#include "base/math/greatest.h"
#include "base/parallel.h"
#include "simulate/followers/followed_tangent.h"
#include "simulate/followers/gmres.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/vector_products.h"
#include "simulate/quadratic/corotation.h"
#include "simulate/quadratic/quadratic_links.h"
#include "simulate/result/overload.h"

namespace flexel::simulate {
namespace {

constexpr double kFirstTurn = 1.0;                         // rad, that the first load step aims at
constexpr double kOutOfProportion = 5;                     // times the size of the part
constexpr double kMostStrain = 0.02;                       // root mean square, at the first stiffness
constexpr double kMostTurn = 0.7;                          // rad, of an iteration
constexpr double kLeastStep = 1. / 256;                    // of the load
constexpr int kMostIterations = 20;                        // of a load step
constexpr int kFewIterations = 6;                          // after which the next step is longer
constexpr double kMostStale = 0.02;                        // rad
constexpr int kMostLinear = 400, kMostLinearInAll = 5000;  // the second: where no load step succeeds
constexpr int kMoreWithLinks = 7;  // times as many in all: the nodes follow each step of the links
constexpr double kLeastTolerance = 1e-8, kGoodEnough = 1e-6;
constexpr double kLoosest = 1e-2;  // residual of a linear solution
// Of the loads: where cells that turned are stretched, that is a small share of the residual, and bending is in it.
constexpr double kLoosestOfLoads = 0.1;

// rad: how far moves turn what they lead.
double largest_angle(const QuadraticSystem& system) {
  double most = 0;
  for (const NitscheSupport& support : system.supports())
    most = std::max(most, std::abs(support.tie->motion.angle));
  return most;
}

class LargeDeflection {
 public:
  LargeDeflection(const QuadraticSystem& system, const RunSettings& settings,
                  const std::function<void(double, double)>& progress, QuadraticSolution& solution)
      : system_(system),
        tolerance_(std::max(settings.tolerance, kLeastTolerance)),
        progress_(progress),
        solution_(solution),
        tangent_(*solution.tangent),
        corotation_(system, tangent_.stiffness, solution.safety),
        reach_(largest(solution.displacement)),
        extent_(std::max(bounding_box(system.nodes().rest).diagonal(), largest_led(system))),
        angle_(largest_angle(system)),
        links_(system) {}

  void run(const RunSettings& settings, const std::string& scene) {
    const std::vector<Vec3> linear = solution_.displacement;
    const Eigen::VectorXd linear_links = links_.motions();
    links_.take_small(false);
    if (settings.load_steps == 1) refuse_out_of_proportion(scene);
    double done = load_in_steps(settings, linear, linear_links);
    // past buckling true stresses and looser solutions sometimes arrive where the others do not
    if (done < 1 && !weak_support_ && !settings.newton_iterations) {
      foretells_ = false;
      done = std::max(done, load_in_steps(settings, linear, linear_links));
    }
    if (done < 1 && !weak_support_) fail(scene, done);
  }

  // Of loads that follow, so that whole turns are told.
  void count_turns(const std::vector<Vec3>& u) {
    solution_.load_turn.resize(system_.loads().size(), Vec3::Zero());
    for (std::size_t l = 0; l < system_.loads().size(); ++l)
      if (const auto& follower = system_.loads()[l].follower)
        solution_.load_turn[l] = follower->turn(u, solution_.load_turn[l]);
  }

  // (nodes) `share` times `from`, and `ahead` times what it is from `before`.
  static std::vector<Vec3> further(const std::vector<Vec3>& from, const std::vector<Vec3>& before,
                                   double ahead, double share = 1) {
    std::vector<Vec3> to(from.size());
    parallel_for_each(to.size(),
                      [&](std::size_t n) { to[n] = share * from[n] + ahead * (from[n] - before[n]); });
    return to;
  }

  // Whether cells that turn answer noticeably otherwise: by one correction of the linear solution.
  bool matters() {
    if (angle_ > kFirstTurn) return true;
    constexpr double kNoticeable = 5e-5, kRoughly = 0.1;
    const std::vector<Vec3>& u = solution_.displacement;
    std::vector<Vec3> left, change;
    if (!corotation_.residual(u, 1, left)) return true;
    tangent_.stiffness.clear_held(left);
    const LinearResult result =
        conjugate_gradients(tangent_.stiffness, left, change, *tangent_.multigrid, kRoughly, kMostLinear);
    solution_.iterations += result.iterations;
    weak_support_ = result.indefinite;
    return !(largest(change) <= kNoticeable * largest(u));
  }

  // Whether the last state is a stable equilibrium: its tangent is positive. A load that is as symmetric as the part never
  // meets the way in which that buckles, so the right side is irregular. Nothing where
  // conjugate gradients do not tell.
  std::optional<bool> stable(const std::vector<Vec3>& u) {
    std::vector<Vec3> irregular(u.size()), change;
    if (!corotation_.residual(u, 1, change)) return std::nullopt;
    std::mt19937 random(1);
    for (Vec3& each : irregular)
      for (double& value : each) value = static_cast<double>(random()) / 4294967295.0 - 0.5;
    tangent_.stiffness.clear_held(irregular);
    corotation_.set_tangent(true);
    bool anew = stale(u);
    for (int attempt = 0; attempt < 2; ++attempt, anew = true) {
      if (anew) make_preconditioner(u);
      const LinearResult result = system_.follows()
                                      ? conjugate_gradients(followed(u, true), irregular, change,
                                                            *tangent_.multigrid, kLoosest, kMostLinear)
                                      : conjugate_gradients(tangent_.stiffness, irregular, change,
                                                            *tangent_.multigrid, kLoosest, kMostLinear);
      solution_.iterations += result.iterations;
      if (result.indefinite) return not_positive();
      if (result.converged) return links_stable(u);
      if (anew) break;
    }
    return std::nullopt;
  }
  std::optional<bool> links_stable(std::vector<Vec3> u) {
    if (!links_.any()) return true;
    LinkedNodes nodes = linked_nodes(u, 1, [] { return true; });
    const std::optional<bool> stable = links_.stable(nodes, 1, solution_.safety);
    return stable == false ? not_positive() : stable;
  }
  // Not stable; but where the symmetric part is not positive, loads that follow may still leave it so.
  [[nodiscard]] std::optional<bool> not_positive() const {
    return system_.follows() || system_.links_follow() ? std::nullopt : std::optional(false);
  }
  // The stiffness is not positive, and stresses are not the reason.
  [[nodiscard]] bool weak_support() const { return weak_support_; }

 private:
  [[nodiscard]] std::string overload() const {
    return fmt::format(
        "at its first stiffness the load would move the part by {}, {} times its size: check the "
        "unit of the part and the load",
        human_length(reach_), human_number(reach_ / extent_, 2));
  }

  // What is thin may be bent over without much strain.
  void refuse_out_of_proportion(const std::string& scene) const {
    if (reach_ > kOutOfProportion * extent_ && mean_strain(system_, solution_) > kMostStrain)
      throw OverloadError(
          fmt::format("{}: {}; or, if that is meant, write [run] load_steps = 4", scene, overload()));
  }

  [[noreturn]] void fail(const std::string& scene, double done) const {
    const std::string why =
        reach_ > extent_
            ? overload()
            : "use a smaller --size where walls are thin; model \"cells\" follows buckling and large strains";
    throw DivergedError(fmt::format("{}: model \"quadratic\" finds no equilibrium beyond {} of the load; {}",
                                    scene, human_share(done), why));
  }

  // From rest. The share of the load at which there is an equilibrium.
  double load_in_steps(const RunSettings& settings, const std::vector<Vec3>& linear,
                       const Eigen::VectorXd& linear_links) {
    std::vector<Vec3> before(linear.size(), Vec3::Zero()), now = before;
    Eigen::VectorXd links_before = 0 * linear_links, links_now = links_before;
    const int earlier = solution_.newton_iterations, earlier_linear = solution_.iterations - link_iterations_;
    solution_.load_steps = 0;
    solution_.load_turn.clear();
    const int more = links_.any() ? kMoreWithLinks : 1;
    const int most = settings.newton_iterations.value_or(more * (reach_ > extent_ ? 40 : 100));
    double done = 0, last = 0;
    // the linear answer to a move that turns follows the chord of its end, which says nothing of the way there
    const bool turned = angle_ > kFirstTurn;
    const double longest = std::min(1. / std::max(settings.load_steps, 1), turned ? kFirstTurn / angle_ : 1.);
    double step = std::min(longest, kFirstTurn / std::max(largest_turn(linear), 1e-300));
    while (done < 1) {
      const double share = done + step > 1 - 1e-9 ? 1 : done + step;
      const double ahead = last > 0 ? (share - done) / last : 0;
      std::vector<Vec3> guess =
          done > 0 ? further(now, before, ahead) : further(linear, linear, 0, turned ? 0 : share);
      links_.set_motions(done > 0 ? Eigen::VectorXd(links_now + ahead * (links_now - links_before))
                                  : Eigen::VectorXd((turned ? 0 : share) * linear_links));
      begin_step(now, done, guess, share);
      const int iterations = reach_with_links(share, guess);
      if (iterations > kMostIterations) {
        step = (share - done) / 2;
        if (step < kLeastStep * longest ||
            solution_.iterations - link_iterations_ - earlier_linear > more * kMostLinearInAll ||
            solution_.newton_iterations - earlier > most + 10 * solution_.load_steps)
          return done;
        continue;
      }
      ++solution_.load_steps;
      before = now;
      now = guess;
      links_before = links_now;
      links_now = links_.motions();
      last = share - done;
      done = share;
      count_turns(now);
      weak_support_ = false;
      if (iterations <= kFewIterations) step = std::min(2 * step, longest);
    }
    solution_.displacement = now;
    if (!turned && reach_ > 0) solution_.amplification = largest(now) / reach_;
    solution_.turn = corotation_.turns();
    return done;
  }

  // m: how far moves lead the matter.
  static double largest_led(const QuadraticSystem& system) {
    double most = 0;
    for (const Vec3& led : system.cut_displacement()) most = std::max(most, led.norm());
    for (const NitscheSupport& support : system.supports()) {
      if (support.tie->link) continue;
      for (const FacePoint& point : support.points)
        most = std::max(most, support.tie->motion.displacement(point.position, 1).norm());
      for (const std::uint32_t n : support.nodes)
        most = std::max(most, support.tie->motion.displacement(system.nodes().rest[n], 1).norm());
    }
    return most;
  }

  static double largest(const std::vector<Vec3>& values) {
    double most = 0;
    for (const Vec3& value : values) most = std::max(most, value.norm());
    return most;
  }

  // rad: how far a displacement turns any cell, to first order.
  double largest_turn(const std::vector<Vec3>& displacement) const {
    return parallel_sum<Greatest>(
               system_.nodes().cells.size(),
               [&](std::size_t c) {
                 return Greatest{spin_of(gradient_at(system_, displacement, c, system_.middle(c))).norm()};
               })
        .value;
  }

  // Moves the nodes of `u` that are led.
  void lead(double share, std::vector<Vec3>& u) const {
    const std::vector<Vec3> led = system_.prescribed(share);
    const std::vector<std::uint8_t>& held = tangent_.stiffness.held();
    for (std::size_t n = 0; n < u.size(); ++n)
      for (int axis = 0; axis < 3; ++axis)
        if (held[n] >> axis & 1) u[n][axis] = led[n][axis];
  }

  // Foretells the stresses of `guess`, at `share`, from the equilibrium `now` at the share `done`.
  void begin_step(const std::vector<Vec3>& now, double done, std::vector<Vec3>& guess, double share) {
    lead(share, guess);
    if (!corotation_.residual(now, done, solution_.unbalanced)) return;  // the next residual tells
    if (foretells_) corotation_.foretell(now, further(guess, now, 1, 0), share - done);
  }

  // Equilibrium at a share of the load, from `u`. How many iterations it took; more than kMostIterations: there was none.
  int reach(double share, std::vector<Vec3>& u) {
    share_ = share;
    lead(share, u);
    double before = HUGE_VAL;
    for (int iteration = 0; iteration <= kMostIterations; ++iteration) {
      if (!corotation_.residual(u, share, solution_.unbalanced)) return kMostIterations + 1;
      std::vector<Vec3> left = solution_.unbalanced;
      tangent_.stiffness.clear_held(left);
      const double residual = std::sqrt(dot(left, left)) / std::max(corotation_.scale(), 1e-300);
      if (!std::isfinite(residual)) return kMostIterations + 1;
      progress_(share, residual);
      solution_.relative_residual = residual;
      // as small as it was asked for, or as rounding lets it be
      if (residual <= tolerance_ || (residual <= kGoodEnough && residual > 0.5 * before)) return iteration;
      before = residual;
      std::vector<Vec3> change;
      if (!solve(u, left, residual, change)) return kMostIterations + 1;
      const double turn = largest_turn(change);
      const double part = turn > kMostTurn ? kMostTurn / turn : 1;
      if (part < 1) parallel_for_each(change.size(), [&](std::size_t n) { change[n] *= part; });
      if (foretells_) corotation_.foretell(u, change, 0);
      parallel_for_each(u.size(), [&](std::size_t n) { u[n] += change[n]; });
      ++solution_.newton_iterations;
    }
    return kMostIterations + 1;
  }

  // What links are balanced with, at `u`.
  LinkedNodes linked_nodes(std::vector<Vec3>& u, double share, std::function<bool()> hold) {
    constexpr double kResponse = 1e-7;
    return {u,
            solution_.unbalanced,
            corotation_.turns(),
            tangent_.stiffness,
            std::move(hold),
            [this, &u, share] { return corotation_.residual(u, share, solution_.unbalanced); },
            [this, &u] {
              corotation_.set_tangent(true);
              if (stale(u)) make_preconditioner(u);
            },
            [this](const std::vector<Vec3>& right, std::vector<Vec3>& x) {
              const LinearResult result = conjugate_gradients(tangent_.stiffness, right, x,
                                                              *tangent_.multigrid, kResponse, kMostLinear);
              solution_.iterations += result.iterations;
              link_iterations_ += result.iterations;
              return result.converged && !result.indefinite;
            }};
  }

  // The same with every link in balance.
  int reach_with_links(double share, std::vector<Vec3>& u) {
    int iterations = reach(share, u);
    if (!links_.any() || iterations > kMostIterations) return iterations;
    LinkedNodes nodes = linked_nodes(u, share, [&] {
      const int more = reach(share, u);
      if (more > kMostIterations) return false;
      iterations = std::max(iterations, more);
      return true;
    });
    return links_.find(nodes, share, solution_.safety, tolerance_) ? iterations : kMostIterations + 1;
  }

  // Cells have turned too far since the preconditioner was made.
  [[nodiscard]] bool stale(const std::vector<Vec3>& u) const {
    if (made_at_.empty()) return largest_turn(u) > kMostStale;
    std::vector<Vec3> since(u.size());
    parallel_for_each(u.size(), [&](std::size_t n) { since[n] = u[n] - made_at_[n]; });
    return largest_turn(since) > kMostStale;
  }
  void make_preconditioner(const std::vector<Vec3>& u) {
    tangent_.multigrid.reset();  // before there is another
    tangent_.multigrid.emplace(tangent_.stiffness, system_.problem().body, system_.bonds(), u);
    made_at_ = u;
  }

  // A preconditioner lasts for a while; a tangent that is not positive loses the part of the stresses.
  bool solve(const std::vector<Vec3>& u, const std::vector<Vec3>& left, double residual,
             std::vector<Vec3>& change) {
    corotation_.set_tangent(true);
    if (!stale(u) && attempt(u, left, residual, change)) return true;
    for (const bool stressed : {true, false}) {
      corotation_.set_tangent(stressed);
      make_preconditioner(u);
      if (attempt(u, left, residual, change)) return true;
    }
    weak_support_ |= indefinite_;
    return false;
  }

  // Share of `residual`, which is beside the loads. The next residual is of the order of the square of this one, and need be
  // no less than what was asked for.
  [[nodiscard]] double forcing(double residual) const {
    const double loosest = foretells_ ? std::min(kLoosest, kLoosestOfLoads / residual) : kLoosest;
    return std::min(loosest, std::max(residual, 0.3 * tolerance_ / residual));
  }

  // The stiffness with what loads add that follow the shape, at `u` and the share of the load that is
  // looked for.
  [[nodiscard]] FollowedTangent followed(const std::vector<Vec3>& u, bool symmetric) const {
    return {tangent_.stiffness, tangent_.stiffness.held(),
            [this, &u](const std::vector<Vec3>& along, bool transposed, std::vector<Vec3>& forces) {
              for (const NodalLoad& load : system_.loads()) {
                if (!load.follower) continue;
                if (transposed)
                  load.follower->add_transposed_change(u, share_, along, forces);
                else
                  load.follower->add_change(u, share_, along, forces);
              }
            },
            symmetric};
  }

  bool attempt(const std::vector<Vec3>& u, const std::vector<Vec3>& left, double residual,
               std::vector<Vec3>& change) {
    const LinearResult result =
        system_.follows()
            ? gmres(followed(u, false), left, change, *tangent_.multigrid, forcing(residual), kMostLinear)
            : conjugate_gradients(tangent_.stiffness, left, change, *tangent_.multigrid, forcing(residual),
                                  kMostLinear);
    solution_.iterations += result.iterations;
    indefinite_ = result.indefinite;
    return result.converged;
  }

  const QuadraticSystem& system_;
  double tolerance_;
  const std::function<void(double, double)>& progress_;
  QuadraticSolution& solution_;
  QuadraticTangent& tangent_;
  Corotation corotation_;
  double reach_ = 0, extent_ = 0;  // m: of the linear answer; of the part, or of what leads it
  double angle_ = 0;               // rad, of moves
  bool indefinite_ = false;        // the last tangent
  bool weak_support_ = false;
  bool foretells_ = true;      // the stresses of the tangent, which take closer linear solutions
  std::vector<Vec3> made_at_;  // (nodes x 3) m, where the preconditioner was made; none: at rest
  LinkBalance links_;
  double share_ = 1;         // of the load, that reach() looks for
  int link_iterations_ = 0;  // of solution_.iterations: how the nodes answer to links
};

}  // namespace

bool follow_turns(const QuadraticSystem& system, const RunSettings& settings, const std::string& scene,
                  const std::function<void(double, double)>& progress, QuadraticSolution& solution) {
  LargeDeflection large(system, settings, progress, solution);
  large.run(settings, scene);
  return !large.weak_support();
}

bool solve_large(const QuadraticSystem& system, const RunSettings& settings, const std::string& scene,
                 const std::function<void(int, double)>& linear,
                 const std::function<void(double, double)>& progress, QuadraticSolution& solution) {
  // What large deflections change is of the order of the rotation times the slenderness.
  constexpr double kTiny = 3e-4;
  constexpr double kFarFromBuckling = 0.02;  // of the strain times the slenderness squared
  double turn = largest_angle(system), strain = 0, finest = HUGE_VAL;  // a whole turn leaves no displacement
  for (std::size_t c = 0; c < system.nodes().cells.size(); ++c) {
    const Mat3 gradient = gradient_at(system, solution.displacement, c, system.middle(c));
    turn = std::max(turn, spin_of(gradient).norm());
    strain = std::max(
        strain, (0.5 * (gradient + gradient.transpose()) - system.free_strain(c, system.middle(c))).norm());
    finest = std::min(finest, system.lattice(c).spacing.minCoeff());
  }
  const double slenderness = bounding_box(system.nodes().rest).diagonal() / finest;
  const bool straight = turn * slenderness < kTiny,
             far = strain * slenderness * slenderness < kFarFromBuckling;
  if (straight && far) return correct(system, settings.tolerance, solution, linear);
  LargeDeflection large(system, settings, progress, solution);
  if (system.linked().empty() && !large.matters()) {
    if (large.weak_support() || !correct(system, settings.tolerance, solution, linear)) return false;
  } else {
    if (!large.weak_support()) large.run(settings, scene);
    if (large.weak_support()) return false;
  }
  if (!far) solution.stable = large.stable(solution.displacement);
  return true;
}

}  // namespace flexel::simulate
