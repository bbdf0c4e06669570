// One direction after the other. Upper bounds of the distance of a piece of a triangle from the other
// surface:
//   - the largest distance of its corners from the same points of the same triangle there (distance is convex),
//   - the largest distance of its corners from any single triangle there (likewise),
//   - the distance of its centre plus its radius (distance is 1-Lipschitz).
// Lower bounds: the distances of corners and centres. The piece with the largest upper bound comes first and
// is split where its bounds are too far apart. Closest points by CGAL's AABB tree.
#include "flexel/study/runs/hausdorff.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace flexel::study {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Corners = std::array<std::uint32_t, 3>;
using Facets = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Facets::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

constexpr int kBetweenLooks = 256;    // pieces, at the clock
constexpr int kMostPieces = 100'000;  // a side: about a second, beside runs of seconds

Kernel::Point_3 point(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

// Those without area add nothing: their points lie on the edges of others.
Facets facets_of(std::span<const Vec3> vertices, std::span<const Corners> triangles) {
  Facets facets;
  facets.reserve(triangles.size());
  for (const Corners& t : triangles) {
    const Vec3 u = vertices[t[1]] - vertices[t[0]], v = vertices[t[2]] - vertices[t[0]];
    if (u.cross(v).norm() > 0)
      facets.emplace_back(point(vertices[t[0]]), point(vertices[t[1]]), point(vertices[t[2]]));
  }
  return facets;
}

struct Piece {
  std::array<Vec3, 3> corner, partner;  // on the one surface; the same points of the other's triangle
  double at_most = std::numeric_limits<double>::infinity();

  void bound_by_partners() {
    double most = 0;
    for (std::size_t i = 0; i < 3; ++i) most = std::max(most, (corner[i] - partner[i]).norm());
    at_most = std::min(at_most, most);
  }
  [[nodiscard]] bool operator<(const Piece& other) const { return at_most < other.at_most; }
};

// Halves of the longest edge.
std::array<Piece, 2> halves(const Piece& piece) {
  std::size_t longest = 0;
  const auto length = [&](std::size_t i) { return (piece.corner[i] - piece.corner[(i + 1) % 3]).norm(); };
  for (const std::size_t i : {1, 2})
    if (length(i) > length(longest)) longest = i;
  const std::size_t next = (longest + 1) % 3;
  std::array<Piece, 2> result = {piece, piece};
  result[0].corner[longest] = result[1].corner[next] = 0.5 * (piece.corner[longest] + piece.corner[next]);
  result[0].partner[longest] = result[1].partner[next] = 0.5 * (piece.partner[longest] + piece.partner[next]);
  for (Piece& half : result) half.bound_by_partners();
  return result;
}

class OneSide {
 public:
  OneSide(const Facets& other, std::chrono::steady_clock::time_point deadline)
      : tree_(other.begin(), other.end()), deadline_(deadline) {
    tree_.build();
  }

  // Of the surface `from`: at most the result, and no more than the margin below it or below `known`, which
  // is a distance that the whole has for certain.
  double operator()(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Corners> triangles,
                    double known) {
    at_least_ = known;
    std::vector<Piece> first(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        first[t].corner.at(i) = from[triangles[t].at(i)];
        first[t].partner.at(i) = to[triangles[t].at(i)];
      }
      first[t].bound_by_partners();
    }
    std::priority_queue<Piece> open({}, std::move(first));
    for (int pieces = 0; !open.empty() && open.top().at_most > (1 + kHausdorffMargin) * at_least_; ++pieces) {
      if (pieces == kMostPieces ||
          (pieces % kBetweenLooks == 0 && std::chrono::steady_clock::now() > deadline_))
        return open.top().at_most;
      Piece piece = open.top();
      open.pop();
      look_at(piece);
      if (piece.at_most <= (1 + kHausdorffMargin) * at_least_) {
        settled_ = std::max(settled_, piece.at_most);
        continue;
      }
      for (const Piece& half : halves(piece)) open.push(half);
    }
    return std::max(settled_, open.empty() ? 0 : open.top().at_most);
  }

  [[nodiscard]] double at_least() const { return at_least_; }

 private:
  void look_at(Piece& piece) {
    const Vec3 middle = (piece.corner[0] + piece.corner[1] + piece.corner[2]) / 3;
    double radius = 0;
    for (const Vec3& each : piece.corner) radius = std::max(radius, (each - middle).norm());
    const auto look = [&](const Vec3& at) {
      const auto [closest, facet] = tree_.closest_point_and_primitive(point(at));
      const double distance = std::sqrt(CGAL::squared_distance(point(at), closest));
      at_least_ = std::max(at_least_, distance);
      double most = 0;
      for (const Vec3& each : piece.corner)
        most = std::max(most, CGAL::squared_distance(point(each), *facet));
      piece.at_most = std::min(piece.at_most, std::sqrt(most));
      return distance;
    };
    piece.at_most = std::min(piece.at_most, look(middle) + radius);
    for (const Vec3& each : piece.corner) look(each);
  }

  Tree tree_;
  std::chrono::steady_clock::time_point deadline_;
  double at_least_ = 0, settled_ = 0;
};

}  // namespace

double hausdorff_distance(std::span<const Vec3> a, std::span<const Vec3> b,
                          std::span<const Corners> triangles,
                          std::chrono::steady_clock::time_point deadline) {
  const Facets on_a = facets_of(a, triangles), on_b = facets_of(b, triangles);
  if (on_a.empty() || on_b.empty()) return 0;
  OneSide to_b(on_b, deadline), to_a(on_a, deadline);
  const double first = to_b(a, b, triangles, 0);
  const double second = to_a(b, a, triangles, to_b.at_least());
  return std::max(first, second);
}

}  // namespace flexel::study
