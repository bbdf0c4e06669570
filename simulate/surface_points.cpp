// Bisection goes in two goes, the first to pieces large enough to be shared out to threads: one face may be
// two triangles. Depth first both times, so that the order is that of one go. Longest-edge bisection keeps
// the pieces of long slender triangles (which CAD tessellation is full of) few: their number grows with
// length over h, not with its square. The centroid rule on such small pieces integrates the piecewise
// trilinear weights of the cells to well under a percent of one cell's share, and exactly in sum, since the
// weights of a point sum to 1.
#include "simulate/surface_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "formats/parallel.h"

namespace flexel {
namespace {

constexpr double kLongestEdge = 0.3;  // of a piece, in spacings
constexpr double kThreadShare = 32;   // longest edge of what one thread cuts at a time, in those of a piece

using Corners = std::array<Vec3, 3>;

void add_pieces(const Corners& triangle, double longest, std::vector<Corners>& pieces) {
  std::vector<Corners> pending{triangle};
  while (!pending.empty()) {
    const Corners corners = pending.back();
    pending.pop_back();
    std::size_t edge = 0;
    double length = 0;
    for (std::size_t e = 0; e < 3; ++e) {
      const double each = (corners[(e + 1) % 3] - corners[e]).norm();
      if (each > length) {
        length = each;
        edge = e;
      }
    }
    if (!(length > longest)) {
      pieces.push_back(corners);
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

}  // namespace

std::vector<SurfacePoint> surface_points(const Setting& setting, const std::vector<std::uint32_t>& polygons) {
  const Body& body = setting.body;
  const Triangles triangles = triangulate(body.surface);
  const std::vector<std::uint32_t> list = selected_triangles(body, triangles, polygons);
  struct Share {
    std::uint32_t polygon = 0;
    Corners corners;
  };
  const auto longest = [&](std::uint32_t polygon) {
    return kLongestEdge * body.parts[body.surface.polygon_part(polygon)].lattice.spacing.minCoeff();
  };
  std::vector<Share> shares;
  std::vector<Corners> pieces_of_one;
  for (const std::uint32_t t : list) {
    const std::uint32_t polygon = triangles.polygon[t];
    Corners corners;
    for (std::size_t c = 0; c < 3; ++c) corners[c] = body.surface.vertices[triangles.corners[t][c]];
    pieces_of_one.clear();
    add_pieces(corners, kThreadShare * longest(polygon), pieces_of_one);
    for (const Corners& piece : pieces_of_one) shares.push_back({polygon, piece});
  }
  // There are some fifty points to a cell under a large face: they are counted first, so that no second copy
  // is needed.
  std::vector<std::size_t> begin(shares.size() + 1, 0);
  const auto cut = [&](const Share& share) {
    std::vector<Corners> pieces;
    add_pieces(share.corners, longest(share.polygon), pieces);
    return pieces;
  };
  parallel_for_each(
      shares.size(), [&](std::size_t s) { begin[s + 1] = cut(shares[s]).size(); }, 16);
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<SurfacePoint> points(begin.back());
  parallel_for_each(
      shares.size(),
      [&](std::size_t s) {
        const std::uint32_t polygon = shares[s].polygon;
        std::size_t next = begin[s];
        for (const Corners& piece : cut(shares[s])) {
          const Vec3 centre = (piece[0] + piece[1] + piece[2]) / 3;
          const Vec3 area = 0.5 * (piece[1] - piece[0]).cross(piece[2] - piece[0]);
          if (const auto at = carrier_on_surface(setting, polygon, centre, area))
            points[next] = {*at, centre, area, polygon};
          ++next;
        }
      },
      16);
  std::erase_if(points,
                [](const SurfacePoint& point) { return point.at.count == 0; });  // nothing carries them
  return points;
}

double total_area(const std::vector<SurfacePoint>& points) {
  double area = 0;
  for (const SurfacePoint& point : points) area += point.area_vector.norm();
  return area;
}

}  // namespace flexel
