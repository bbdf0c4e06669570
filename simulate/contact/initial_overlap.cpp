// Points of two parts, each against the surface of the other.
#include "simulate/contact/initial_overlap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/LU>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/contact/points/broad_phase.h"

namespace flexel::simulate {
namespace {

constexpr double kSearched = 4;        // spacings, of penetration that is searched for
constexpr double kReleased = 0.9;      // of the depth at which two surfaces do not act on each other any more
constexpr double kFacingCosine = 0.5;  // cosine from which surfaces face each other
constexpr double kBeside = 1;          // spacings along a surface, within which a point across is beside it
constexpr double kNearEnough = 1.5;    // spacings, from a point in a cut cell to one that faces it
constexpr double kSquashed = 0.05;     // of its volume at rest, below which a cell is left out

struct Depth {
  double depth = 0, most = 0;    // m: penetration, and the largest that can be released; 0: none
  bool beyond_searched = false;  // deeper than searched for
};

// m, of a point at `i` behind the surface at `j`, along the mean of their normals as in pair_law.h.
double penetration(const ContactSide& i, const ContactSide& j) {
  const Vec3 b = i.own_plane * i.normal - j.own_plane * j.normal;
  return i.radius + j.radius - (j.position - i.position).dot(b.normalized());
}

[[noreturn]] void refuse_overlapping(const std::string& what, double depth, bool over,
                                     const std::string& when, const std::string& mend) {
  throw InputError("[contact]",
                   fmt::format("{} by {}{:.3g} mm at {}: move them apart, bond them ([[bond]]), leave "
                               "one out of \"parts\", or {}",
                               what, over ? "more than " : "", 1e3 * depth, when, mend));
}

std::string advice(double release_time, double most) {
  return release_time > 0
             ? fmt::format("take larger cells: \"overlap\" = \"part\" lets out up to {:.3g} mm here",
                           1e3 * most)
             : fmt::format("give \"overlap\" = \"part\", which lets out up to {} cells", kReleased);
}

struct WholeCell {
  Vec3 centre = Vec3::Zero();      // m, in the state
  Mat3 to_lattice = Mat3::Zero();  // from a place relative to it to that in the lattice, in cells
};

class OverlapCheck {
 public:
  OverlapCheck(const ContactSettings& settings, const ContactSurface& surface, const State& state)
      : settings_(settings), surface_(surface), body_(surface.body()), state_(state) {
    box_.resize(body_.parts.size());
    for (std::uint32_t i = 0; i < surface.points().size(); ++i) {
      now_.push_back(surface.at(i, state));
      box_[surface.points()[i].part].add(now_.back().side.position);
    }
  }

  void refuse_planes(std::size_t known, const std::string& when) const;
  void refuse_parts(std::size_t known, const std::string& when) const;

 private:
  // Points of two parts, those of the first before those of the second.
  struct TwoParts {
    std::vector<std::uint32_t> points;
    std::vector<std::uint8_t> inside;  // (points) 1: in a whole cell of the other part
    std::vector<Vec3> at;              // (points) m
    Neighbours near;                   // pairs of points of both parts
  };
  [[nodiscard]] std::vector<std::uint8_t> moved_parts() const;
  [[nodiscard]] std::vector<std::uint32_t> points_near(std::uint32_t part, const Box& common) const;
  [[nodiscard]] std::vector<WholeCell> whole_cells(std::uint32_t part, const Box& box, double& reach) const;
  [[nodiscard]] std::vector<std::uint8_t> inside(const std::vector<std::uint32_t>& points,
                                                 std::uint32_t other) const;
  [[nodiscard]] double opposite(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] Depth deepest(const std::array<std::uint32_t, 2>& parts, const Box& common) const;
  [[nodiscard]] std::vector<Depth> depths(const TwoParts& two) const;
  [[nodiscard]] const ContactPoint& point(std::uint32_t i) const { return surface_.points()[i]; }

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  const Body& body_;
  const State& state_;
  std::vector<PointState> now_;  // (points)
  std::vector<Box> box_;         // (parts) of their points
};

// Whole cells of `part` near `box`; `reach` [m] becomes the largest distance of a corner from its centre.
std::vector<WholeCell> OverlapCheck::whole_cells(std::uint32_t part, const Box& box, double& reach) const {
  std::vector<WholeCell> cells;
  const Part& of = body_.parts[part];
  for (std::uint32_t c = of.cell_begin; c < of.cell_end; ++c) {
    if (body_.broken[c] || !(body_.fill[c] > 0.999)) continue;
    const std::array<std::uint32_t, 8>& corners = body_.cell_elements[c];
    WholeCell cell;
    Mat3 f = Mat3::Identity();
    for (std::size_t a = 0; a < 8; ++a) {
      cell.centre += (body_.rest[corners[a]] + state_.displacement[corners[a]]) / 8;
      f += state_.displacement[corners[a]] * surface_.gradients(part)[a].transpose();
    }
    const double margin = 2 * of.lattice.spacing.maxCoeff();
    if ((cell.centre - box.min).minCoeff() < -margin || (box.max - cell.centre).minCoeff() < -margin)
      continue;
    if (!(f.determinant() > kSquashed)) continue;
    cell.to_lattice =
        of.lattice.spacing.cwiseInverse().asDiagonal() * of.lattice.axes.transpose() * f.inverse();
    cells.push_back(cell);
    for (const std::uint32_t e : corners)
      reach = std::max(reach, (body_.rest[e] + state_.displacement[e] - cell.centre).norm());
  }
  return cells;
}

// (points) 1: in a whole cell of the part `other`.
std::vector<std::uint8_t> OverlapCheck::inside(const std::vector<std::uint32_t>& points,
                                               std::uint32_t other) const {
  std::vector<Vec3> at;
  Box box;
  for (const std::uint32_t i : points) {
    at.push_back(now_[i].side.position - 1.01 * kTouchingDepth * point(i).width * now_[i].side.normal);
    box.add(at.back());
  }
  double reach = 0;
  const std::vector<WholeCell> cells = whole_cells(other, box, reach);
  for (const WholeCell& cell : cells) at.push_back(cell.centre);
  std::vector<std::uint8_t> inside(points.size(), 0);
  if (cells.empty() || points.empty()) return inside;
  const Neighbours holding = neighbours_within(at, reach, [&](std::uint32_t i, std::uint32_t j) {
    if (i >= points.size() || j < points.size()) return false;
    const Vec3 place = cells[j - points.size()].to_lattice * (at[i] - at[j]);
    return place.cwiseAbs().maxCoeff() < 0.5;
  });
  for (std::size_t i = 0; i < points.size(); ++i) inside[i] = !holding.of(i).empty();
  return inside;
}

// Faces and balls of `part` within reach of `common`.
std::vector<std::uint32_t> OverlapCheck::points_near(std::uint32_t part, const Box& common) const {
  std::vector<std::uint32_t> points;
  const double margin = kSearched * surface_.widest();
  for (std::uint32_t i = 0; i < now_.size(); ++i) {
    if (point(i).part != part || point(i).shape == ContactShape::edge || now_[i].shapeless) continue;
    const Vec3& at = now_[i].side.position;
    if ((at - common.min).minCoeff() < -margin || (common.max - at).minCoeff() < -margin) continue;
    points.push_back(i);
  }
  return points;
}

// Cosine between one normal and minus the other; of a ball 1.
double OverlapCheck::opposite(std::uint32_t i, std::uint32_t j) const {
  const Vec3 &a = now_[i].side.normal, &b = now_[j].side.normal;
  return a == Vec3::Zero() || b == Vec3::Zero() ? 1 : -a.dot(b);
}

// Of the two parts of these numbers; `common` is where their boxes overlap.
Depth OverlapCheck::deepest(const std::array<std::uint32_t, 2>& parts, const Box& common) const {
  TwoParts two;
  two.points = points_near(parts[0], common);
  const std::vector<std::uint32_t> second = points_near(parts[1], common);
  const std::size_t first = two.points.size();
  two.inside = inside(two.points, parts[1]);
  const std::vector<std::uint8_t> second_inside = inside(second, parts[0]);
  two.inside.insert(two.inside.end(), second_inside.begin(), second_inside.end());
  two.points.insert(two.points.end(), second.begin(), second.end());
  if (std::count(two.inside.begin(), two.inside.end(), 1) == 0) return {};
  for (const std::uint32_t i : two.points) two.at.push_back(now_[i].side.position);
  const double widest = surface_.widest();
  two.near = neighbours_within(two.at, kSearched * widest, [&](std::uint32_t a, std::uint32_t b) {
    if (a >= first || b < first) return false;
    const double cosine = opposite(two.points[a], two.points[b]);
    if (cosine < -kFacingCosine) return false;
    const bool close = cosine > kFacingCosine && (two.at[b] - two.at[a]).norm() < kNearEnough * widest;
    return two.inside[a] || two.inside[b] || close;
  });
  const std::vector<Depth> all = depths(two);
  Depth deepest;
  for (std::size_t a = 0; a < all.size(); ++a) {
    if (!two.inside[a]) continue;
    Depth own = all[a];
    if (!std::isfinite(own.depth)) own = {kSearched * widest, kReleased * point(two.points[a]).width, true};
    if (deepest.most == 0 || own.depth * deepest.most > deepest.depth * own.most) deepest = own;
  }
  return deepest;
}

// (points) of a point that no surface of the other part is near: infinity.
std::vector<Depth> OverlapCheck::depths(const TwoParts& two) const {
  const auto for_each_way = [&](const auto& visit) {
    for (std::uint32_t a = 0; a < two.points.size(); ++a)
      for (const std::uint32_t b : two.near.of(a)) {
        visit(a, b);
        visit(b, a);
      }
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<double> distance(two.points.size(), kInfinity);
  std::vector<Depth> facing(two.points.size(), Depth{kInfinity, 0});
  for_each_way([&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t i = two.points[a], j = two.points[b];
    const double apart = (two.at[b] - two.at[a]).norm();
    if (!(opposite(i, j) > kFacingCosine && apart < distance[a])) return;
    const double depth = penetration(now_[i].side, now_[j].side);
    if (!(depth > 0)) return;
    distance[a] = apart;
    facing[a] = {depth, kReleased * (point(i).depth + point(j).depth)};
  });
  std::vector<Depth> least = facing;
  for_each_way([&](std::uint32_t a, std::uint32_t b) {
    if (!two.inside[a] || opposite(two.points[a], two.points[b]) > kFacingCosine) return;
    const ContactSide& on = now_[two.points[b]].side;
    const double depth = (on.position - two.at[a]).dot(on.normal);
    const Vec3 along = two.at[a] - on.position + depth * on.normal;
    if (!(depth > 0) || along.norm() > kBeside * point(two.points[b]).width) return;
    const double most = std::max(depth, facing[b].depth);
    if (most < least[a].depth) least[a] = {most, facing[b].most};
  });
  return least;
}

void OverlapCheck::refuse_planes(std::size_t known, const std::string& when) const {
  for (std::uint32_t i = 0; i < now_.size(); ++i) {
    if (point(i).part < known || surface_.prescribed(point(i).part)) continue;
    for (const ContactPlane& plane : settings_.planes)
      if (const double depth = point(i).radius - (now_[i].side.position - plane.point).dot(plane.normal);
          depth > kTouchingDepth * point(i).width)
        refuse_overlapping(
            fmt::format("part \"{}\" begins inside {}", body_.parts[point(i).part].name, plane.name), depth,
            false, when, advice(0, 0));
  }
}

// (parts) 1: displaced, as by an earlier run that has pressed it against others.
std::vector<std::uint8_t> OverlapCheck::moved_parts() const {
  std::vector<std::uint8_t> moved(body_.parts.size(), 0);
  for (std::size_t p = 0; p < moved.size(); ++p)
    for (std::uint32_t e = body_.parts[p].element_begin; e < body_.parts[p].element_end; ++e)
      moved[p] = moved[p] || state_.displacement[e] != Vec3::Zero();
  return moved;
}

void OverlapCheck::refuse_parts(std::size_t known, const std::string& when) const {
  const std::vector<std::uint8_t> moved = moved_parts();
  for (std::uint32_t a = 0; a < body_.parts.size(); ++a)
    for (auto b = std::max(a + 1, static_cast<std::uint32_t>(known)); b < body_.parts.size(); ++b) {
      if (surface_.prescribed(a) && surface_.prescribed(b)) continue;
      if (known == 0 && moved[a] && moved[b]) continue;
      const Box common{box_[a].min.cwiseMax(box_[b].min), box_[a].max.cwiseMin(box_[b].max)};
      if (common.empty()) continue;
      const Depth found = deepest({a, b}, common);
      const double spacing =
          std::min(body_.parts[a].lattice.spacing.mean(), body_.parts[b].lattice.spacing.mean());
      const double borne = settings_.release_time > 0 ? found.most : kTouchingDepth * spacing;
      if (found.depth > borne)
        refuse_overlapping(
            fmt::format("parts \"{}\" and \"{}\" overlap", body_.parts[a].name, body_.parts[b].name),
            found.depth, found.beyond_searched, when, advice(settings_.release_time, found.most));
    }
}

}  // namespace

void refuse_initial_overlap(const ContactSettings& settings, const ContactSurface& surface, std::size_t known,
                            const State& state) {
  if (known == surface.body().parts.size()) return;
  const std::string when =
      known == 0 ? "the start" : fmt::format("{:.4g} s, when it joins", state.time.value_or(0));
  const OverlapCheck check(settings, surface, state);
  if (!(settings.release_time > 0)) check.refuse_planes(known, when);
  check.refuse_parts(known, when);
}

}  // namespace flexel::simulate
