// Rows of a joint are lengths [m]: those of angles are times the size of the part, so that one tolerance serves all.
#include "simulate/rigid/joints.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/units.h"

namespace flexel::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kJointRounds = 60;
constexpr double kHolds = 1e-14;      // of the body's size: the joints hold
constexpr double kHoldsStill = 1e-9;  // where rounds lead no nearer
constexpr double kApartAtStart = 1e-6;
constexpr double kHeldTwice = 1e-12;  // of the mean of the diagonal, added where rows hold the same twice
constexpr double kSameTwice = 1e-9;   // of the largest eigenvalue
constexpr double kMostStopped =
    0.05;  // of the kinetic energy, that joints may take from velocities at the start
constexpr double kJointTurn = 0.01;  // rad a step
constexpr double kFirstLength =
    1e-6;  // of the run: of the first steps, from which it is seen what the joints bear
constexpr double kLeastSteps = 1000;  // of a run

// Two directions across an axis.
std::array<Vec3, 2> directions_across(const Vec3& axis) {
  Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Vec3 first = axis.cross(Vec3::Unit(least)).normalized();
  return {first, axis.cross(first)};
}

std::size_t row_count(const Joint& joint) {
  return joint.kind == JointKind::ball ? 3 : 5;
}

bool has_speed(const Joint& joint) {
  return joint.kind == JointKind::motor && joint.speed.has_value();
}

Mat3 inverse_inertia_now(const RigidBody& body) {
  return body.pose.rotation * body.inverse_inertia * body.pose.rotation.transpose();
}

double kinetic(const RigidBody& body, const Vec3& momentum, const Vec3& spin) {
  return 0.5 * (momentum.squaredNorm() / body.mass + spin.dot(inverse_inertia_now(body) * spin));
}

}  // namespace

// Where a side of a joint is.
struct JointSystem::Frame {
  Vec3 at = Vec3::Zero(), centre = Vec3::Zero();  // m
  Vec3 axis = Vec3::Zero(), first = Vec3::Zero(), second = Vec3::Zero();
};

// What an impulse of 1 in each row does to the two sides, and what of it is felt along the rows.
struct JointSystem::Rows {
  struct Row {
    std::size_t place = 0;
    std::array<Vec3, 2> push = {Vec3::Zero(), Vec3::Zero()};  // on the sides
    std::array<Vec3, 2> turn = {Vec3::Zero(), Vec3::Zero()};  // about their centres of mass
    bool drives = false;
  };
  std::vector<Row> row;
  MatrixXd matrix;  // G M^-1 G^T
};

JointSystem::JointSystem(std::vector<Place> places, double size, double duration)
    : places_(std::move(places)),
      size_(size),
      duration_(duration),
      travel_(places_.size(), 0),
      stalled_(places_.size(), 0),
      reactions_(places_.size()),
      borne_(2 * places_.size(), Vec3::Zero()) {
  std::size_t bodies = 0;
  for (const Place& place : places_)
    for (const Side& side : place.sides)
      if (side.body != kWorld) bodies = std::max(bodies, side.body + 1);
  spun_.assign(bodies, Vec3::Zero());
}

JointSystem::Frame JointSystem::frame(const Place& place, std::size_t side, const Pose& pose) const {
  Frame frame;
  const Vec3& centre = place.sides[side].centre;
  frame.centre = centre + pose.translation;
  frame.at = frame.centre + pose.rotation * (place.joint.at - centre);
  if (place.joint.kind == JointKind::ball) return frame;
  const auto [first, second] = directions_across(place.joint.axis);
  frame.axis = pose.rotation * place.joint.axis;
  frame.first = pose.rotation * first;
  frame.second = pose.rotation * second;
  return frame;
}

Pose JointSystem::pose_of(std::span<const JointedBody> bodies, const Side& side, bool next) {
  if (side.body == kWorld) return {};
  return next ? bodies[side.body].next : bodies[side.body].body->pose;
}

// How far the joints are from holding [m], motors left out.
VectorXd JointSystem::misfit(std::span<const JointedBody> bodies, bool next) const {
  std::vector<double> values;
  for (const Place& place : places_) {
    const Frame a = frame(place, 0, pose_of(bodies, place.sides[0], next));
    const Frame b = frame(place, 1, pose_of(bodies, place.sides[1], next));
    const Vec3 apart = b.at - a.at;
    const JointKind kind = place.joint.kind;
    if (kind == JointKind::slider)
      values.insert(values.end(), {a.first.dot(apart), a.second.dot(apart), size_ * a.first.dot(b.second)});
    else
      values.insert(values.end(), apart.begin(), apart.end());
    if (kind != JointKind::ball)
      values.insert(values.end(), {size_ * a.first.dot(b.axis), size_ * a.second.dot(b.axis)});
  }
  return Eigen::Map<VectorXd>(values.data(), static_cast<Index>(values.size()));
}

// Derivatives of misfit() at the present poses; those of motors come last.
JointSystem::Rows JointSystem::rows(std::span<const JointedBody> bodies, bool motors) const {
  Rows made;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const Place& place = places_[p];
    const Frame a = frame(place, 0, pose_of(bodies, place.sides[0], false));
    const Frame b = frame(place, 1, pose_of(bodies, place.sides[1], false));
    const auto along = [&](const Vec3& direction) {
      made.row.push_back({p,
                          {-direction, direction},
                          {-(b.at - a.centre).cross(direction), (b.at - b.centre).cross(direction)},
                          false});
    };
    const auto about = [&](const Vec3& of_first, const Vec3& of_second) {
      const Vec3 turn = size_ * of_first.cross(of_second);
      made.row.push_back({p, {Vec3::Zero(), Vec3::Zero()}, {turn, -turn}, false});
    };
    const JointKind kind = place.joint.kind;
    if (kind == JointKind::slider) {
      along(a.first);
      along(a.second);
      about(a.first, b.second);
    } else {
      for (Index axis = 0; axis < 3; ++axis) along(Vec3::Unit(axis));
    }
    if (kind == JointKind::ball) continue;
    about(a.first, b.axis);
    about(a.second, b.axis);
  }
  for (std::size_t p = 0; motors && p < places_.size(); ++p) {
    if (!has_speed(places_[p].joint)) continue;
    const Vec3 axis = frame(places_[p], 1, pose_of(bodies, places_[p].sides[1], false)).axis;
    made.row.push_back({p, {Vec3::Zero(), Vec3::Zero()}, {size_ * axis, -size_ * axis}, true});
  }
  const auto count = static_cast<Index>(made.row.size());
  made.matrix = MatrixXd::Zero(count, count);
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j <= i; ++j) {
      const Rows::Row &one = made.row[static_cast<std::size_t>(i)],
                      &other = made.row[static_cast<std::size_t>(j)];
      double sum = 0;
      for (std::size_t s = 0; s < 2; ++s)
        for (std::size_t t = 0; t < 2; ++t) {
          const std::size_t body = places_[one.place].sides[s].body;
          if (body == kWorld || body != places_[other.place].sides[t].body || bodies[body].led) continue;
          sum += one.push[s].dot(other.push[t]) / bodies[body].body->mass +
                 one.turn[s].dot(inverse_inertia_now(*bodies[body].body) * other.turn[t]);
        }
      made.matrix(i, j) = made.matrix(j, i) = sum;
    }
  return made;
}

// Angle of the first side against the second, of those that differ by whole turns the one next to `near`; or how far the
// first has slid.
double JointSystem::travelled(const Place& place, const Frame& first, const Frame& second,
                              double near) const {
  if (place.joint.kind == JointKind::ball) return 0;
  if (place.joint.kind == JointKind::slider) return first.axis.dot(first.at - second.at);
  const double angle =
      std::atan2(second.axis.dot(second.first.cross(first.first)), second.first.dot(first.first));
  constexpr double kWhole = 2 * std::numbers::pi;
  return angle + kWhole * std::round((near - angle) / kWhole);
}

void JointSystem::begin(std::span<JointedBody> bodies, bool fresh) {
  const VectorXd apart = misfit(bodies, false);
  Index row = 0;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const Place& place = places_[p];
    const auto own = static_cast<Index>(row_count(place.joint));
    if (const double most = apart.segment(row, own).cwiseAbs().maxCoeff(); !(most <= kApartAtStart * size_))
      throw InputError(
          place.joint.origin,
          fmt::format("joint \"{}\" does not hold where the run begins, by {}: its parts were moved "
                      "against each other since they rested; take a body that was not, or one that "
                      "a run with this joint left",
                      place.joint.name, human_length(most)));
    row += own;
    refuse_turned_over(place, bodies);
    travel_[p] = travelled(place, frame(place, 0, pose_of(bodies, place.sides[0], false)),
                           frame(place, 1, pose_of(bodies, place.sides[1], false)), travel_[p]);
  }
  refuse_locked(bodies);
  if (fresh) refuse_speeds(bodies);
}

// Axes that point against each other, or a slider turned by half a turn, hold too.
void JointSystem::refuse_turned_over(const Place& place, std::span<const JointedBody> bodies) const {
  const Frame a = frame(place, 0, pose_of(bodies, place.sides[0], false)),
              b = frame(place, 1, pose_of(bodies, place.sides[1], false));
  if (a.axis.dot(b.axis) < 0 || (place.joint.kind == JointKind::slider && a.first.dot(b.first) < 0))
    throw InputError(
        place.joint.origin,
        fmt::format("joint \"{}\" is turned over where the run begins: one of its parts was led by half a "
                    "turn against the other since they rested; take a body in which it was not",
                    place.joint.name));
}

// By groups of parts that joints tie together, without the world and what is led.
void JointSystem::refuse_locked(std::span<const JointedBody> bodies) const {
  std::vector<std::size_t> group(bodies.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto is_free = [&](const Side& side) { return side.body != kWorld && !bodies[side.body].led; };
  for (std::size_t pass = 0; pass < places_.size(); ++pass)
    for (const Place& place : places_)
      if (is_free(place.sides[0]) && is_free(place.sides[1]))
        group[place.sides[0].body] = group[place.sides[1].body] =
            std::min(group[place.sides[0].body], group[place.sides[1].body]);
  const Rows all = rows(bodies, false);
  for (std::size_t g = 0; g < bodies.size(); ++g) {
    std::vector<Index> own;
    std::size_t parts = 0;
    const Joint* last = nullptr;
    for (std::size_t b = 0; b < bodies.size(); ++b) parts += group[b] == g && !bodies[b].led;
    for (std::size_t i = 0; i < all.row.size(); ++i)
      for (const Side& side : places_[all.row[i].place].sides)
        if (is_free(side) && group[side.body] == g && (own.empty() || own.back() != static_cast<Index>(i))) {
          own.push_back(static_cast<Index>(i));
          last = &places_[all.row[i].place].joint;
        }
    if (own.empty()) continue;
    const VectorXd values = eigenvalues_symmetric(all.matrix(own, own));
    const auto held = static_cast<std::size_t>((values.array() > kSameTwice * values.maxCoeff()).count());
    if (held < 6 * parts) continue;
    throw InputError(last->origin,
                     fmt::format("joint \"{}\" and those before it leave nothing to move: leave one of them "
                                 "out, or lead the part with a [[manipulator]], which without a path stays",
                                 last->name));
  }
}

// The velocities nearest to those given, by the masses, that the joints allow.
void JointSystem::refuse_speeds(std::span<JointedBody> bodies) const {
  const Rows all = rows(bodies, false);
  VectorXd speeds = VectorXd::Zero(all.matrix.rows());
  double before = 0, after = 0;
  for (Index i = 0; i < speeds.size(); ++i) {
    const Rows::Row& row = all.row[static_cast<std::size_t>(i)];
    for (std::size_t s = 0; s < 2; ++s) {
      const std::size_t b = places_[row.place].sides[s].body;
      if (b == kWorld) continue;
      const RigidBody& body = *bodies[b].body;
      speeds[i] += row.push[s].dot(bodies[b].momentum) / body.mass +
                   row.turn[s].dot(angular_velocity(body, body.pose.rotation, bodies[b].spin));
    }
  }
  for (const JointedBody& each : bodies)
    before += each.led ? 0 : kinetic(*each.body, each.momentum, each.spin);
  MatrixXd matrix = all.matrix;
  matrix.diagonal().array() += kHeldTwice * matrix.trace() / static_cast<double>(matrix.rows());
  const VectorXd impulses = -CholeskyFactor(matrix).solve(speeds);
  push(bodies, all, impulses);  // of what is led nobody asks
  for (const JointedBody& each : bodies)
    after += each.led ? 0 : kinetic(*each.body, each.momentum, each.spin);
  if (before - after > kMostStopped * before)
    throw InputError(
        places_.front().joint.origin,
        fmt::format(
            "joints would stop {:.0f} % of the kinetic energy that their parts begin with: give all of "
            "them velocities that the joints allow, such as one [[velocity]] with a spin about the axis",
            100 * (before - after) / before));
}

// That of the poses after a step, with what motors miss of their speed.
VectorXd JointSystem::misfit_of_step(std::span<const JointedBody> bodies, const Rows& all,
                                     double drift) const {
  VectorXd values(static_cast<Index>(all.row.size()));
  const VectorXd held = misfit(bodies, true);
  values.head(held.size()) = held;
  for (Index i = held.size(); i < values.size(); ++i) {
    const std::size_t p = all.row[static_cast<std::size_t>(i)].place;
    const Place& place = places_[p];
    const double wanted = travel_[p] + *place.joint.speed * drift;
    const Frame a = frame(place, 0, pose_of(bodies, place.sides[0], true)),
                b = frame(place, 1, pose_of(bodies, place.sides[1], true));
    values[i] = size_ * (travelled(place, a, b, wanted) - wanted);
  }
  return values;
}

void JointSystem::push(std::span<JointedBody> bodies, const Rows& all, const VectorXd& impulses) const {
  for (Index i = 0; i < impulses.size(); ++i) {
    const Rows::Row& row = all.row[static_cast<std::size_t>(i)];
    for (std::size_t s = 0; s < 2; ++s) {
      const std::size_t b = places_[row.place].sides[s].body;
      if (b == kWorld) continue;
      bodies[b].momentum += impulses[i] * row.push[s];
      bodies[b].spin += impulses[i] * row.turn[s];
    }
  }
}

// Adds to `impulses` those of the rows that are `open` under which all of these hold after the step.
void JointSystem::find(std::span<JointedBody> bodies, const Rows& all, const std::vector<Index>& open,
                       double drift, VectorXd& impulses) const {
  MatrixXd matrix = drift * all.matrix(open, open);
  matrix.diagonal().array() += kHeldTwice * matrix.trace() / static_cast<double>(matrix.rows());
  const CholeskyFactor factor(matrix);
  double before = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kJointRounds; ++round) {
    for (JointedBody& each : bodies)
      if (!each.led) each.next = drifted(*each.body, each.momentum, each.spin, drift);
    const VectorXd apart = misfit_of_step(bodies, all, drift)(open);
    const double now = apart.cwiseAbs().maxCoeff();
    if (now <= kHolds * size_ || (now <= kHoldsStill * size_ && now > 0.5 * before)) return;
    before = now;
    VectorXd more = VectorXd::Zero(impulses.size());
    more(open) = -factor.solve(apart);
    push(bodies, all, more);
    impulses += more;
  }
  throw DivergedError(fmt::format(
      "joints, \"{}\" among them, cannot hold their parts together over a step of {:.3g} s: give a "
      "shorter [run] step, or look whether the mechanism jams",
      places_.front().joint.name, drift));
}

namespace {

// How much faster a motor is to turn [rad/s].
double missing_speed(const JointSystem::Place& place, const Vec3& axis, std::span<const JointedBody> bodies) {
  double missing = *place.joint.speed;
  for (std::size_t s = 0; s < 2; ++s)
    if (const std::size_t b = place.sides[s].body; b != JointSystem::kWorld)
      missing += (s == 0 ? -1 : 1) *
                 axis.dot(angular_velocity(*bodies[b].body, bodies[b].body->pose.rotation, bodies[b].spin));
  return missing;
}

}  // namespace

// Motors that would need more than their couple get that, and turn slower; so where the joints do not let them have their
// speed at all, as at a dead centre. Those that stalled in the last step are first taken to do so again, unless that made
// them faster than they are to turn: where the joints hold them, all rounds would be spent on finding that out.
VectorXd JointSystem::hold(std::span<JointedBody> bodies, const Rows& all, double kick, double drift) {
  const std::vector<JointedBody> start(bodies.begin(), bodies.end());
  VectorXd given = VectorXd::Zero(static_cast<Index>(all.row.size()));
  const auto most = [&](Index i) {
    return *places_[all.row[static_cast<std::size_t>(i)].place].joint.torque * kick / size_;
  };
  for (Index i = 0; i < given.size(); ++i)
    if (const Rows::Row& row = all.row[static_cast<std::size_t>(i)]; row.drives && stalled_[row.place] != 0)
      given[i] = stalled_[row.place] * most(i);
  bool guessed = !given.isZero(0);
  std::vector<Index> open;
  const auto open_rest = [&] {
    open.clear();
    for (Index i = 0; i < given.size(); ++i)
      if (given[i] == 0) open.push_back(i);
  };
  open_rest();
  for (;;) {
    std::copy(start.begin(), start.end(), bodies.begin());
    push(bodies, all, given);
    VectorXd impulses = given;
    std::exception_ptr unheld;
    try {
      find(bodies, all, open, drift, impulses);
    } catch (const DivergedError&) {
      unheld = std::current_exception();
    }
    if (std::exchange(guessed, false) && (unheld || is_too_fast(bodies, all, given, drift))) {
      given.setZero();
      open_rest();
      continue;
    }
    const std::size_t rows_open = open.size();
    for (const Index i : open) {
      const Rows::Row& row = all.row[static_cast<std::size_t>(i)];
      const Place& place = places_[row.place];
      if (!row.drives || !place.joint.torque || !(unheld || std::abs(impulses[i]) > most(i))) continue;
      given[i] =
          std::copysign(most(i), unheld ? missing_speed(place, row.turn[0] / size_, start) : impulses[i]);
    }
    open_rest();
    if (open.size() < rows_open) continue;
    if (unheld) std::rethrow_exception(unheld);
    for (Index i = 0; i < given.size(); ++i)
      if (const Rows::Row& row = all.row[static_cast<std::size_t>(i)]; row.drives)
        stalled_[row.place] = given[i] == 0 ? 0 : std::copysign(1.0, given[i]);
    return impulses;
  }
}

// Whether a motor that gets its couple turns further, the way that it drives, than it is to.
bool JointSystem::is_too_fast(std::span<const JointedBody> bodies, const Rows& all, const VectorXd& given,
                              double drift) const {
  const VectorXd missed = misfit_of_step(bodies, all, drift);
  for (Index i = 0; i < given.size(); ++i)
    if (given[i] * missed[i] > 0) return true;
  return false;
}

void JointSystem::tell(std::span<const JointedBody> bodies, const Rows& all, const VectorXd& impulses,
                       double kick) {
  on_led_.assign(bodies.size(), {Vec3::Zero(), Vec3::Zero()});
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const Place& place = places_[p];
    reactions_[p] = {};
    if (place.joint.kind == JointKind::motor && !place.joint.speed) reactions_[p].drive = *place.joint.torque;
    const Frame a = frame(place, 0, pose_of(bodies, place.sides[0], true)),
                b = frame(place, 1, pose_of(bodies, place.sides[1], true));
    const double turned = has_speed(place.joint) ? *place.joint.speed * kick : 0;
    reactions_[p].travel = travel_[p];
    travel_[p] = travelled(place, a, b, travel_[p] + turned);
  }
  for (Index i = 0; i < impulses.size(); ++i) {
    const Rows::Row& row = all.row[static_cast<std::size_t>(i)];
    const Place& place = places_[row.place];
    Reaction& told = reactions_[row.place];
    const Frame a = frame(place, 0, pose_of(bodies, place.sides[0], false));
    const Vec3 push = impulses[i] / kick * row.push[0], turn = impulses[i] / kick * row.turn[0];
    told.force += push;
    told.torque += turn - (a.at - a.centre).cross(push);
    if (row.drives) told.drive = size_ * impulses[i] / kick;
    for (std::size_t s = 0; s < 2; ++s) {
      borne_[2 * row.place + s] += impulses[i] * row.push[s];
      const std::size_t body = place.sides[s].body;
      if (body == kWorld || !bodies[body].led) continue;
      on_led_[body][0] += impulses[i] / kick * row.push[s];
      on_led_[body][1] += impulses[i] / kick * row.turn[s];
    }
  }
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const Place& place = places_[p];
    if (place.joint.kind != JointKind::motor || place.joint.speed) continue;
    const Vec3 couple = *place.joint.torque * frame(place, 1, pose_of(bodies, place.sides[1], false)).axis;
    reactions_[p].torque += couple;
    for (std::size_t s = 0; s < 2; ++s)
      if (const std::size_t body = place.sides[s].body; body != kWorld && bodies[body].led)
        on_led_[body][1] += s == 0 ? couple : Vec3(-couple);
  }
}

JointSystem::Power JointSystem::powers(std::span<const JointedBody> bodies,
                                       const std::vector<Velocity>& velocities) const {
  Power power;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const Place& place = places_[p];
    if (place.joint.kind != JointKind::motor) continue;
    Vec3 turning = Vec3::Zero();
    for (std::size_t s = 0; s < 2; ++s)
      if (const std::size_t body = place.sides[s].body; body != kWorld)
        turning += s == 0 ? velocities[body][1] : Vec3(-velocities[body][1]);
    power.motors +=
        reactions_[p].drive * frame(place, 1, pose_of(bodies, place.sides[1], false)).axis.dot(turning);
  }
  for (std::size_t b = 0; b < bodies.size(); ++b)
    power.supports -= on_led_[b][0].dot(velocities[b][0]) + on_led_[b][1].dot(velocities[b][1]);
  return power;
}

void JointSystem::advance(std::span<JointedBody> bodies, double kick, double drift) {
  std::vector<Velocity> first, last;  // before the impulses and after
  for (const JointedBody& each : bodies)
    first.push_back({each.body->momentum / each.body->mass,
                     angular_velocity(*each.body, each.body->pose.rotation, each.body->spin)});
  for (const Place& place : places_) {  // couples that are given
    if (place.joint.kind != JointKind::motor || place.joint.speed) continue;
    const Vec3 turn =
        kick * *place.joint.torque * frame(place, 1, pose_of(bodies, place.sides[1], false)).axis;
    for (std::size_t s = 0; s < 2; ++s)
      if (place.sides[s].body != kWorld) bodies[place.sides[s].body].spin += s == 0 ? turn : Vec3(-turn);
  }
  const Rows all = rows(bodies, true);
  const VectorXd impulses = hold(bodies, all, kick, drift);
  tell(bodies, all, impulses, kick);
  for (const JointedBody& each : bodies) {
    const Pose& pose = each.body->pose;
    if (each.led)
      last.push_back({(each.next.translation - pose.translation) / drift,
                      turn_of(each.next.rotation * pose.rotation.transpose()) / drift});
    else
      last.push_back(
          {each.momentum / each.body->mass, angular_velocity(*each.body, pose.rotation, each.spin)});
  }
  before_ = powers(bodies, first);
  after_ = powers(bodies, last);
  if (steps_ < kFirstSteps && ++steps_ == 1) forget_rates();  // a jolt may be in the first
  fastest_ = 0;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (bodies[b].led || b >= spun_.size()) continue;
    fastest_ = std::max(fastest_, last[b][1].norm());
    if (steps_ > 1) spun_[b] += last[b][1] - first[b][1];
  }
  if (steps_ > 1) lasted_ += kick;
}

void JointSystem::forget_rates() {
  for (std::vector<Vec3>* rates : {&borne_, &spun_}) std::fill(rates->begin(), rates->end(), Vec3::Zero());
  lasted_ = 0;
}

double JointSystem::frequency(std::span<const RigidBody* const> bodies) {
  double rate = fastest_;
  for (std::size_t i = 0; i < borne_.size() && lasted_ > 0; ++i) {
    const Place& place = places_[i / 2];
    const Side& side = place.sides[i % 2];
    if (side.body == kWorld) continue;
    const RigidBody& body = *bodies[side.body];
    const double arm = (place.joint.at - side.centre).norm();
    const double inertia = 1 / body.inverse_inertia.norm() + body.mass * arm * arm;
    rate = std::max(rate, std::sqrt(borne_[i].norm() / lasted_ * arm / inertia));
  }
  for (const Vec3& each : spun_)
    if (lasted_ > 0) rate = std::max(rate, std::sqrt(kJointTurn * each.norm() / lasted_));
  if (lasted_ > 0) {
    rate_ = std::max(rate_, rate);  // a step that came and went with each swing would cost energy
    forget_rates();
  }
  if (steps_ < kFirstSteps) return 0;
  const double longest = std::min(duration_ / kLeastSteps, kJointTurn / rate_);
  return 4 / (longest * longest);
}

double JointSystem::first_step() const {
  return steps_ < kFirstSteps ? kFirstLength * duration_ : std::numeric_limits<double>::infinity();
}

std::vector<double> JointSystem::memory() const {
  std::vector<double> memory = travel_;
  memory.insert(memory.end(), stalled_.begin(), stalled_.end());
  for (const std::vector<Vec3>* rates : {&borne_, &spun_})
    for (const Vec3& each : *rates) memory.insert(memory.end(), each.begin(), each.end());
  for (const Reaction& each : reactions_) {
    memory.insert(memory.end(), each.force.begin(), each.force.end());
    memory.insert(memory.end(), each.torque.begin(), each.torque.end());
    memory.push_back(each.travel);
    memory.push_back(each.drive);
  }
  for (const double each : {lasted_, fastest_, rate_, static_cast<double>(steps_)}) memory.push_back(each);
  return memory;
}

bool JointSystem::restore(const std::vector<double>& memory) {
  if (memory.size() != 2 * travel_.size() + 3 * (borne_.size() + spun_.size()) + 8 * reactions_.size() + 4)
    return false;
  const double* from = memory.data();
  const auto take = [&](auto& values) {
    std::copy(from, from + values.size(), values.begin());
    from += values.size();
  };
  take(travel_);
  take(stalled_);
  for (std::vector<Vec3>* rates : {&borne_, &spun_})
    for (Vec3& each : *rates) take(each);
  for (Reaction& each : reactions_) {
    take(each.force);
    take(each.torque);
    each.travel = *from++;
    each.drive = *from++;
  }
  for (double* each : {&lasted_, &fastest_, &rate_}) *each = *from++;
  steps_ = static_cast<int>(*from);
  return true;
}

}  // namespace flexel::simulate
