// Pairs are evaluated in parallel and alone; only those that an initial penetration brings near wait for the
// others (OverlapRelease::admit).
#include "simulate/contact/pairs/pair_states.h"

#include <algorithm>
#include <cmath>
namespace flexel::simulate {
namespace {

constexpr double kNoTurn = 1e-9;          // of a body in a step
constexpr double kShapelessEntry = 0.05;  // spacings; most penetration with which shapeless points approach

static_assert(sizeof(ContactPair) == sizeof(double) * contact_kernels::kPairRow &&
              sizeof(PairConstants) == sizeof(double) * contact_kernels::kConstantsRow &&
              sizeof(PairState) == sizeof(double) * contact_kernels::kStateRow &&
              sizeof(PairRecord) == sizeof(double) * contact_kernels::kRecordRow &&
              sizeof(PairRubbing) == sizeof(double) * contact_kernels::kRubbingRow);

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
  states_.resize(list_.pairs().size());
  rubbing_.resize(list_.pairs().size());
  is_active_.assign(list_.pairs().size(), 0);
  active_.clear();
  acting_.clear();
  acting_points_.clear();
  others_act_ =
      release_.enabled() || std::any_of(list_.pairs().begin(), list_.pairs().end(),
                                        [](const ContactPair& pair) { return pair.properties.pull_off > 0; });
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

contact_kernels::PairStep PairStates::step(double drift, bool moving, bool rubs, double damping) {
  contact_kernels::PairStep made;
  made.records = reinterpret_cast<double*>(memory_.data());
  made.damping = damping;
  made.drift = drift;
  if (moving) made.motions = reinterpret_cast<const double*>(cells_.motions().data());
  if (rubs) made.rubbing = reinterpret_cast<double*>(rubbing_.data());
  return made;
}

void PairStates::update(const State& state, bool all) {
  if (release_.is_at(state) && is_at(state) && (!all || evaluated_all_)) return;
  evaluate(state, all, step(-1, false, false, 0));
}

void PairStates::go_through(const State& state, double drift, bool rubs, double damping) {
  const contact_kernels::PairStep through = step(drift, true, rubs, damping);
  if (release_.is_at(state) && is_at(state))
    evaluate_again(state, through);
  else
    evaluate(state, false, through);
}

void PairStates::rub(const State& state, double damping) {
  evaluate_again(state, step(-1, true, true, damping));
}

void PairStates::evaluate(const State& state, bool all, const contact_kernels::PairStep& step) {
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
  place_points(state, step.motions != nullptr);
  if (release_.known_parts() < surface_.body().parts.size()) find_initial_penetrations(state);
  const std::vector<double> before = release_.advance(state);
  for (const std::uint32_t p : active_)
    if (is_active_[p] == kActive) is_active_[p] = 0;
  const std::size_t steady = others_act_ ? 0 : acting_.size();
  marks_.assign(steady + schedule_.awake().size(), 0);
  lost_.resize(marks_.size());
  const bool changed = evaluate_steady(step);
  admit(evaluate_others(step), step);
  choose_active(changed);
  take_marks();
  release_.enter_energy(before, active_, states_, memory_);
}

// The active pairs at the state that is evaluated.
void PairStates::evaluate_again(const State& state, const contact_kernels::PairStep& step) {
  cells_.want_none();
  for (const std::uint32_t p : active_) {
    cells_.want(sides_[p].i);
    if (!sides_[p].of_plane) cells_.want(sides_[p].j);
  }
  cells_.place(state, true);
  marks_.assign(active_.size(), 0);
  lost_.resize(marks_.size());
  parallel_chunks(active_.size(), Batch::kMost, [&](std::size_t begin, std::size_t end) {
    contact_kernels::PairStep own = step;
    own.marks = marks_.data() + begin;
    own.lost = lost_.data() + begin;
    Batch batch;
    for (std::size_t n = begin; n < end; ++n) add_to(batch, active_[n], static_cast<std::uint32_t>(n));
    contact_kernel_table().evaluate(view(batch.pairs.data(), batch.count), batch.allowed.data(), own,
                                    reinterpret_cast<double*>(states_.data()));
    for (std::size_t n = begin; n < end && step.drift >= 0; ++n)
      if (is_active_[active_[n]] != kSteady && memory_[active_[n]].soft > 0) schedule_.keep_awake(active_[n]);
  });
  if (step.drift >= 0) choose_acting();
  take_marks();
}

// In the order of the pairs.
void PairStates::take_marks() {
  stiffens_ = false;
  for (std::size_t n = 0; n < marks_.size(); ++n) {
    stiffens_ = stiffens_ || (marks_[n] & contact_kernels::kStiffens) != 0;
    if (marks_[n] & contact_kernels::kHardens) hardened_ += lost_[n];
  }
}

// Of the pairs that are steady or awake.
void PairStates::place_points(const State& state, bool moving) {
  cells_.want_none();
  if (!others_act_)
    for (const std::uint32_t point : acting_points_) cells_.want(point);
  for (const std::uint32_t p : schedule_.awake()) {
    if (is_active_[p] == kSteady) continue;
    const contact_kernels::PairSides& of = sides_[p];
    cells_.want(of.i);
    if (!of.of_plane) cells_.want(of.j);
  }
  cells_.place(state, moving);
}

contact_kernels::PairView PairStates::view(const std::uint32_t* pairs, std::size_t count) const {
  return {pairs,
          count,
          sides_.data(),
          reinterpret_cast<const double*>(list_.pairs().data()),
          reinterpret_cast<const double*>(cells_.states().data()),
          reinterpret_cast<const double*>(planes_.data())};
}

// Whether any has ceased to press.
bool PairStates::evaluate_steady(const contact_kernels::PairStep& step) {
  if (others_act_) return false;
  parallel_chunks(acting_.size(), Batch::kMost, [&](std::size_t begin, std::size_t end) {
    contact_kernels::PairStep own = step;
    own.marks = marks_.data() + begin;
    own.lost = lost_.data() + begin;
    contact_kernel_table().evaluate(view(acting_.data() + begin, end - begin), nullptr, own,
                                    reinterpret_cast<double*>(states_.data()));
  });
  bool changed = false;
  for (std::size_t n = 0; n < acting_.size(); ++n) {
    if (evaluated_all_) schedule_.rest(acting_[n]);
    if (marks_[n] & contact_kernels::kPresses) continue;
    changed = true;
    settle(acting_[n]);
  }
  return changed;
}

// Of the pairs that are awake. Returns (pairs; empty without release) 1 for those that come near inside each
// other during a release; they are not evaluated yet.
std::vector<std::uint8_t> PairStates::evaluate_others(const contact_kernels::PairStep& step) {
  const std::vector<std::uint32_t>& awake = schedule_.awake();
  std::vector<std::uint8_t> entering(release_.share_count() == 0 ? 0 : list_.pairs().size(), 0);
  const std::size_t steady = marks_.size() - awake.size();
  parallel_chunks(awake.size(), Batch::kMost, [&](std::size_t begin, std::size_t end) {
    Batch batch;
    std::array<std::uint32_t, Batch::kMost> others, places;
    std::size_t count = 0;
    for (std::size_t n = begin; n < end; ++n) {
      if (is_active_[awake[n]] == kSteady) continue;
      places[count] = static_cast<std::uint32_t>(steady + n);
      others[count++] = awake[n];
    }
    look_at({others.data(), count}, {places.data(), count}, batch);
    evaluate_batch(batch, step, &entering);
  });
  return entering;
}

void PairStates::add_to(Batch& batch, std::uint32_t pair, std::uint32_t place) const {
  batch.allowed[batch.count] = release_.allowed(list_.pairs()[pair], memory_[pair]);
  batch.places[batch.count] = place;
  batch.pairs[batch.count++] = pair;
}

// Lets those sleep that can, and puts those in the batch that may be near.
void PairStates::look_at(std::span<const std::uint32_t> pairs, std::span<const std::uint32_t> places,
                         Batch& batch) {
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
      add_to(batch, p, places[n]);
    } else if (!frozen_) {
      record.phase = near[n] ? PairPhase::approaching : PairPhase::separated;
      record.soft = 0;
    }
  }
}

void PairStates::evaluate_batch(const Batch& batch, const contact_kernels::PairStep& step,
                                std::vector<std::uint8_t>* entering) {
  if (batch.count == 0) return;
  std::array<std::uint8_t, Batch::kMost> marks;
  std::array<double, Batch::kMost> lost;
  contact_kernels::PairStep own = step;
  own.marks = marks.data();
  own.lost = lost.data();
  contact_kernel_table().evaluate(view(batch.pairs.data(), batch.count), batch.allowed.data(), own,
                                  reinterpret_cast<double*>(states_.data()));
  for (std::size_t n = 0; n < batch.count; ++n) {
    const std::uint32_t p = batch.pairs[n];
    const PairState& now = states_[p];
    const PairRecord& record = memory_[p];
    const bool enters = now.near && !now.deep && now.gap < 0 && record.phase == PairPhase::separated &&
                        record.penetration == 0;
    const bool waits = entering && enters && release_.is_releasing(list_.pairs()[p]);
    if (waits)
      (*entering)[p] = 1;
    else
      settle(p);
    if (waits || !is_active_[p]) {
      if (step.drift >= 0) memory_[p].slip = Vec3::Zero();
      if (step.drift >= 0) memory_[p].soft = 0;
      continue;
    }
    marks_[batch.places[n]] = marks[n];
    lost_[batch.places[n]] = lost[n];
    if (step.drift >= 0 && record.soft > 0)
      schedule_.keep_awake(p);  // it presses sooner than it was judged by
  }
}

// Active pairs are the steady ones, also those of them that are near but have just ceased to press, and those that
// are awake and near. Where all are evaluated, steady pairs are among those that are awake.
void PairStates::choose_active(bool changed) {
  active_.clear();
  auto steady = acting_.cbegin();
  const auto end = others_act_ ? steady : acting_.cend();
  const auto add_steady = [&] {
    const std::uint8_t is = is_active_[*steady];
    if (is == kSteady || (is == kActive && !evaluated_all_)) active_.push_back(*steady);
  };
  for (const std::uint32_t p : schedule_.awake()) {
    if (is_active_[p] != kActive) continue;
    for (; steady != end && *steady < p; ++steady) add_steady();
    changed = changed || states_[p].pressure > 0;
    active_.push_back(p);
  }
  for (; steady != end; ++steady) add_steady();
  if (changed || others_act_) choose_acting();
}

void PairStates::choose_acting() {
  const std::vector<std::uint32_t> before = std::exchange(acting_, {});
  for (const std::uint32_t p : before)
    if (is_active_[p] == kSteady) is_active_[p] = kActive;
  for (const std::uint32_t p : active_)
    if (states_[p].pressure > 0 || memory_[p].sticks()) acting_.push_back(p);
  cells_.want_none();
  acting_points_.clear();
  for (const std::uint32_t p : acting_) {
    if (!others_act_) {
      is_active_[p] = kSteady;
      schedule_.rest(p);
    }
    cells_.want(sides_[p].i);
    if (!sides_[p].of_plane) cells_.want(sides_[p].j);
  }
  acting_points_ = cells_.wanted();
  for (const std::uint32_t p : before)
    if (is_active_[p] != kSteady) schedule_.wake(p);
}

void PairStates::admit(const std::vector<std::uint8_t>& entering, const contact_kernels::PairStep& step) {
  std::vector<std::uint32_t> pairs;
  std::vector<double> depths;
  for (std::uint32_t p = 0; p < entering.size(); ++p)
    if (entering[p]) {
      pairs.push_back(p);
      depths.push_back(-evaluate(list_.pairs()[p], 0, 0).gap);
    }
  if (pairs.empty()) return;
  release_.admit(pairs, depths, memory_);
  for (std::size_t begin = 0; begin < pairs.size(); begin += Batch::kMost) {
    Batch batch;
    for (std::size_t n = begin; n < std::min(pairs.size(), begin + Batch::kMost); ++n)
      add_to(batch, pairs[n], pairs[n]);  // all are awake: of what is released all pairs are looked at
    evaluate_batch(batch, step, nullptr);
  }
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
    if (points()[pair.i].shapeless || (!pair.of_plane() && points()[pair.j].shapeless))
      entry = pair.of_plane() ? 0 : kShapelessEntry * constants.width;
    phase = -now.gap > entry ? PairPhase::penetrated : PairPhase::approaching;
  }
  if (phase == PairPhase::penetrated) now = {};
}

ContactSide PairStates::other_side(const ContactPair& pair) const {
  if (!pair.of_plane()) return points()[pair.j].side;
  const ContactPlane& plane = settings_.planes[pair.plane];
  const Vec3& from = points()[pair.i].side.position;
  return {from - (from - plane.point).dot(plane.normal) * plane.normal, plane.normal, 1, 0};
}

ContactSide PairStates::own_side(const ContactPair& pair) const {
  ContactSide from = points()[pair.i].side;
  if (pair.of_plane()) from.own_plane = 0;  // the plane's normal is the exact one
  return from;
}

}  // namespace flexel::simulate
