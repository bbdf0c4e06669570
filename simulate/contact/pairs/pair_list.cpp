// Parts whose boxes are apart by more than the margin are left out of the grid.
#include "simulate/contact/pairs/pair_list.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexel::simulate {
namespace {

constexpr double kSkin = 0.4;     // margin, of the widest spacing
constexpr double kSlack = 0.45;   // of the margin; not quite half: weights may lie outside [0, 1]
constexpr double kTurning = 0.4;  // by which the cosine between normals may change meanwhile

// m, at most, between positions of two points that touch.
double touching_distance(const ContactPoint& a, const ContactPoint& b) {
  if (a.radius > 0 && b.radius > 0) return a.radius + b.radius;
  const double width = std::max(a.width, b.width), depth = a.depth + b.depth + a.radius + b.radius;
  return std::sqrt(width * width + depth * depth);  // hypot() takes ten times as long
}

}  // namespace

PairList::PairList(const ContactSettings& settings, const Problem& problem, const ContactSurface& surface)
    : settings_(settings),
      surface_(surface),
      materials_(settings, problem, surface),
      excluded_(settings, problem, surface),
      rest_overlaps_(settings, surface, materials_, excluded_),
      surface_runs_(element_runs(surface.elements(), surface.body().parts)),
      built_at_(surface.elements().size()),
      skin_(kSkin * surface.widest()) {}

bool PairList::update(const State& state, bool ahead) {
  if (!is_due(state, ahead)) return false;
  skin_ = kSkin * surface_.widest();
  build(state);
  return true;
}

bool PairList::update_ahead(const State& before, double way) {
  constexpr double kRoom = 1.5;
  if (!is_due(before, false, kRoom * way)) return false;
  skin_ = std::max(kSkin * surface_.widest(), 0.5 * kRoom / kSlack * way);
  build(before);
  return true;
}

double PairList::way(const State& before, const State& aimed) const {
  Box moves;
  for (const std::uint32_t e : surface_.elements()) moves.add(aimed.displacement[e] - before.displacement[e]);
  if (moves.empty()) return 0;
  if (!settings_.planes.empty()) moves.add(Vec3::Zero());
  return moves.diagonal();
}

// Half the diagonal of the box of the moves since the list was made bounds them but for a common one. The next
// step's are in their box widened by that of the velocities: the length of a step is chosen before it leads to
// an impact.
bool PairList::is_due(const State& state, bool ahead, double way) {
  constexpr std::size_t kGrain = 1024;
  boxes_.assign((surface_runs_.size() + kGrain - 1) / kGrain, {});
  parallel_chunks(surface_runs_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    auto& [moves, speeds] = boxes_[begin / kGrain];
    for (std::size_t r = begin; r < end; ++r) {
      const ElementRun& run = surface_runs_[r];
      moves.add_differences({&state.displacement[run.first], run.count}, {&built_at_[run.place], run.count});
      if (ahead) speeds.add({&state.velocity[run.first], run.count});
    }
  });
  Box moves, speeds;
  for (const auto& [wide_moves, wide_speeds] : boxes_) {
    const Box own_moves = wide_moves.box(), own_speeds = wide_speeds.box();
    moves.add(own_moves.min), moves.add(own_moves.max);
    if (ahead) speeds.add(own_speeds.min), speeds.add(own_speeds.max);
  }
  if (ahead) speeds_ = speeds;
  if (ahead && state.kick > 0 && !speeds.empty()) {
    moves.add(moves.min + state.kick * speeds.min);
    moves.add(moves.max + state.kick * speeds.max);
  }
  if (!settings_.planes.empty()) moves.add(Vec3::Zero());
  return !built_ || 0.5 * (moves.diagonal() + way) > slack_ || surface_.broken_cells() != built_with_;
}

// By as much more as the margin is wider.
double PairList::turning() const {
  return kTurning * skin_ / (kSkin * surface_.widest());
}

void PairList::rebuild_at(const std::vector<Vec3>* displacements) {
  built_ = false;
  if (!displacements) return;
  State then;
  then.displacement.assign(surface_.body().element_count(), Vec3::Zero());
  for (std::size_t e = 0; e < displacements->size(); ++e)
    then.displacement[surface_.elements()[e]] = (*displacements)[e];
  build(then);
}

void PairList::build(const State& state) {
  built_ = true;
  built_with_ = surface_.broken_cells();
  ++builds_;
  for (std::size_t e = 0; e < built_at_.size(); ++e)
    built_at_[e] = state.displacement[surface_.elements()[e]];
  const std::size_t count = surface_.points().size();
  std::vector<Vec3> positions(count), normals(count);
  parallel_for_each(
      count,
      [&](std::size_t i) {
        const ContactSide side = surface_.at(static_cast<std::uint32_t>(i), state).side;
        positions[i] = side.position;
        normals[i] = side.normal;
      },
      256);
  slack_ = kSlack * skin_;
  pairs_.clear();
  add_pairs(positions, normals);
  add_plane_pairs(positions, normals);
  number_points();
}

// Of parts that may touch themselves or whose boxes are near one another. Where there are none, more slack:
// `farthest` [m] bounds the distance of two points that touch.
std::vector<std::uint32_t> PairList::points_of_near_parts(const std::vector<Vec3>& positions,
                                                          double farthest) {
  const std::vector<ContactPoint>& points = surface_.points();
  std::vector<Box> box(surface_.body().parts.size());
  for (std::size_t i = 0; i < points.size(); ++i) box[points[i].part].add(positions[i]);
  std::vector<std::uint8_t> near(box.size(), 0);
  for (std::uint32_t p = 0; p < near.size(); ++p) near[p] = settings_.self && !surface_.rigid(p);
  double nearest = std::numeric_limits<double>::infinity();  // m, between boxes that are apart
  for (std::size_t a = 0; a < box.size(); ++a)
    for (std::size_t b = a + 1; b < box.size(); ++b) {
      if (box[a].empty() || box[b].empty()) continue;
      const Vec3 apart = (box[a].min - box[b].max).cwiseMax(box[b].min - box[a].max).cwiseMax(0);
      if (apart.norm() < farthest + skin_)
        near[a] = near[b] = 1;
      else
        nearest = std::min(nearest, apart.norm() - farthest);
    }
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (near[points[i].part]) result.push_back(i);
  if (result.empty() && settings_.planes.empty() && nearest > skin_) slack_ = kSlack * nearest;
  return result;
}

bool PairList::may_touch(std::uint32_t i, std::uint32_t j, const std::vector<Vec3>& positions,
                         const std::vector<Vec3>& normals) const {
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  if (a.part == b.part && (!settings_.self || surface_.rigid(a.part))) return false;
  if (surface_.prescribed(a.part) && surface_.prescribed(b.part)) return false;
  if (a.shape == ContactShape::edge && b.shape == ContactShape::edge) return false;
  const bool faces = normals[i] != Vec3::Zero() && normals[j] != Vec3::Zero();
  if (faces && -normals[i].dot(normals[j]) < std::min(a.facing_from, b.facing_from) - turning()) return false;
  const double near = touching_distance(a, b) + skin_;
  if ((positions[j] - positions[i]).squaredNorm() > near * near) return false;
  return !excluded_.contains(i, j);
}

void PairList::add_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals) {
  const double widest = surface_.widest();
  double farthest = 0;  // that any two points touch over
  for (const ContactPoint& point : surface_.points())
    farthest = std::max(farthest, point.radius > 0 ? 2 * point.radius + widest : 1.4143 * widest);
  const std::vector<std::uint32_t> in_grid = points_of_near_parts(positions, farthest);
  if (in_grid.empty()) return;
  std::vector<Vec3> at;
  at.reserve(in_grid.size());
  for (const std::uint32_t i : in_grid) at.push_back(positions[i]);
  const Neighbours found = neighbours_within(at, farthest + skin_, [&](std::uint32_t a, std::uint32_t b) {
    return may_touch(in_grid[a], in_grid[b], positions, normals);
  });
  for (std::uint32_t a = 0; a < in_grid.size(); ++a)
    for (const std::uint32_t b : found.of(a)) {
      const std::uint32_t i = in_grid[a], j = in_grid[b];
      const PairProperties properties = materials_.between(i, j);
      pairs_.push_back(
          {properties, rest_overlaps_.of(i, j, properties.constants), std::uint64_t{i} << 32 | j, i, j});
    }
}

// By key, as the others are.
void PairList::add_plane_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals) {
  const std::vector<ContactPoint>& points = surface_.points();
  const auto others = static_cast<std::ptrdiff_t>(pairs_.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (surface_.prescribed(points[i].part)) continue;
    for (std::uint32_t p = 0; p < settings_.planes.size(); ++p) {
      const ContactPlane& plane = settings_.planes[p];
      if ((positions[i] - plane.point).dot(plane.normal) - points[i].radius > skin_) continue;
      if (normals[i] != Vec3::Zero() && -normals[i].dot(plane.normal) < points[i].facing_from - turning())
        continue;
      pairs_.push_back({materials_.against_plane(i, plane), 0, std::uint64_t{i} << 32 | (points.size() + p),
                        i, ContactPair::kOfPlane, p});
    }
  }
  std::inplace_merge(pairs_.begin(), pairs_.begin() + others, pairs_.end(),
                     [](const ContactPair& a, const ContactPair& b) { return a.key < b.key; });
}

// Pairs hold numbers of contact points so far; from here on places in points_.
void PairList::number_points() {
  points_.clear();
  std::vector<std::uint32_t> number(surface_.points().size(), 0);
  std::vector<std::uint8_t> carries(surface_.body().element_count(), 0);
  for (const ContactPair& pair : pairs_) {
    number[pair.i] = 1;
    if (!pair.of_plane()) number[pair.j] = 1;
  }
  for (std::uint32_t i = 0; i < number.size(); ++i) {
    if (!number[i]) continue;
    number[i] = static_cast<std::uint32_t>(points_.size());
    points_.push_back(i);
    const InterpolationWeights& at = surface_.points()[i].at;
    for (std::uint32_t a = 0; a < at.count; ++a) carries[at.elements[a]] = 1;
  }
  for (ContactPair& pair : pairs_) {
    pair.i = number[pair.i];
    if (!pair.of_plane()) pair.j = number[pair.j];
  }
  elements_.clear();
  for (const std::uint32_t e : surface_.elements())
    if (carries[e]) elements_.push_back(e);
  runs_ = element_runs(elements_, surface_.body().parts);
}

}  // namespace flexel::simulate
