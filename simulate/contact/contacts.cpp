// Where the points of the pairs are now, and the forces along their normals.
//
// A force f at a point moves its elements by their weights, f_a = w_a f. A change of the normal n ~ F^-T N
// costs dU/dn . dn = -(F^-1 P dU/dn) . dF^T n with P = I - n n^T, dF = sum_a du_a (x) g_a: the force n (g_a .
// F^-1 P dU/dn) on element a, which sums up to a couple.
#include "simulate/contact/contacts.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <utility>

#include "base/error.h"
#include "simulate/kernels/chunk_layout.h"
#include "simulate/models/cell_model.h"
#include "simulate/rigid/rigid_body.h"

namespace flexel::simulate {
namespace {

constexpr double kStiffness = 3;          // of a contact, in E / h an area
constexpr double kLeastVolume = 0.05;     // of a cell at rest, and
constexpr double kMostStretch = 25;       // of the squares of its stretches: else it tells no directions
constexpr double kShapelessEntry = 0.05;  // spacings; deeper, what has no shape is behind what it meets
constexpr double kLeastWeight = 1e-3;     // of a point on an element

}  // namespace

Contacts::Contacts(ContactSettings settings, const Problem& problem)
    : settings_(std::move(settings)), body_(problem.body), points_(contact_points(problem, settings_.parts)) {
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    const Material& material = problem.materials[p];
    std::array<Vec3, 8> gradients = cell_kind(body_.parts[p].lattice, material).gradient;
    for (Vec3& each : gradients) each /= 4;
    gradients_.push_back(gradients);
    foundation_.push_back(kStiffness * settings_.stiffness * material.young /
                          body_.parts[p].lattice.spacing.mean());
    friction_.push_back(material.contact_friction.value_or(settings_.friction));
    stick_.push_back(settings_.stick.empty() ? 0 : settings_.stick[p]);
  }
  mass_ = lumped_masses(problem);
  rigid_.resize(body_.parts.size());
  for (std::uint32_t p = 0; p < problem.rigidity.size(); ++p) {
    if (problem.rigidity[p] == Rigidity::none) continue;
    const RigidBody rigid = rigid_body(body_, p, mass_);
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(rigid.inverse_inertia, Eigen::EigenvaluesOnly);
    rigid_[p] =
        Whole{problem.rigidity[p] == Rigidity::free, rigid.centre, 1 / rigid.mass, eigen.eigenvalues()[2]};
    if (rigid_[p]->free && settings_.parts[p]) felt_.push_back({p});
  }
  // Where an edge runs through a sliver of a cell its elements are light: a point there stands for no more
  // area than a face's would.
  for (ContactPoint& point : points_)
    for (std::uint32_t a = 0; a < point.at.count && point.shape == ContactShape::edge; ++a)
      if (std::abs(point.at.weights[a]) > kLeastWeight)
        point.area = std::min(point.area, 0.5 * mass_[point.at.elements[a]] /
                                              (problem.materials[point.part].density * point.width *
                                               std::abs(point.at.weights[a])));
  std::vector<std::uint8_t> carries(body_.element_count(), 0);
  for (const ContactPoint& point : points_) {
    for (std::uint32_t a = 0; a < point.at.count; ++a) carries[point.at.elements[a]] = 1;
    widest_ = std::max(widest_, point.width);
    narrowest_ = std::min(narrowest_, point.width);
  }
  for (std::uint32_t e = 0; e < carries.size(); ++e)
    if (carries[e]) elements_.push_back(e);
  built_at_.resize(elements_.size());
  find_cells();
  if (settings_.self) find_near_matter(problem);
}

void Contacts::find_cells() {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < points_.size(); ++i)
    if (points_[i].at.count == 8) order.push_back(i);
  const auto less = [](const auto& a, const auto& b) { return a < b; };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return less(points_[a].at.elements, points_[b].at.elements);
  });
  cell_.assign(points_.size(), kNoPoint);
  for (std::uint32_t c = 0; c < body_.cell_count() && !order.empty(); ++c) {
    const std::array<std::uint32_t, 8>& corners = body_.cell_elements[c];
    auto at = std::lower_bound(order.begin(), order.end(), corners, [&](std::uint32_t i, const auto& key) {
      return points_[i].at.elements < key;
    });
    if (at != order.end() && points_[*at].at.elements == corners) cells_.push_back(c);
    for (; at != order.end() && points_[*at].at.elements == corners; ++at) cell_[*at] = c;
  }
}

std::size_t Contacts::broken_cells() const {
  return parallel_sum<std::size_t>(cells_.size(),
                                   [&](std::size_t c) { return body_.broken[cells_[c]] != 0; });
}

bool Contacts::loses() const {
  bool loses = settings_.damping > 0 || body_.element_columns.contains("stick_change");
  for (std::size_t p = 0; p < friction_.size(); ++p)
    loses = loses || (settings_.parts[p] && (friction_[p] > 0 || stick_[p] > 0));
  for (const ContactPlane& plane : settings_.planes)
    loses = loses || plane.friction.value_or(0) > 0 || plane.stick.value_or(0) > 0;
  return loses;
}

Vec3 Contacts::position(const ContactPoint& point, const State& state) const {
  Vec3 at = point.rest;
  for (std::uint32_t a = 0; a < point.at.count; ++a)
    at += point.at.weights[a] * state.displacement[point.at.elements[a]];
  return at;
}

Mat3 Contacts::gradient(const ContactPoint& point, const std::vector<Vec3>& displacement) const {
  Mat3 f = Mat3::Identity();
  if (point.at.count == 8)
    for (std::size_t a = 0; a < 8; ++a)
      f += displacement[point.at.elements[a]] * gradients_[point.part][a].transpose();
  return f;
}

Contacts::Side Contacts::side(std::uint32_t point, const State& state) const {
  const ContactPoint& from = points_[point];
  Side made;
  made.at.position = position(from, state);
  made.at.own_plane = from.shape == ContactShape::face ? 1 : 0;
  made.at.radius = from.radius;
  if (from.shape == ContactShape::ball) return made;
  const Mat3 f = gradient(from, state.displacement);
  // What is left of a broken cell may be in any shape and turned any way: its points are met by whole faces
  // and planes as those of edges are, and from all sides.
  const bool broken = cell_[point] != kNoPoint && body_.broken[cell_[point]] != 0;
  if (broken || !(f.determinant() > kLeastVolume && f.squaredNorm() < kMostStretch)) {
    made.shapeless = true;
    made.at.own_plane = 0;
    return made;
  }
  made.inverse = f.inverse();
  made.at.normal = (made.inverse.transpose() * from.normal).normalized();
  return made;
}

ContactSide Contacts::other_side(const Pair& pair) const {
  if (pair.j != kNoPoint) return sides_[pair.j].at;
  const ContactPlane& plane = settings_.planes[pair.plane];
  const Vec3& from = sides_[pair.i].at.position;
  return {from - (from - plane.point).dot(plane.normal) * plane.normal, plane.normal, 1, 0};
}

// The hooks of one step ask for the same state several times.
bool Contacts::seen(const State& state) {
  bool same = seen_builds_ == builds_ && shares(state) == shares_ && seen_.size() == near_elements_.size();
  for (std::size_t e = 0; same && e < seen_.size(); ++e)
    same = seen_[e] == state.displacement[near_elements_[e]];
  if (same) return true;
  seen_builds_ = builds_;
  seen_.resize(near_elements_.size());
  for (std::size_t e = 0; e < seen_.size(); ++e) seen_[e] = state.displacement[near_elements_[e]];
  return false;
}

void Contacts::look(const State& state) {
  refresh(state);
  if (seen(state)) return;
  ++looks_;
  sides_.resize(near_.size());
  parallel_for_each(
      near_.size(), [&](std::size_t n) { sides_[n] = side(near_[n], state); }, 512);
  if (joined_.size() < body_.parts.size()) find_inside(state);
  const std::vector<double> before = std::exchange(shares_, shares(state));
  std::vector<std::uint8_t> comes(shares_.empty() ? 0 : pairs_.size(), 0);
  parallel_for_each(
      pairs_.size(),
      [&](std::size_t p) {
        if (out_of_reach(pairs_[p])) {
          if (is_close_[p]) states_[p] = {};
          is_close_[p] = 0;
          memory_[p].standing = PairPhase::apart;
          return;
        }
        const PairState now = state_of(p, allowed(p));
        const bool entering = now.near && !now.deep && now.gap < 0 && memory_[p].standing == PairPhase::apart;
        if (entering && !comes.empty() && memory_[p].inside == 0 && shares_[later_part(pairs_[p])] > 0)
          comes[p] = 1;
        else
          take_state(p, now);
      },
      512);
  std::vector<std::uint32_t> coming;
  for (std::uint32_t p = 0; p < comes.size(); ++p)
    if (comes[p]) coming.push_back(p);
  if (!coming.empty()) let_in(coming);
  close_.clear();
  for (std::uint32_t p = 0; p < pairs_.size(); ++p)
    if (is_close_[p]) close_.push_back(p);
  book_letting_out(before);
}

void Contacts::take_state(std::size_t pair, PairState now) {
  stand(pair, now);
  if (now.near)
    states_[pair] = now;
  else if (is_close_[pair])
    states_[pair] = {};
  is_close_[pair] = now.near;
}

PairState Contacts::state_of(std::size_t pair, double allowed) const {
  const Pair& at = pairs_[pair];
  ContactSide from = sides_[at.i].at;
  if (at.j == kNoPoint) from.own_plane = 0;  // the plane's normal is the exact one
  if (!(allowed > 0)) return pair_state(from, other_side(at), at.constants);
  PairConstants constants = at.constants;
  constants.allowed = allowed;
  return pair_state(from, other_side(at), constants);
}

// Whether the kernel is 0 for certain: |t|^2 = d^2 - (d . b)^2 / b^2, in the terms of pair_law.h, is beyond
// its width by more than rounding.
bool Contacts::out_of_reach(const Pair& pair) const {
  constexpr double kRounding = 1e-9;
  if (pair.j == kNoPoint || !(pair.constants.width > 0)) return false;
  const ContactSide &i = sides_[pair.i].at, &j = sides_[pair.j].at;
  const Vec3 d = j.position - i.position, b = i.own_plane * i.normal - j.own_plane * j.normal;
  const double d2 = d.squaredNorm(), b2 = b.squaredNorm(), along = d.dot(b);
  const double width2 = pair.constants.width * pair.constants.width;
  return d2 * b2 - along * along > (width2 + kRounding * (width2 + d2)) * b2;
}

// How the pair stands after its state of now; one that is passed does nothing.
void Contacts::stand(std::size_t pair, PairState& now) {
  const Pair& at = pairs_[pair];
  PairPhase& standing = memory_[pair].standing;
  if (!now.near) {
    standing = PairPhase::apart;
  } else if (now.deep) {
    standing = PairPhase::passed;
  } else if (now.gap >= 0) {
    standing = PairPhase::meeting;
  } else if (standing == PairPhase::apart) {
    double entry = at.constants.law.hard;
    if (sides_[at.i].shapeless || (at.j != kNoPoint && sides_[at.j].shapeless))
      entry = at.j == kNoPoint ? 0 : kShapelessEntry * at.constants.width;
    standing = -now.gap > entry ? PairPhase::passed : PairPhase::meeting;
  }
  if (standing == PairPhase::passed) now = {};
}

double Contacts::energy(const State& state) {
  look(state);
  double energy = 0;
  for (const std::uint32_t p : close_) energy += states_[p].energy;
  return energy;
}

void Contacts::add_forces(const State& state, std::vector<Vec3>& forces) {
  look(state);
  for (Felt& felt : felt_) felt.force = felt.torque = Vec3::Zero();
  if (close_.empty()) return;
  std::vector<Total> totals(near_.size());
  for (const std::uint32_t p : close_) {
    const PairState& now = states_[p];
    if (!(now.pressure > 0)) continue;
    totals[pairs_[p].i].force -= now.force;
    totals[pairs_[p].i].turning += now.turning[0];
    if (pairs_[p].j == kNoPoint) continue;
    totals[pairs_[p].j].force += now.force;
    totals[pairs_[p].j].turning += now.turning[1];
  }
  spread(state, totals, forces);
}

std::vector<Contacts::Felt> Contacts::felt_about_centres(const State& state) const {
  std::vector<Felt> result = felt_;
  for (Felt& felt : result) {
    const Part& part = body_.parts[felt.part];
    Vec3 centre = Vec3::Zero();
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      centre += mass_[e] * rigid_[felt.part]->per_mass * (body_.rest[e] + state.displacement[e]);
    felt.torque -= centre.cross(felt.force);
  }
  return result;
}

void Contacts::spread(const State& state, const std::vector<Total>& totals, std::vector<Vec3>& forces) {
  for (std::size_t n = 0; n < near_.size(); ++n) {
    const Total& total = totals[n];
    const ContactPoint& point = points_[near_[n]];
    if (total.force == Vec3::Zero() && total.turning == Vec3::Zero()) continue;
    Felt* felt = nullptr;
    for (Felt& each : felt_)
      if (each.part == point.part) felt = &each;
    const auto add = [&](std::uint32_t element, const Vec3& force) {
      forces[element] += force;
      if (!felt) return;
      felt->force += force;
      felt->torque += (body_.rest[element] + state.displacement[element]).cross(force);
    };
    for (std::uint32_t a = 0; a < point.at.count; ++a)
      add(point.at.elements[a], point.at.weights[a] * total.force);
    if (point.at.count != 8) continue;
    const Vec3& normal = sides_[n].at.normal;
    const Vec3 turned = sides_[n].inverse * (total.turning - total.turning.dot(normal) * normal);
    const Mat3 couple = normal * turned.transpose() + total.couple * sides_[n].inverse.transpose();
    for (std::size_t a = 0; a < 8; ++a) add(point.at.elements[a], couple * gradients_[point.part][a]);
  }
}

std::vector<double> Contacts::memory() const {
  std::vector<double> memory{built_ ? 1.0 : 0.0,
                             promised_,
                             looked_at_ == builds_ ? 1.0 : 0.0,
                             fresh_ ? 1.0 : 0.0,
                             put_in_,
                             static_cast<double>(joined_.size()),
                             static_cast<double>(shares_.size()),
                             static_cast<double>(memory_.size())};
  for (const std::vector<double>* each : {&joined_, &shares_, &pressing_})
    memory.insert(memory.end(), each->begin(), each->end());
  for (const Memory& entry : memory_) {
    memory.push_back(static_cast<double>(entry.key >> 32));
    memory.push_back(static_cast<double>(entry.key & 0xffffffff));
    memory.insert(memory.end(), entry.stretch.begin(), entry.stretch.end());
    memory.push_back(entry.stuck);
    memory.push_back(static_cast<double>(entry.standing));
    memory.push_back(entry.inside);
  }
  for (const Vec3& at : built_at_) memory.insert(memory.end(), at.begin(), at.end());
  return memory;
}

void Contacts::restore(const std::vector<double>& memory) {
  constexpr std::size_t kHead = 8, kEntry = 8;
  const auto count = [&](std::size_t at) {
    return memory.size() < kHead ? 0 : static_cast<std::size_t>(memory[at]);
  };
  const std::size_t joined = count(5), shares = count(6), entries = count(7);
  if (memory.size() != kHead + joined + 2 * shares + kEntry * entries + 3 * built_at_.size())
    throw InputError("the checkpoint's contacts are not those of its scene");
  const double* from = memory.data() + kHead;
  const auto take = [&](std::size_t values) {
    from += values;
    return std::vector<double>(from - values, from);
  };
  joined_ = take(joined);
  shares_ = take(shares);
  pressing_ = take(shares);
  memory_.resize(entries);
  for (Memory& entry : memory_) {
    entry.key = static_cast<std::uint64_t>(from[0]) << 32 | static_cast<std::uint64_t>(from[1]);
    entry.stretch = Vec3(from[2], from[3], from[4]);
    entry.stuck = from[5];
    entry.standing = static_cast<PairPhase>(static_cast<int>(from[6]));
    entry.inside = from[7];
    from += kEntry;
  }
  State then;
  then.displacement.assign(body_.element_count(), Vec3::Zero());
  for (const std::uint32_t e : elements_) {
    then.displacement[e] = Vec3(from[0], from[1], from[2]);
    from += 3;
  }
  built_ = false;
  fresh_ = memory[3] == 1;
  put_in_ = memory[4];
  if (memory[0] == 0) return;
  build(then);
  promised_ = memory[1];
  looked_at_ = memory[2] == 1 ? builds_ : builds_ - 1;
}

std::vector<std::array<std::uint32_t, 2>> Contacts::touching(const State& state) {
  look(state);
  std::vector<std::array<std::uint32_t, 2>> result;
  for (const std::uint32_t p : close_)
    if (states_[p].pressure > 0)
      result.push_back({static_cast<std::uint32_t>(pairs_[p].key >> 32),
                        static_cast<std::uint32_t>(pairs_[p].key & 0xffffffff)});
  return result;
}

}  // namespace flexel::simulate
