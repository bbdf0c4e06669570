// Parts that begin inside each other: contact would throw them apart, or not see them at all where they are
// deeper in than it reaches. So they are refused, or let out as far as that goes (contact_parting.cpp).
//
// A point of one part's surface is inside another where, drawn in by a little, it lies in a whole cell of
// that; matter in cut cells is left alone. Its depth there is its distance, as contact measures it, from the
// nearest surface of the other that faces it. What stands across, as the sides of a block do whose end is
// inside, has none near: it comes out with the surface of the other that it stands on, and is as deep as that
// is or as it is behind that. Two parts are as deep in each other as their deepest point.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/LU>

#include "base/error.h"
#include "simulate/contact/contacts.h"

namespace flexel::simulate {
namespace {

constexpr double kBorne = 0.05;  // spacings
constexpr double kLookAt = 4;    // spacings, how deep is looked
constexpr double kLetOut = 0.9;  // of the depth at which two surfaces do not feel one another any more
constexpr double kFacing = 0.5;  // cosine from which surfaces face each other
constexpr double kBeside = 1;    // spacings along a surface, within which what stands on it comes out with it
constexpr double kNearEnough = 1.5;  // spacings, from what faces it to a point in a cut cell
constexpr double kSquashed = 0.05;   // of its volume: a cell below it is not looked into

// m, that a point at `i` is behind the surface at `j`, along the mean of their normals as in pair_law.h.
double behind(const ContactSide& i, const ContactSide& j) {
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

std::string advice(double parting, double most) {
  return parting > 0 ? fmt::format("take larger cells: \"overlap\" = \"part\" lets out up to {:.3g} mm here",
                                   1e3 * most)
                     : fmt::format("give \"overlap\" = \"part\", which lets out up to {} cells", kLetOut);
}

}  // namespace

// Which of `points` lie in whole cells of the part `other`.
std::vector<std::uint8_t> Contacts::inside(const std::vector<std::uint32_t>& points, std::uint32_t other,
                                           const std::vector<Side>& sides, const State& state) const {
  std::vector<Vec3> at;
  Box box;
  for (const std::uint32_t i : points) {
    at.push_back(sides[i].at.position - 1.01 * kBorne * points_[i].width * sides[i].at.normal);
    box.add(at.back());
  }
  struct WholeCell {
    Vec3 centre = Vec3::Zero();      // m, now
    Mat3 to_lattice = Mat3::Zero();  // from there to what it is of a cell in the lattice
  };
  std::vector<WholeCell> cells;
  const Part& part = body_.parts[other];
  double reach = 0;  // m, of a corner from the middle
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
    if (body_.broken[c] || !(body_.fill[c] > 0.999)) continue;
    const std::array<std::uint32_t, 8>& corners = body_.cell_elements[c];
    WholeCell cell;
    Mat3 f = Mat3::Identity();
    for (std::size_t a = 0; a < 8; ++a) {
      cell.centre += (body_.rest[corners[a]] + state.displacement[corners[a]]) / 8;
      f += state.displacement[corners[a]] * gradients_[other][a].transpose();
    }
    const double margin = 2 * part.lattice.spacing.maxCoeff();
    if ((cell.centre - box.min).minCoeff() < -margin || (box.max - cell.centre).minCoeff() < -margin)
      continue;
    if (!(f.determinant() > kSquashed)) continue;
    cell.to_lattice =
        part.lattice.spacing.cwiseInverse().asDiagonal() * part.lattice.axes.transpose() * f.inverse();
    cells.push_back(cell);
    for (const std::uint32_t e : corners)
      reach = std::max(reach, (body_.rest[e] + state.displacement[e] - cell.centre).norm());
  }
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

// The deepest that a point of one of two parts, numbered `parts`, is inside the other.
Contacts::Overlap Contacts::overlap(const std::array<std::uint32_t, 2>& parts, const Box& common,
                                    const std::vector<Side>& sides, const State& state) const {
  std::array<std::vector<std::uint32_t>, 2> of;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (points_[i].shape == ContactShape::edge || sides[i].shapeless) continue;
    const Vec3& at = sides[i].at.position;
    const double margin = kLookAt * widest_;
    if ((at - common.min).minCoeff() < -margin || (common.max - at).minCoeff() < -margin) continue;
    for (std::size_t side = 0; side < 2; ++side)
      if (points_[i].part == parts[side]) of[side].push_back(i);
  }
  std::vector<std::uint8_t> in = inside(of[0], parts[1], sides, state);
  const std::vector<std::uint8_t> others = inside(of[1], parts[0], sides, state);
  in.insert(in.end(), others.begin(), others.end());
  std::vector<std::uint32_t> points = of[0];
  points.insert(points.end(), of[1].begin(), of[1].end());
  if (std::count(in.begin(), in.end(), 1) == 0) return {};

  std::vector<Vec3> at;
  at.reserve(points.size());
  for (const std::uint32_t i : points) at.push_back(sides[i].at.position);
  const auto opposite = [&](std::uint32_t a, std::uint32_t b) {  // cosine; of a ball 1
    const Vec3 &i = sides[points[a]].at.normal, &j = sides[points[b]].at.normal;
    return i == Vec3::Zero() || j == Vec3::Zero() ? 1 : -i.dot(j);
  };
  const Neighbours near = neighbours_within(at, kLookAt * widest_, [&](std::uint32_t a, std::uint32_t b) {
    if (a >= of[0].size() || b < of[0].size() || opposite(a, b) < -kFacing) return false;
    const bool close = opposite(a, b) > kFacing && (at[b] - at[a]).norm() < kNearEnough * widest_;
    return in[a] || in[b] || close;
  });
  const auto for_each_way = [&](const auto& visit) {
    for (std::uint32_t a = 0; a < of[0].size(); ++a)
      for (const std::uint32_t b : near.of(a)) {
        visit(a, b);
        visit(b, a);
      }
  };
  struct Found {
    double distance = std::numeric_limits<double>::infinity();
    Overlap facing{distance, 0}, least{distance, 0};
  };
  std::vector<Found> found(points.size());
  for_each_way([&](std::uint32_t a, std::uint32_t b) {
    const ContactPoint &from = points_[points[a]], &to = points_[points[b]];
    const double distance = (at[b] - at[a]).norm();
    if (!(opposite(a, b) > kFacing && distance < found[a].distance)) return;
    const double depth = behind(sides[points[a]].at, sides[points[b]].at);
    if (depth > 0) found[a] = {distance, {depth, kLetOut * (from.depth + to.depth)}, {}};
  });
  for (Found& each : found) each.least = each.facing;
  for_each_way([&](std::uint32_t a, std::uint32_t b) {
    if (!in[a] || opposite(a, b) > kFacing) return;
    const ContactSide& on = sides[points[b]].at;
    const double depth = (on.position - at[a]).dot(on.normal);
    const Vec3 along = at[a] - on.position + depth * on.normal;
    if (!(depth > 0) || along.norm() > kBeside * points_[points[b]].width) return;
    const double most = std::max(depth, found[b].facing.depth);
    if (most < found[a].least.depth) found[a].least = {most, found[b].facing.most};
  });
  Overlap deepest;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!in[i]) continue;
    Overlap least = found[i].least;
    if (!std::isfinite(least.depth)) least = {kLookAt * widest_, kLetOut * points_[points[i]].width, true};
    if (deepest.most == 0 || least.depth * deepest.most > deepest.depth * least.most) deepest = least;
  }
  return deepest;
}

void Contacts::refuse_overlap(const State& state) const {
  const std::size_t parts = body_.parts.size(), known = joined_.size();
  if (known == parts) return;
  const std::string when =
      known == 0 ? "the start" : fmt::format("{:.4g} s, when it joins", state.time.value_or(0));
  std::vector<Side> sides(points_.size());
  std::vector<Box> box(parts);
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    sides[i] = side(i, state);
    box[points_[i].part].add(sides[i].at.position);
  }
  if (!(settings_.parting > 0))
    for (const ContactPoint& point : points_) {
      if (point.part < known || led(point.part)) continue;
      const Vec3& at = sides[static_cast<std::size_t>(&point - points_.data())].at.position;
      for (const ContactPlane& plane : settings_.planes)
        if (const double depth = point.radius - (at - plane.point).dot(plane.normal);
            depth > kBorne * point.width)
          refuse_overlapping(
              fmt::format("part \"{}\" begins inside {}", body_.parts[point.part].name, plane.name), depth,
              false, when, advice(0, 0));
    }
  std::vector<std::uint8_t> moved(parts, 0);  // pressed by an earlier run, as a run may begin
  for (std::size_t p = 0; p < parts; ++p)
    for (std::uint32_t e = body_.parts[p].element_begin; e < body_.parts[p].element_end; ++e)
      moved[p] = moved[p] || state.displacement[e] != Vec3::Zero();
  for (std::uint32_t a = 0; a < parts; ++a)
    for (auto b = std::max(a + 1, static_cast<std::uint32_t>(known)); b < parts; ++b) {
      if ((led(a) && led(b)) || (known == 0 && moved[a] && moved[b])) continue;
      const Box common{box[a].min.cwiseMax(box[b].min), box[a].max.cwiseMin(box[b].max)};
      if (common.empty()) continue;
      const Overlap deepest = overlap({a, b}, common, sides, state);
      const double spacing =
          std::min(body_.parts[a].lattice.spacing.mean(), body_.parts[b].lattice.spacing.mean());
      const double borne = settings_.parting > 0 ? deepest.most : kBorne * spacing;
      if (deepest.depth > borne)
        refuse_overlapping(
            fmt::format("parts \"{}\" and \"{}\" overlap", body_.parts[a].name, body_.parts[b].name),
            deepest.depth, deepest.over, when, advice(settings_.parting, deepest.most));
    }
}

}  // namespace flexel::simulate
