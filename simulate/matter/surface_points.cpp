// Bisection goes in two goes, the first to pieces large enough to be shared out to threads: one face may be
// two triangles. Depth first both times, so that the order is that of one go. Longest-edge bisection keeps
// the pieces of long slender triangles (which CAD tessellation is full of) few: their number grows with
// length over h, not with its square. The centroid rule on such small pieces integrates the piecewise
// trilinear weights of the cells to well under a percent of one cell's share, and exactly in sum, since the
// weights of a point sum to 1.
#include "simulate/matter/surface_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <optional>
#include <span>

#include "base/parallel.h"
#include "formats/pieces/other_pieces.h"

namespace flexel::simulate {
namespace {

constexpr double kLongestEdge = 0.3;  // of a piece, in spacings
constexpr double kThreadShare = 32;   // longest edge of what one thread cuts at a time, in those of a piece

// How a triangle is cut. Squared edges that differ by less than the share `same` are one: where a part lies decides nothing.
struct Cut {
  double longest = 0;  // m, edge of a piece
  double same = 0;
};

using Corners = std::array<Vec3, 3>;

// each(piece) for every piece of a triangle, depth first.
template <class Each>
void for_each_piece(const Corners& triangle, const Cut& cut, const Each& each) {
  std::vector<Corners> pending{triangle};
  while (!pending.empty()) {
    const Corners corners = pending.back();
    pending.pop_back();
    std::size_t edge = 0;
    double squared = 0;
    for (std::size_t e = 0; e < 3; ++e) {
      const double length = (corners[(e + 1) % 3] - corners[e]).squaredNorm();
      if (length > (1 + cut.same) * squared) {
        squared = length;
        edge = e;
      }
    }
    if (!(squared > (1 + cut.same) * cut.longest * cut.longest)) {
      each(corners);
      continue;
    }
    const Vec3 middle = 0.5 * (corners[edge] + corners[(edge + 1) % 3]);
    const Vec3& apex = corners[(edge + 2) % 3];
    pending.push_back({middle, corners[(edge + 1) % 3], apex});
    pending.push_back({corners[edge], middle, apex});
  }
}

// The triangles of the selected polygons, by polygon.
std::vector<std::uint32_t> selected_triangles(const Body& body, const Triangles& triangles,
                                              const std::vector<std::uint32_t>& polygons) {
  std::vector<std::uint8_t> chosen(body.surface.polygon_count(), 0);
  for (const std::uint32_t p : polygons) chosen[p] = 1;
  std::vector<std::uint32_t> list;
  for (std::uint32_t t = 0; t < triangles.polygon.size(); ++t)
    if (chosen[triangles.polygon[t]]) list.push_back(t);
  return list;
}

// What one thread cuts at a time.
struct Share {
  std::uint32_t polygon = 0;
  Corners corners;
};

// Of the pieces of a polygon. At centre placement a piece goes with one element, so its place counts.
Cut cut_of(const Body& body, std::uint32_t polygon) {
  constexpr double kSameEdge = 1e-9;
  const Part& part = body.parts[body.surface.polygon_part(polygon)];
  return {kLongestEdge * part.lattice.spacing.minCoeff(),
          part.placement == Placement::centre ? kSameEdge : 0};
}

std::vector<Share> shares_of(const Body& body, const Triangles& triangles,
                             const std::vector<std::uint32_t>& chosen) {
  std::vector<Share> shares;
  for (const std::uint32_t t : chosen) {
    const std::uint32_t polygon = triangles.polygon[t];
    Corners corners;
    for (std::size_t c = 0; c < 3; ++c) corners[c] = body.surface.vertices[triangles.corners[t][c]];
    Cut cut = cut_of(body, polygon);
    cut.longest *= kThreadShare;
    for_each_piece(corners, cut, [&](const Corners& piece) { shares.push_back({polygon, piece}); });
  }
  return shares;
}

std::vector<Share> shares_of(const Body& body, const std::vector<std::uint32_t>& polygons) {
  const Triangles triangles = triangulate(body.surface);
  return shares_of(body, triangles, selected_triangles(body, triangles, polygons));
}

// The point of a piece; its carrier has count 0 where nothing carries it.
SurfacePoint point_of(SurfaceCarriers& carriers, std::uint32_t polygon, const Corners& piece) {
  SurfacePoint point;
  point.position = (piece[0] + piece[1] + piece[2]) / 3;
  point.area_vector = 0.5 * (piece[1] - piece[0]).cross(piece[2] - piece[0]);
  point.polygon = polygon;
  if (const auto at = carriers(point.position, point.area_vector)) point.at = *at;
  return point;
}

// Sums of a share's points by what carries them: of area, and of area times position and weights.
class Gathered {
 public:
  // A point that is equally near to several elements (centre placement) goes with each by an equal share.
  void add(SurfacePoint point, std::span<const std::uint32_t> tied) {
    if (tied.size() < 2) return add(point);
    point.area_vector /= static_cast<double>(tied.size());
    for (const std::uint32_t element : tied) {
      point.at.elements[0] = element;
      add(point);
    }
  }

  void add(const SurfacePoint& point) {
    const double area = point.area_vector.norm();
    if (point.at.count == 0 || !(area > 0)) return;
    if (last_ == points_.size() || points_[last_].at.elements != point.at.elements) {
      last_ = static_cast<std::size_t>(
          std::find_if(points_.begin(), points_.end(),
                       [&](const SurfacePoint& each) { return each.at.elements == point.at.elements; }) -
          points_.begin());
      if (last_ == points_.size()) {
        points_.emplace_back().polygon = point.polygon;
        points_.back().at.elements = point.at.elements;
        points_.back().at.count = point.at.count;
        points_.back().at.weights.fill(0);
        areas_.push_back(0);
      }
    }
    SurfacePoint& sum = points_[last_];
    areas_[last_] += area;
    sum.area_vector += point.area_vector;
    sum.position += area * point.position;
    for (std::size_t a = 0; a < point.at.count; ++a) sum.at.weights[a] += area * point.at.weights[a];
  }

  // The means.
  std::vector<SurfacePoint> take() {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      points_[i].position /= areas_[i];
      for (double& weight : points_[i].at.weights) weight /= areas_[i];
    }
    return std::move(points_);
  }

 private:
  std::vector<SurfacePoint> points_;
  std::vector<double> areas_;  // m^2
  std::size_t last_ = 0;
};

// The first of each share's points, and the number of all.
std::vector<std::size_t> begins_of(const Body& body, const std::vector<Share>& shares) {
  std::vector<std::size_t> begin(shares.size() + 1, 0);
  parallel_for_each(
      shares.size(),
      [&](std::size_t s) {
        for_each_piece(shares[s].corners, cut_of(body, shares[s].polygon),
                       [&](const Corners&) { ++begin[s + 1]; });
      },
      16);
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  return begin;
}

std::vector<SurfacePoint> points_of(const Problem& problem, const std::vector<Share>& shares) {
  // There are some fifty points to a cell under a large face: they are counted first, so that no second copy
  // is needed.
  const std::vector<std::size_t> begin = begins_of(problem.body, shares);
  std::vector<SurfacePoint> points(begin.back());
  parallel_for_each(
      shares.size(),
      [&](std::size_t s) {
        std::size_t next = begin[s];
        SurfaceCarriers carriers(problem, shares[s].polygon);
        for_each_piece(shares[s].corners, cut_of(problem.body, shares[s].polygon), [&](const Corners& piece) {
          points[next++] = point_of(carriers, shares[s].polygon, piece);
        });
      },
      16);
  std::erase_if(points,
                [](const SurfacePoint& point) { return point.at.count == 0; });  // nothing carries them
  return points;
}

// Of a body in pieces: what lies under no cell of its own goes with the nearest, however far that is, and each process takes only what
// is surely its own. Throws WholeBodyNeeded where that is not all.
std::vector<SurfacePoint> if_complete(const std::vector<Share>& shares, std::vector<SurfacePoint> points) {
  if (!other_pieces()) return points;
  constexpr double kRounding = 1e-9;
  double area = 0;
  for (const Share& share : shares)
    if (other_pieces()->polygons_with_cells()[share.polygon])
      area += 0.5 * (share.corners[1] - share.corners[0]).cross(share.corners[2] - share.corners[0]).norm();
  const double found = over_pieces(total_area(points));
  if (std::abs(found - area) > kRounding * area)
    throw WholeBodyNeeded("some of its surface is further than a cell from any cell under it");
  return points;
}

}  // namespace

std::vector<SurfacePoint> surface_points(const Problem& problem, const std::vector<std::uint32_t>& polygons) {
  const std::vector<Share> shares = shares_of(problem.body, polygons);
  return if_complete(shares, points_of(problem, shares));
}

std::vector<SurfacePoint> surface_points(const Problem& problem, const Triangles& triangles,
                                         const std::vector<std::uint32_t>& chosen) {
  return points_of(problem, shares_of(problem.body, triangles, chosen));
}

std::vector<SurfacePoint> gathered_surface_points(const Problem& problem,
                                                  const std::vector<std::uint32_t>& polygons) {
  const std::vector<Share> shares = shares_of(problem.body, polygons);
  std::vector<std::vector<SurfacePoint>> gathered(shares.size());
  parallel_for_each(
      shares.size(),
      [&](std::size_t s) {
        Gathered sums;
        SurfaceCarriers carriers(problem, shares[s].polygon);
        for_each_piece(shares[s].corners, cut_of(problem.body, shares[s].polygon), [&](const Corners& piece) {
          const SurfacePoint point = point_of(carriers, shares[s].polygon, piece);
          sums.add(point, carriers.tied(point.position, point.area_vector));
        });
        gathered[s] = sums.take();
      },
      16);
  std::vector<SurfacePoint> points;
  for (const std::vector<SurfacePoint>& share : gathered)
    points.insert(points.end(), share.begin(), share.end());
  return if_complete(shares, std::move(points));
}

std::vector<SurfacePoint> shared_evenly(const Problem& problem, std::vector<SurfacePoint> points) {
  std::optional<SurfaceCarriers> carriers;
  std::optional<std::uint32_t> polygon;
  const std::size_t count = points.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (points[i].at.count != 1) continue;
    if (polygon != points[i].polygon) carriers.emplace(problem, *(polygon = points[i].polygon));
    const std::span<const std::uint32_t> tied = carriers->tied(points[i].position, points[i].area_vector);
    if (tied.size() < 2) continue;
    points[i].area_vector /= static_cast<double>(tied.size());
    for (std::size_t t = 0; t < tied.size(); ++t) {
      SurfacePoint share = points[i];
      share.at.elements[0] = tied[t];
      t == 0 ? static_cast<void>(points[i] = share) : points.push_back(share);
    }
  }
  return points;
}

std::vector<std::size_t> surface_point_counts(const Body& body) {
  const Triangles triangles = triangulate(body.surface);
  std::vector<std::uint32_t> all(triangles.polygon.size());
  std::iota(all.begin(), all.end(), 0U);
  const std::vector<Share> shares = shares_of(body, triangles, all);
  const std::vector<std::size_t> begin = begins_of(body, shares);
  std::vector<std::size_t> counts(body.parts.size(), 0);
  for (std::size_t s = 0; s < shares.size(); ++s)
    counts[body.surface.polygon_part(shares[s].polygon)] += begin[s + 1] - begin[s];
  return counts;
}

double total_area(const std::vector<SurfacePoint>& points) {
  double area = 0;
  for (const SurfacePoint& point : points) area += point.area_vector.norm();
  return area;
}

}  // namespace flexel::simulate
