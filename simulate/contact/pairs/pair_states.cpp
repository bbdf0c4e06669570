// Pairs are evaluated in parallel and alone; only those that an initial penetration brings near wait for the
// others (OverlapRelease::admit).
#include "simulate/contact/pairs/pair_states.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace flexel::simulate {
namespace {

constexpr double kSoftSteps = 2;       // in which an impact goes through the soft part of the contact law
constexpr double kFarthestSoft = 0.4;  // spacings, at most, of that part: two steps of contact_step_bound.cpp
constexpr double kHardening = 0.001;   // a step, of what rests: the share of its extra softness that goes
constexpr double kHardened = 1.01;     // of the least softness, at which that is over
constexpr double kNoTurn = 1e-9;       // of a body in a step
constexpr double kShapelessEntry = 0.05;  // spacings; most penetration with which shapeless points approach

}  // namespace

PairStates::PairStates(const ContactSettings& settings, const ContactSurface& surface, const PairList& list,
                       PairMemory& memory, OverlapRelease& release)
    : settings_(settings),
      surface_(surface),
      list_(list),
      memory_(memory),
      release_(release),
      cells_(surface) {}

void PairStates::reset() {
  states_.assign(list_.pairs().size(), PairState{});
  is_active_.assign(list_.pairs().size(), 0);
  active_.clear();
  points_.resize(list_.points().size());
  point_evaluation_.assign(points_.size(), 0);
  const auto planes = static_cast<std::uint32_t>(surface_.body().parts.size());
  std::vector<PairSchedule::Bodies> bodies;
  for (const ContactPair& pair : list_.pairs())
    bodies.push_back({list_.point(pair.i).part, pair.of_plane() ? planes : list_.point(pair.j).part});
  schedule_.reset(bodies, planes + 1, surface_.narrowest());
  moved_from_.clear();
  cells_.reset(list_);
  shapes_.resize(cells_.cells().size());
  shape_evaluation_.assign(cells_.cells().size(), 0);
}

// Since the last evaluation; without one in this list, none. The common way is that of the middle of all.
std::span<const BodyMotion> PairStates::motion_to(const State& state) {
  const std::vector<Part>& parts = surface_.body().parts;
  if (moved_from_.size() != list_.elements().size()) {
    moved_from_.resize(list_.elements().size());
    gather(list_.runs(), state.displacement, moved_from_);
    return {};
  }
  moves_.resize(moved_from_.size());
  of_body_.assign(parts.size(), {});
  for (const ElementRun& run : list_.runs()) {
    using Values = Eigen::ArrayXd;
    const Eigen::Index count = 3 * static_cast<Eigen::Index>(run.count);
    const Eigen::Map<const Values> now(state.displacement[run.first].data(), count);
    Eigen::Map<Values> before(moved_from_[run.place].data(), count);
    Eigen::Map<Values>(moves_[run.place].data(), count) = now - before;
    before = now;
    of_body_[run.part].add({&moves_[run.place], run.count});
  }
  motions_.assign(parts.size() + 1, {});
  Box all;
  for (std::size_t b = 0; b < motions_.size(); ++b) {
    const Box box = body_box(b);
    if (!box.empty()) all.add(box.min), all.add(box.max);
  }
  const Vec3 middle = 0.5 * (all.min + all.max);
  for (std::size_t b = 0; b < motions_.size(); ++b) {
    const Box box = body_box(b);
    if (box.empty()) continue;
    motions_[b].path = (box.max - middle).cwiseAbs().cwiseMax((box.min - middle).cwiseAbs()).norm();
    motions_[b].spread = 0.5 * box.diagonal();
  }
  for (const CarryingCell& cell : cells_.cells()) {
    BodyMotion& motion = motions_[cell.part];
    // |dF| is at most sqrt(3) times the moves' diagonal over the spacing: cells of what hardly deforms are skipped
    const double most = 3.5 * motion.spread / parts[cell.part].lattice.spacing.minCoeff();
    if (!cell.deforms() || most <= std::max(motion.turn, kNoTurn)) continue;
    motion.turn = std::max(motion.turn, cells_.gradient_norm(cell, moves_));
  }
  for (BodyMotion& motion : motions_) motion.turn = std::max(motion.turn, motion.spread > 0 ? kNoTurn : 0);
  return motions_;
}

// m, of the moves of a part or, behind them, of the planes.
Box PairStates::body_box(std::size_t body) const {
  if (body < of_body_.size()) return of_body_[body].box();
  Box box;
  if (!settings_.planes.empty()) box.add(Vec3::Zero());
  return box;
}

bool PairStates::is_at(const State& state) const {
  return evaluated_builds_ == list_.builds() && moved_from_.size() == list_.elements().size() &&
         same_bits(list_.runs(), state.displacement, moved_from_);
}

void PairStates::update(const State& state, bool all) {
  const bool same = release_.is_at(state) && is_at(state);
  if (same && (!all || evaluated_all_)) return;
  ++evaluations_;
  evaluated_builds_ = list_.builds();
  const std::span<const BodyMotion> motions = motion_to(state);
  // what is released presses at other depths from step to step
  const bool releases = release_.enabled() || release_.known_parts() < surface_.body().parts.size();
  evaluated_all_ = all || releases || motions.empty();
  if (evaluated_all_)
    schedule_.wake_all();
  else
    schedule_.advance(motions);
  find_points();
  if (release_.known_parts() < surface_.body().parts.size()) find_initial_penetrations(state);
  const std::vector<double> before = release_.advance(state);
  for (const std::uint32_t p : active_) is_active_[p] = states_[p].pressure > 0 ? kWasPressed : 0;
  admit(evaluate_pairs());
  for (const std::uint32_t p : active_)
    if (is_active_[p] == kWasPressed) is_active_[p] = 0;
  active_.clear();
  for (const std::uint32_t p : schedule_.awake())
    if (is_active_[p]) active_.push_back(p);
  release_.enter_energy(before, active_, states_, memory_);
}

// Of the pairs that are awake.
void PairStates::find_points() {
  wanted_points_.clear();
  wanted_cells_.clear();
  const auto want = [&](std::uint32_t point) {
    if (std::exchange(point_evaluation_[point], evaluations_) == evaluations_) return;
    wanted_points_.push_back(point);
    const std::uint32_t cell = cells_.points()[point].cell;
    if (std::exchange(shape_evaluation_[cell], evaluations_) != evaluations_) wanted_cells_.push_back(cell);
  };
  for (const std::uint32_t p : schedule_.awake()) {
    const ContactPair& pair = list_.pairs()[p];
    want(pair.i);
    if (!pair.of_plane()) want(pair.j);
  }
  parallel_for_each(
      wanted_cells_.size(),
      [&](std::size_t n) {
        const std::uint32_t c = wanted_cells_[n];
        const CarryingCell& cell = cells_.cells()[c];
        shapes_[c] = surface_.shape_at(list_.points()[cell.point],
                                       cell.deforms() ? cells_.gradient(c, moved_from_) : Mat3(Mat3::Zero()));
      },
      512);
  parallel_for_each(
      wanted_points_.size(),
      [&](std::size_t n) {
        const std::uint32_t point = wanted_points_[n];
        points_[point] = surface_.at(list_.points()[point], cells_.at_point(point, moved_from_),
                                     shapes_[cells_.points()[point].cell]);
      },
      512);
}

// Of the pairs that are awake. Returns (pairs; empty without release) 1 for those that come near inside each
// other during a release; they are not evaluated yet.
std::vector<std::uint8_t> PairStates::evaluate_pairs() {
  const std::vector<ContactPair>& pairs = list_.pairs();
  const std::vector<std::uint32_t>& awake = schedule_.awake();
  std::vector<std::uint8_t> entering(release_.share_count() == 0 ? 0 : pairs.size(), 0);
  parallel_for_each(
      awake.size(),
      [&](std::size_t n) {
        const std::uint32_t p = awake[n];
        PairRecord& record = memory_[p];
        if (is_active_[p] == kWasPressed) {  // it cannot sleep
          schedule_.keep_awake(p);
          set(p, evaluate(pairs[p], release_.allowed(pairs[p], record), record.soft));
          return;
        }
        const PairProximity proximity = pair_proximity(pairs[p], record);
        const bool sleeps = schedule_.sleep(p, proximity.safe);
        if (!proximity.near || (sleeps && !evaluated_all_)) {
          if (frozen_) return;
          record.phase = proximity.near ? PairPhase::approaching : PairPhase::separated;
          record.soft = 0;
          return;
        }
        const PairState now = evaluate(pairs[p], release_.allowed(pairs[p], record), record.soft);
        const bool enters = now.near && !now.deep && now.gap < 0 && record.phase == PairPhase::separated;
        if (enters && record.penetration == 0 && release_.is_releasing(pairs[p]))
          entering[p] = 1;
        else
          set(p, now);
      },
      256);
  return entering;
}

void PairStates::admit(const std::vector<std::uint8_t>& entering) {
  std::vector<std::uint32_t> pairs;
  std::vector<double> depths;
  for (std::uint32_t p = 0; p < entering.size(); ++p)
    if (entering[p]) {
      pairs.push_back(p);
      depths.push_back(-evaluate(list_.pairs()[p], 0, 0).gap);
    }
  if (pairs.empty()) return;
  release_.admit(pairs, depths, memory_);
  for (const std::uint32_t p : pairs)
    set(p, evaluate(list_.pairs()[p], release_.allowed(list_.pairs()[p], memory_[p]), memory_[p].soft));
}

// In the first state; after an event, of the parts that have joined.
void PairStates::find_initial_penetrations(const State& state) {
  const std::size_t known = release_.known_parts();
  release_.add_parts(state.time.value_or(0));
  if (!release_.enabled()) return;
  parallel_for_each(
      list_.pairs().size(),
      [&](std::size_t p) {
        const ContactPair& pair = list_.pairs()[p];
        const std::uint32_t i = list_.point(pair.i).part;
        if (std::max(i, pair.of_plane() ? i : list_.point(pair.j).part) < known) return;
        const PairState now = evaluate(pair, 0, 0);
        if (now.near && !now.deep) memory_[p].penetration = std::max(-now.gap, 0.0);
      },
      512);
}

void PairStates::set(std::size_t pair, PairState now) {
  PairPhase phase = memory_[pair].phase;
  const bool passed = frozen_ && now.near && now.deep && phase == PairPhase::approaching;
  if (!passed) update_phase(list_.pairs()[pair], now, phase);
  states_[pair] = now;
  is_active_[pair] = now.near;
  if (frozen_) return;
  memory_[pair].phase = phase;
  if (!now.near) memory_[pair].soft = 0;
}

// The phase after the state `now`; a penetrated pair has none.
void PairStates::update_phase(const ContactPair& pair, PairState& now, PairPhase& phase) const {
  if (!now.near) {
    phase = PairPhase::separated;
  } else if (now.deep) {
    phase = PairPhase::penetrated;
  } else if (now.gap >= 0) {
    phase = PairPhase::approaching;
  } else if (phase == PairPhase::separated) {
    const PairConstants& constants = pair.properties.constants;
    double entry = constants.law.hard;
    if (points_[pair.i].shapeless || (!pair.of_plane() && points_[pair.j].shapeless))
      entry = pair.of_plane() ? 0 : kShapelessEntry * constants.width;
    phase = -now.gap > entry ? PairPhase::penetrated : PairPhase::approaching;
  }
  if (phase == PairPhase::penetrated) now = {};
}

ContactSide PairStates::other_side(const ContactPair& pair) const {
  if (!pair.of_plane()) return points_[pair.j].side;
  const ContactPlane& plane = settings_.planes[pair.plane];
  const Vec3& from = points_[pair.i].side.position;
  return {from - (from - plane.point).dot(plane.normal) * plane.normal, plane.normal, 1, 0};
}

ContactSide PairStates::own_side(const ContactPair& pair) const {
  ContactSide from = points_[pair.i].side;
  if (pair.of_plane()) from.own_plane = 0;  // the plane's normal is the exact one
  return from;
}

Vec3 PairStates::velocity(std::uint32_t point, const State& state) const {
  const InterpolationWeights& at = list_.point(point).at;
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t a = 0; a < at.count; ++a) sum += at.weights[a] * state.velocity[at.elements[a]];
  return sum;
}

// m, of the soft part of a pair in the steps to come, or 0: that of the law. A pair that will press within
// kSoftSteps gets one as wide as its way in them, but does not press where it is. One that is pressed keeps its
// own, for the energy it has stored is of that, and hardens slowly as it rests. It depends on the present state
// alone, for which pairs sleep a run that goes on from a checkpoint need not know.
double PairStates::softness_after(std::size_t p, const State& state, double drift) const {
  const PairState& now = states_[p];
  const ContactPair& pair = list_.pairs()[p];
  const double least = pair.properties.constants.law.soft;
  if (now.pressure > 0) {
    const double soft = memory_[p].soft - kHardening * (memory_[p].soft - least);
    return soft < kHardened * least ? 0 : soft;
  }
  Vec3 nearing = velocity(pair.i, state);
  if (!pair.of_plane()) nearing -= velocity(pair.j, state);
  const double way = kSoftSteps * drift * nearing.dot(now.normal);
  if (now.gap > way) return 0;
  const double most = std::min(least + 2 * std::max(now.gap, 0.0), kFarthestSoft * list_.point(pair.i).width);
  return std::min(way, most) > least ? std::min(way, most) : 0;
}

void PairStates::finish_step(const State& state, double drift) {
  lost_.assign(active_.size(), 0);
  parallel_for_each(
      active_.size(),
      [&](std::size_t n) {
        const std::uint32_t p = active_[n];
        const double soft = softness_after(p, state, drift);
        if (soft > 0) schedule_.keep_awake(p);  // it presses sooner than it was judged by
        if (soft == memory_[p].soft) return;
        memory_[p].soft = soft;
        const double before = states_[p].energy;
        const ContactPair& pair = list_.pairs()[p];
        press(states_[p], own_side(pair), other_side(pair), pair.properties.constants.law.softened(soft));
        lost_[n] = before - states_[p].energy;
      },
      512);
  for (const double each : lost_) hardened_ += each;
}

// In the terms of pair_law.h. Beside a common way points go by at most kPoint times their bodies' paths; normals
// change by at most |F^-1| times their bodies' turns, and the direction of contact, the mean of both, by twice
// the larger of these over its length. Gap, offset and facing change accordingly; half of what there is may be
// used up by either. kBounds covers that F^-1 changes meanwhile, by turns up to kMostTurn over it: integral of
// dx / (1 - x) < kBounds x. What has no sure normal is known by its distance alone.
PairStates::PairProximity PairStates::pair_proximity(const ContactPair& pair,
                                                     const PairRecord& record) const {
  constexpr double kRounding = 1e-9, kPoint = 1.2, kBounds = 1.5, kMostTurn = 0.3;
  const PairConstants& constants = pair.properties.constants;
  const ContactSide i = own_side(pair), j = other_side(pair);
  const double rate_i = points_[pair.i].normal_rate,
               rate_j = pair.of_plane() ? 0 : points_[pair.j].normal_rate, fastest = std::max(rate_i, rate_j);
  const Vec3 d = j.position - i.position, b = i.own_plane * i.normal - j.own_plane * j.normal;
  const double distance = d.norm(), length = b.norm(), width = constants.width;
  PairProximity found;
  const auto bear = [&](double margin, double rate) {
    if (!std::isfinite(rate)) return;
    const SafeMotion safe =
        rate > 0 ? SafeMotion{0.5 * margin / kPoint, std::min(0.5 * margin / rate, kMostTurn / fastest)}
                 : SafeMotion{margin / kPoint};
    if (std::min(safe.path, safe.turn) > std::min(found.safe.path, found.safe.turn)) found.safe = safe;
  };
  // what can stick begins to at that gap
  const double pressed =
      constants.law.softened(record.soft).ahead + (pair.properties.pull_off > 0 ? constants.law.soft : 0);
  const double far = std::max(width, constants.limit);
  if (width > 0) bear(distance - std::sqrt(width * width + far * far), 0);
  if (i.radius > 0 && j.radius > 0) {
    bear(distance - i.radius - j.radius - pressed, 0);
  } else if (length > 0) {
    const double along = d.dot(b) / length;
    const double turning = std::max(i.own_plane > 0 ? rate_i : 0, j.own_plane > 0 ? rate_j : 0);
    // of a pair of points the other one may get a plane of its own
    const double rate = pair.of_plane()          ? 0
                        : std::isfinite(fastest) ? 2 * kBounds * distance * turning / length
                                                 : fastest;
    const double offset2 = d.squaredNorm() - along * along;
    bear(along - i.radius - j.radius - pressed, rate);
    if (width > 0) {
      if (offset2 > width * width + kRounding * (width * width + distance * distance)) found.near = false;
      bear(std::sqrt(std::max(offset2, 0.0)) - width, 2 * rate);
    }
  } else {
    found.near = false;  // two that have no plane of their own
  }
  if (i.normal != Vec3::Zero() && j.normal != Vec3::Zero()) {
    const double facing = -i.normal.dot(j.normal);
    if (!(facing > constants.facing_from)) found.near = false;
    const double margin = std::min((constants.facing_from - facing) / kBounds, kMostTurn) / fastest;
    if (std::isfinite(fastest) && fastest > 0 && margin > std::min(found.safe.path, found.safe.turn))
      found.safe = {std::numeric_limits<double>::infinity(), margin};
  }
  // what sticks pulls, and what was inside must be seen to come out
  const bool watched = record.sticks() || record.phase == PairPhase::penetrated;
  if (watched && found.near) found.safe = {0, 0};
  return found;
}

}  // namespace flexel::simulate
