// Pairs are evaluated in parallel and alone; only those that an initial penetration brings near wait for the
// others (OverlapRelease::admit).
#include "simulate/contact/pairs/pair_states.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include "base/instruction_set.h"

namespace flexel::simulate {
namespace {

constexpr double kSoftSteps = 2;       // in which an impact goes through the soft part of the contact law
constexpr double kFarthestSoft = 0.4;  // spacings, at most, of that part: two steps of contact_step_bound.cpp
constexpr double kHardening = 0.001;   // a step, of what rests: the share of its extra softness that goes
constexpr double kHardened = 1.01;     // of the least softness, at which that is over
constexpr double kNoTurn = 1e-9;       // of a body in a step
constexpr double kShapelessEntry = 0.05;  // spacings; most penetration with which shapeless points approach

static_assert(sizeof(ContactSide) == sizeof(double) * contact_kernels::kSideRow &&
              sizeof(PointState) == sizeof(double) * contact_kernels::kPointRow &&
              sizeof(PairConstants) == sizeof(double) * contact_kernels::kConstantsRow &&
              sizeof(PairState) == sizeof(double) * contact_kernels::kStateRow);

}  // namespace

const contact_kernels::ContactTable& contact_kernel_table() {
  using namespace contact_kernels;
#if defined(__x86_64__)
  static const ContactTable& best = best_table(&contacts_portable, &contacts_avx2, &contacts_avx512);
  return best;
#else
  return contacts_portable();
#endif
}

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
  sides_.clear();
  for (const ContactPair& pair : list_.pairs())
    sides_.push_back({pair.i, pair.of_plane() ? pair.plane : pair.j, pair.of_plane() ? 1u : 0u});
  planes_.clear();
  for (const ContactPlane& plane : settings_.planes) planes_.push_back({plane.point, plane.normal, 1, 0});
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
  find_points(state);
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
void PairStates::find_points(const State& state) {
  wanted_points_.clear();
  const auto want = [&](std::uint32_t point) {
    if (std::exchange(point_evaluation_[point], evaluations_) != evaluations_)
      wanted_points_.push_back(point);
  };
  for (const std::uint32_t p : schedule_.awake()) {
    const contact_kernels::PairSides& of = sides_[p];
    want(of.i);
    if (!of.of_plane) want(of.j);
  }
  if (points_.empty()) return;
  parallel_chunks(wanted_points_.size(), Batch::kMost, [&](std::size_t begin, std::size_t end) {
    contact_kernel_table().place(cells_.points().data(), wanted_points_.data() + begin, end - begin,
                                 state.displacement.data()->data(),
                                 reinterpret_cast<double*>(points_.data()));
  });
}

contact_kernels::PairView PairStates::view(const std::uint32_t* pairs, std::size_t count) const {
  return {pairs,
          count,
          sides_.data(),
          reinterpret_cast<const char*>(&list_.pairs().front().properties.constants),
          sizeof(ContactPair),
          reinterpret_cast<const double*>(points_.data()),
          reinterpret_cast<const double*>(planes_.data())};
}

// Of the pairs that are awake. Returns (pairs; empty without release) 1 for those that come near inside each
// other during a release; they are not evaluated yet.
std::vector<std::uint8_t> PairStates::evaluate_pairs() {
  const std::vector<std::uint32_t>& awake = schedule_.awake();
  std::vector<std::uint8_t> entering(release_.share_count() == 0 ? 0 : list_.pairs().size(), 0);
  parallel_chunks(awake.size(), Batch::kMost, [&](std::size_t begin, std::size_t end) {
    Batch batch;
    std::array<std::uint32_t, Batch::kMost> others;
    std::size_t count = 0;
    for (std::size_t n = begin; n < end; ++n) {
      const std::uint32_t p = awake[n];
      if (is_active_[p] != kWasPressed) {
        others[count++] = p;
        continue;
      }
      schedule_.keep_awake(p);  // it cannot sleep
      add_to(batch, p);
    }
    look_at({others.data(), count}, batch);
    evaluate_batch(batch, entering);
  });
  return entering;
}

void PairStates::add_to(Batch& batch, std::uint32_t pair) const {
  batch.allowed[batch.count] = release_.allowed(list_.pairs()[pair], memory_[pair]);
  batch.soft[batch.count] = memory_[pair].soft;
  batch.pairs[batch.count++] = pair;
}

// Lets those sleep that can, and puts those in the batch that may be near.
void PairStates::look_at(std::span<const std::uint32_t> pairs, Batch& batch) {
  if (pairs.empty()) return;
  std::array<double, Batch::kMost> pressed, path, turn;
  std::array<std::uint8_t, Batch::kMost> near;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    // what can stick begins to at that gap
    const PairProperties& of = list_.pairs()[pairs[n]].properties;
    pressed[n] = of.constants.law.softened(memory_[pairs[n]].soft).ahead +
                 (of.pull_off > 0 ? of.constants.law.soft : 0);
  }
  contact_kernel_table().look(view(pairs.data(), pairs.size()), pressed.data(), path.data(), turn.data(),
                              near.data());
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const std::uint32_t p = pairs[n];
    PairRecord& record = memory_[p];
    // what sticks pulls, and what was inside must be seen to come out
    const bool watched = record.sticks() || record.phase == PairPhase::penetrated;
    const bool sleeps =
        schedule_.sleep(p, watched && near[n] ? SafeMotion{0, 0} : SafeMotion{path[n], turn[n]});
    if (near[n] && (!sleeps || evaluated_all_)) {
      add_to(batch, p);
    } else if (!frozen_) {
      record.phase = near[n] ? PairPhase::approaching : PairPhase::separated;
      record.soft = 0;
    }
  }
}

void PairStates::evaluate_batch(const Batch& batch, std::vector<std::uint8_t>& entering) {
  if (batch.count == 0) return;
  contact_kernel_table().evaluate(view(batch.pairs.data(), batch.count), batch.allowed.data(),
                                  batch.soft.data(), reinterpret_cast<double*>(states_.data()));
  for (std::size_t n = 0; n < batch.count; ++n) {
    const std::uint32_t p = batch.pairs[n];
    const PairState& now = states_[p];
    const PairRecord& record = memory_[p];
    const bool enters = is_active_[p] != kWasPressed && now.near && !now.deep && now.gap < 0 &&
                        record.phase == PairPhase::separated && record.penetration == 0;
    if (enters && release_.is_releasing(list_.pairs()[p]))
      entering[p] = 1;
    else
      settle(p);
  }
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

void PairStates::set(std::size_t pair, const PairState& now) {
  states_[pair] = now;
  settle(pair);
}

// What a pair's new state means for its phase.
void PairStates::settle(std::size_t pair) {
  PairState& now = states_[pair];
  PairPhase phase = memory_[pair].phase;
  const bool passed = frozen_ && now.near && now.deep && phase == PairPhase::approaching;
  if (!passed) update_phase(list_.pairs()[pair], now, phase);
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

}  // namespace flexel::simulate
