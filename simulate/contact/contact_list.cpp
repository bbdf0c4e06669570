// The list of pairs that could touch.
#include <algorithm>

#include "simulate/contact/contacts.h"

namespace flexel::simulate {
namespace {

constexpr double kSoft = 0.01;    // of a spacing, over which pressure begins
constexpr double kSkin = 0.4;     // of the widest spacing: pairs are listed that much before they touch
constexpr double kTurning = 0.4;  // by which the cosine between normals may change meanwhile
constexpr double kNearMatter =
    2.5;                  // spacings at rest; nearer points of one part that matter joins do not touch
constexpr int kHops = 2;  // connections along which matter joins the cells of two such points
constexpr double kMostDrawn = 0.35;  // spacings that what sticks can be drawn out by
constexpr double kSameSide = 0.3;    // cosine between normals at rest above which points are of one side

}  // namespace

double Contacts::reach(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = points_[i], &b = points_[j];
  if (a.radius > 0 && b.radius > 0) return a.radius + b.radius;
  return std::hypot(std::max(a.width, b.width), a.depth + b.depth + a.radius + b.radius);
}

// Springs in series, so that two alike make that of each; two balls the mean, as in the paper (section 3.2).
double Contacts::foundation(std::uint32_t i, std::uint32_t j) const {
  const double a = foundation_[points_[i].part], b = foundation_[points_[j].part];
  const bool balls = points_[i].radius > 0 && points_[j].radius > 0;
  return balls ? 0.5 * (a + b) : 2 * a * b / (a + b);
}

// Of the part, and what events have added to it in the elements' column "stick_change" [Pa].
double Contacts::stick_of(std::uint32_t point) const {
  const ContactPoint& at = points_[point];
  double stick = stick_[at.part];
  const auto column = body_.element_columns.find("stick_change");
  if (column == body_.element_columns.end() || column->second.components != 1) return stick;
  for (std::uint32_t a = 0; a < at.at.count; ++a)
    stick += at.at.weights[a] * column->second.values[at.at.elements[a]];
  return std::max(stick, 0.0);
}

// m, that a traction of `stick` draws a contact of stiffness `foundation` out.
double Contacts::holds(std::uint32_t i, double stick, double foundation) const {
  return stick > 0 ? std::min(stick / foundation, kMostDrawn * points_[i].width) : 0;
}

PairConstants Contacts::constants(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = points_[i], &b = points_[j];
  const bool balls = a.radius > 0 && b.radius > 0;
  PairConstants pair;
  pair.stiffness = foundation(i, j) * (balls ? 0.5 * (a.area + b.area) : a.area * b.area);
  pair.width = balls ? 0 : std::max(a.width, b.width);
  pair.facing_from = std::min(a.facing_from, b.facing_from);
  pair.facing_fully = std::min(a.facing_fully, b.facing_fully);
  pair.limit = a.depth + b.depth;
  pair.law = {kSoft * std::min(a.width, b.width), 0.25 * pair.limit};
  return pair;
}

PairConstants Contacts::plane_constants(std::uint32_t i) const {
  const ContactPoint& point = points_[i];
  PairConstants pair;
  pair.stiffness = foundation_[point.part] * point.area;
  pair.facing_from = point.facing_from;
  pair.facing_fully = point.facing_fully;
  pair.limit = std::numeric_limits<double>::infinity();
  pair.law = {kSoft * point.width, 0.5 * point.depth};
  return pair;
}

// Of the points of one part that look at each other at rest, those that matter joins within kHops.
void Contacts::find_near_matter(const Problem& problem) {
  std::vector<Vec3> rest;
  for (const ContactPoint& point : points_) rest.push_back(point.rest);
  if (rest.empty()) return;
  const Neighbours facing =
      neighbours_within(rest, kNearMatter * widest_, [&](std::uint32_t i, std::uint32_t j) {
        const ContactPoint &a = points_[i], &b = points_[j];
        return a.part == b.part && (a.rest - b.rest).norm() < kNearMatter * a.width &&
               a.normal.dot(b.normal) < kSameSide;
      });
  const Adjacency matter = element_adjacency(problem.body);
  std::vector<std::vector<std::uint32_t>> joined(points_.size());
  parallel_for_each(
      points_.size(),
      [&](std::size_t i) {
        if (facing.of(i).empty()) return;
        const InterpolationWeights& from = points_[i].at;
        std::vector<std::uint32_t> reached(from.elements.begin(), from.elements.begin() + from.count);
        std::size_t begin = 0;
        for (int hop = 0; hop < kHops; ++hop) {
          const std::size_t end = reached.size();
          for (std::size_t r = begin; r < end; ++r)
            for (const std::uint32_t next : matter.of(reached[r])) reached.push_back(next);
          std::sort(reached.begin(), reached.end());
          reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
          begin = 0;
        }
        for (const std::uint32_t j : facing.of(i)) {
          const InterpolationWeights& to = points_[j].at;
          for (std::uint32_t a = 0; a < to.count; ++a)
            if (std::binary_search(reached.begin(), reached.end(), to.elements[a])) {
              joined[i].push_back(j);
              break;
            }
        }
      },
      64);
  near_matter_.offsets.assign(1, 0);
  for (const auto& own : joined) {
    near_matter_.others.insert(near_matter_.others.end(), own.begin(), own.end());
    near_matter_.offsets.push_back(near_matter_.others.size());
  }
}

bool Contacts::near_in_matter(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = points_[i], &b = points_[j];
  if ((a.rest - b.rest).norm() >= kNearMatter * a.width) return false;
  if (a.normal.dot(b.normal) >= kSameSide && a.shape != ContactShape::ball) return true;
  const std::span<const std::uint32_t> joined = near_matter_.of(std::min(i, j));
  return std::binary_search(joined.begin(), joined.end(), std::max(i, j));
}

bool Contacts::bonded(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = points_[i], &b = points_[j];
  const std::array parts{std::min(a.part, b.part), std::max(a.part, b.part)};
  return std::find(settings_.bonded.begin(), settings_.bonded.end(), parts) != settings_.bonded.end() &&
         (a.rest - b.rest).norm() < kNearMatter * std::max(a.width, b.width);
}

// How far elements have moved since the pairs were found: half the diagonal of the box of their moves, which
// is nothing where all move together.
void Contacts::refresh(const State& state) {
  if (built_) {
    struct Moves : Box {
      Moves& operator+=(const Box& other) {
        min = min.cwiseMin(other.min);
        max = max.cwiseMax(other.max);
        return *this;
      }
    };
    Moves moves = parallel_sum<Moves>(elements_.size(), [&](std::size_t e) {
      Moves one;
      one.add(state.displacement[elements_[e]] - built_at_[e]);
      return one;
    });
    if (!settings_.planes.empty()) moves.add(Vec3::Zero());
    if (0.5 * moves.diagonal() <= slack_ && broken_cells() == built_with_) return;
  }
  build(state);
}

void Contacts::build(const State& state) {
  built_ = true;
  built_with_ = broken_cells();
  ++builds_;
  for (std::size_t e = 0; e < elements_.size(); ++e) built_at_[e] = state.displacement[elements_[e]];
  std::vector<Vec3> positions(points_.size()), normals(points_.size());
  parallel_for_each(
      points_.size(),
      [&](std::size_t i) {
        const Side now = side(static_cast<std::uint32_t>(i), state);
        positions[i] = now.at.position;
        normals[i] = now.at.normal;
      },
      256);
  slack_ = 0.45 * kSkin * widest_;  // not quite half: weights outside [0, 1] carry a point further
  pairs_.clear();
  add_pairs(positions, normals);
  add_plane_pairs(positions, normals);
  std::sort(pairs_.begin(), pairs_.end(), [](const Pair& a, const Pair& b) { return a.key < b.key; });
  std::vector<Memory> kept;
  kept.reserve(pairs_.size());
  auto old = memory_.begin();
  for (const Pair& pair : pairs_) {
    while (old != memory_.end() && old->key < pair.key) ++old;
    const bool known = old != memory_.end() && old->key == pair.key;
    kept.push_back(known ? *old : Memory{pair.key});
    if (!(pair.holds > 0)) kept.back().stuck = kFree;
  }
  memory_ = std::move(kept);
  number_near();
}

void Contacts::add_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals) {
  const double skin = kSkin * widest_;
  double farthest = 0;  // that any two points touch over
  for (const ContactPoint& point : points_)
    farthest = std::max(farthest, point.radius > 0 ? 2 * point.radius + widest_ : 1.4143 * widest_);
  // only points of parts whose boxes are near one another
  std::vector<Box> box(body_.parts.size());
  for (std::size_t i = 0; i < points_.size(); ++i) box[points_[i].part].add(positions[i]);
  std::vector<std::uint8_t> engaged(body_.parts.size(), 0);
  for (std::size_t p = 0; p < engaged.size(); ++p) engaged[p] = settings_.self && !rigid_[p];
  double nearest = std::numeric_limits<double>::infinity();  // m, between boxes that are apart
  for (std::size_t a = 0; a < box.size(); ++a)
    for (std::size_t b = a + 1; b < box.size(); ++b) {
      if (box[a].empty() || box[b].empty()) continue;
      const Vec3 apart = (box[a].min - box[b].max).cwiseMax(box[b].min - box[a].max).cwiseMax(0);
      if (apart.norm() < farthest + skin)
        engaged[a] = engaged[b] = 1;
      else
        nearest = std::min(nearest, apart.norm() - farthest);
    }
  std::vector<std::uint32_t> in_grid;
  std::vector<Vec3> at;
  for (std::uint32_t i = 0; i < points_.size(); ++i)
    if (engaged[points_[i].part]) {
      in_grid.push_back(i);
      at.push_back(positions[i]);
    }
  if (in_grid.empty()) {
    if (settings_.planes.empty() && nearest > skin) slack_ = 0.45 * nearest;
    return;
  }
  const Neighbours found = neighbours_within(at, farthest + skin, [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t i = in_grid[a], j = in_grid[b];
    const bool same = points_[i].part == points_[j].part;
    if (same && (!settings_.self || rigid_[points_[i].part])) return false;
    if (led(points_[i].part) && led(points_[j].part)) return false;
    if (points_[i].shape == ContactShape::edge && points_[j].shape == ContactShape::edge) return false;
    const double near = reach(i, j) + skin;
    if ((at[b] - at[a]).squaredNorm() > near * near) return false;
    const auto directed = [&](std::uint32_t point) { return normals[point] != Vec3::Zero(); };
    if (directed(i) && directed(j) &&
        -normals[i].dot(normals[j]) < std::min(points_[i].facing_from, points_[j].facing_from) - kTurning)
      return false;
    return same ? !near_in_matter(i, j) : !bonded(i, j);
  });
  for (std::uint32_t a = 0; a < in_grid.size(); ++a)
    for (const std::uint32_t b : found.of(a)) {
      const std::uint32_t i = in_grid[a], j = in_grid[b];
      // the faces beside an edge have all of the area that sticks
      const bool edged = points_[i].shape == ContactShape::edge || points_[j].shape == ContactShape::edge;
      pairs_.push_back({i, j, 0, std::uint64_t{i} << 32 | j, 0.5 * (friction_of(i) + friction_of(j)),
                        constants(i, j),
                        edged ? 0 : holds(i, 0.5 * (stick_of(i) + stick_of(j)), foundation(i, j))});
    }
}

void Contacts::add_plane_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals) {
  const double skin = kSkin * widest_;
  for (std::uint32_t p = 0; p < settings_.planes.size(); ++p) {
    const ContactPlane& plane = settings_.planes[p];
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      if (led(points_[i].part)) continue;
      if ((positions[i] - plane.point).dot(plane.normal) - points_[i].radius > skin) continue;
      if (normals[i] != Vec3::Zero() && -normals[i].dot(plane.normal) < points_[i].facing_from - kTurning)
        continue;
      const double own = friction_of(i);
      const double stick = points_[i].shape == ContactShape::edge
                               ? 0
                               : 0.5 * (stick_of(i) + plane.stick.value_or(stick_of(i)));
      pairs_.push_back({i, kNoPoint, p, std::uint64_t{i} << 32 | (points_.size() + p),
                        0.5 * (own + plane.friction.value_or(own)), plane_constants(i),
                        holds(i, stick, foundation_[points_[i].part])});
    }
  }
}

// Pairs name points so far; from here on places in near_.
void Contacts::number_near() {
  near_.clear();
  std::vector<std::uint32_t> number(points_.size(), 0);
  for (const Pair& pair : pairs_) {
    number[pair.i] = 1;
    if (pair.j != kNoPoint) number[pair.j] = 1;
  }
  for (std::uint32_t i = 0; i < number.size(); ++i)
    if (number[i]) {
      number[i] = static_cast<std::uint32_t>(near_.size());
      near_.push_back(i);
    }
  for (Pair& pair : pairs_) {
    pair.i = number[pair.i];
    if (pair.j != kNoPoint) pair.j = number[pair.j];
  }
  near_elements_.clear();
  for (const std::uint32_t point : near_) {
    const InterpolationWeights& at = points_[point].at;
    near_elements_.insert(near_elements_.end(), at.elements.begin(), at.elements.begin() + at.count);
  }
  std::sort(near_elements_.begin(), near_elements_.end());
  near_elements_.erase(std::unique(near_elements_.begin(), near_elements_.end()), near_elements_.end());
  states_.assign(pairs_.size(), PairState{});
  is_close_.assign(pairs_.size(), 0);
  close_.clear();
}

}  // namespace flexel::simulate
