// Sums over the pairs one after another, so that their bits do not depend on the threads.
#include "simulate/contact/implicit_contact.h"

#include <algorithm>
#include <cmath>

#include "simulate/contact/contact_stiffness.h"

namespace flexel::simulate {
namespace {

constexpr double kSettled = 1e-2;  // of the contact forces, by which what is lagged may still change

}  // namespace

ImplicitContact::ImplicitContact(double damping, const ContactSurface& surface, const PairList& list,
                                 const PairStates& states, const ContactFriction& friction,
                                 PairMemory& memory)
    : damping_(damping),
      surface_(surface),
      list_(list),
      states_(states),
      friction_(friction),
      memory_(memory) {}

bool ImplicitContact::deforms(std::uint32_t point) const {
  return !surface_.rigid(list_.point(point).part);
}

// The place `away` [m] from a point, as it is now, moves by sum of (w_a + g_a . F^-1 away) u_a.
ImplicitContact::Side ImplicitContact::side(std::uint32_t number, const Vec3& away) const {
  const ContactPoint& point = list_.point(number);
  Side made{number, true, {}};
  const Vec3 at_rest = states_.points()[number].inverse * away;
  for (std::uint32_t a = 0; a < point.at.count; ++a) {
    made.shares[a] = point.at.weights[a];
    if (point.at.count == 8) made.shares[a] += surface_.gradients(point.part)[a].dot(at_rest);
  }
  return made;
}

ImplicitContact::Rubbing ImplicitContact::rubbing(std::uint32_t number) const {
  const ContactPair& pair = list_.pairs()[number];
  const PairState& now = states_[number];
  const std::array<Vec3, 2> place = friction_.meeting_place(pair);
  Rubbing made;
  made.pair = number;
  made.sides[0] = side(pair.i, place[0]);
  if (!pair.of_plane()) made.sides[1] = side(pair.j, place[1]);
  made.normal = now.normal;
  made.slip = memory_[number].slip - memory_[number].slip.dot(now.normal) * now.normal;
  made.pressure = now.pressure;
  made.most = pair.properties.friction * now.pressure;
  made.stiffness = kTangential * friction_.secant_stiffness(number);
  made.dashpot = dashpot_[number];
  return made;
}

void ImplicitContact::begin(const State& before, double step) {
  before_ = before.displacement;
  step_ = step;
  growth_ = 1 + damping_ / step;
  dashpot_.assign(list_.pairs().size(), 0);
  rubbing_.clear();
  for (const std::uint32_t p : states_.active())
    if (states_[p].pressure > 0) dashpot_[p] = damping_ * states_[p].stiffness * states_[p].share / step;
  for (const std::uint32_t p : states_.active())
    if (states_[p].pressure > 0) rubbing_.push_back(rubbing(p));
}

bool ImplicitContact::take_up(const State& found) {
  std::vector<Rubbing> now;
  double contact = 0, changed = 0;
  auto old = rubbing_.cbegin();
  const auto lose = [&](std::uint32_t until) {
    for (; old != rubbing_.cend() && old->pair < until; ++old)
      changed += force(*old, moved(*old, found)).squaredNorm();
  };
  for (const std::uint32_t p : states_.active()) {
    if (!(states_[p].pressure > 0)) continue;
    now.push_back(rubbing(p));
    lose(p);
    Vec3 before = Vec3::Zero();
    if (old != rubbing_.cend() && old->pair == p) {
      before = force(*old, moved(*old, found));
      ++old;
    }
    changed += (force(now.back(), moved(now.back(), found)) - before).squaredNorm();
    contact += states_[p].pressure * states_[p].pressure + before.squaredNorm();
  }
  lose(0xffffffff);
  const bool settled = changed <= kSettled * kSettled * contact;
  if (!settled) rubbing_ = std::move(now);
  return settled;
}

// m, of j against i where they meet, since the step began.
Vec3 ImplicitContact::moved(const Rubbing& pair, const State& trial) const {
  std::array<Vec3, 2> of{Vec3::Zero(), Vec3::Zero()};
  for (std::size_t s = 0; s < 2; ++s) {
    const Side& side = pair.sides[s];
    if (!side.moves) continue;
    const InterpolationWeights& at = list_.point(side.point).at;
    for (std::uint32_t a = 0; a < at.count; ++a)
      of[s] += side.shares[a] * (trial.displacement[at.elements[a]] - before_[at.elements[a]]);
  }
  return of[1] - of[0];
}

// N, on j.
Vec3 ImplicitContact::force(const Rubbing& pair, const Vec3& moved) const {
  const double parting = moved.dot(pair.normal);
  const Vec3 held = pair.slip + growth_ * (moved - parting * pair.normal);
  const double pull = pair.stiffness * held.norm();
  const double share = pull > pair.most ? pair.most / pull : 1;
  return -std::min(pair.dashpot * parting, pair.pressure) * pair.normal - share * pair.stiffness * held;
}

Mat3 ImplicitContact::stiffness(const Rubbing& pair, const Vec3& moved) const {
  const Mat3 along = pair.normal * pair.normal.transpose(), across = Mat3::Identity() - along;
  const double parting = moved.dot(pair.normal);
  Mat3 sum = Mat3::Zero();
  if (pair.dashpot * parting < pair.pressure) sum += pair.dashpot * along;
  if (!(pair.most > 0)) return sum;
  const Vec3 held = pair.slip + growth_ * (across * moved);
  const double length = held.norm();
  if (pair.stiffness * length <= pair.most)
    sum += pair.stiffness * growth_ * across;
  else
    sum += pair.most * growth_ / length * (across - held * held.transpose() / (length * length));
  return sum;
}

double ImplicitContact::potential(const State& trial) const {
  double sum = 0;
  for (const Rubbing& pair : rubbing_) {
    const Vec3 moved = this->moved(pair, trial);
    const double parting = moved.dot(pair.normal);
    const double length = (pair.slip + growth_ * (moved - parting * pair.normal)).norm();
    sum += (pair.stiffness * length <= pair.most ? 0.5 * pair.stiffness * length * length
                                                 : pair.most * (length - 0.5 * pair.most / pair.stiffness)) /
           growth_;
    sum += pair.dashpot * parting <= pair.pressure
               ? 0.5 * pair.dashpot * parting * parting
               : pair.pressure * (parting - 0.5 * pair.pressure / pair.dashpot);
  }
  return sum;
}

void ImplicitContact::add_forces(const State& trial, std::vector<Vec3>& forces) const {
  for (const Rubbing& pair : rubbing_) {
    const Vec3 on_j = force(pair, moved(pair, trial));
    for (std::size_t s = 0; s < 2; ++s) {
      const Side& side = pair.sides[s];
      if (!side.moves) continue;
      const InterpolationWeights& at = list_.point(side.point).at;
      const Vec3 on = s == 0 ? Vec3(-on_j) : on_j;
      for (std::uint32_t a = 0; a < at.count; ++a) forces[at.elements[a]] += side.shares[a] * on;
    }
  }
}

// Pairs of which one side alone moves freely are summed up by its point first; they follow one another, mostly.
void ImplicitContact::add_friction_stiffness(const State& trial, BlockMatrix& matrix) const {
  std::vector<std::pair<std::uint32_t, double>> shares;  // of elements that move freely
  std::array<Mat3, 64> sum;
  const InterpolationWeights* summed = nullptr;
  const auto flush = [&] {
    if (summed) add_blocks(*summed, sum, matrix);
    summed = nullptr;
  };
  for (const Rubbing& pair : rubbing_) {
    const Mat3 own = stiffness(pair, moved(pair, trial));
    if (own == Mat3::Zero()) continue;
    shares.clear();
    const InterpolationWeights* one = nullptr;  // of the last side that moves freely
    for (std::size_t s = 0; s < 2; ++s) {
      const Side& side = pair.sides[s];
      if (!side.moves || !deforms(side.point)) continue;
      one = &list_.point(side.point).at;
      for (std::uint32_t a = 0; a < one->count; ++a)
        shares.emplace_back(one->elements[a], s == 0 ? -side.shares[a] : side.shares[a]);
    }
    if (!one) continue;
    if (shares.size() > one->count) {  // both sides
      for (const auto& [row, a] : shares)
        for (const auto& [column, b] : shares) matrix.values[position_of(matrix, row, column)] += a * b * own;
      continue;
    }
    if (one != summed) {
      flush();
      summed = one;
      sum.fill(Mat3::Zero());
    }
    for (std::size_t a = 0; a < shares.size(); ++a)
      for (std::size_t b = 0; b < shares.size(); ++b)
        sum[8 * a + b] += (shares[a].second * shares[b].second) * own;
  }
  flush();
}

void ImplicitContact::finish(const State& state) {
  for (std::uint32_t p = 0; p < list_.pairs().size(); ++p)
    if (!states_.is_active(p) || !(states_[p].pressure > 0)) memory_[p].slip = Vec3::Zero();
  for (const Rubbing& pair : rubbing_) {
    if (!states_.is_active(pair.pair) || !(states_[pair.pair].pressure > 0)) continue;
    const Vec3 moved = this->moved(pair, state);
    Vec3 slip = pair.slip + moved - moved.dot(pair.normal) * pair.normal;
    const double length = slip.norm(), longest = pair.most / pair.stiffness;
    if (length > longest) slip *= longest / length;
    memory_[pair.pair].slip = slip;
  }
}

std::vector<CoupledElements> ImplicitContact::couples() const {
  std::vector<CoupledElements> groups;
  for (const ContactPair& pair : list_.pairs()) {
    if (pair.of_plane() || !deforms(pair.i) || !deforms(pair.j)) continue;
    CoupledElements group;
    for (const std::uint32_t number : {pair.i, pair.j}) {
      const InterpolationWeights& at = list_.point(number).at;
      group.insert(group.end(), at.elements.begin(), at.elements.begin() + at.count);
    }
    std::sort(group.begin(), group.end());
    group.erase(std::unique(group.begin(), group.end()), group.end());
    groups.push_back(std::move(group));
  }
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  return groups;
}

}  // namespace flexel::simulate
