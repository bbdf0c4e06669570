// Longest-edge bisection (M.-C. Rivara, "Algorithms for refining triangular grids suitable for adaptive and
// multigrid techniques", 1984), the longest edge of the whole mesh first: all triangles that have it are bisected at its
// midpoint, so the mesh conforms after each step. Needles, of which CAD tessellations are full, would become
// three times as many at each halving: their medians are as long as their sides. So medians come a little later than
// sides of their length, and one between coplanar triangles is flipped where the other diagonal is shorter, as it is once
// the sides are halved (Lawson, 1977). Ties go by vertex number, so the order is the same on every run. Only edges
// over the limit are kept in the table.
#include "formats/part/subdivide.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <unordered_map>

#include "base/error.h"
#include "base/units.h"

namespace flexel {
namespace {

// Of the squared length, by which medians come. An edge that is split is so at most 1 / 0.9 shorter, squared, than the longest
// of its triangles, and the median to it still shorter than itself: edges shrink.
constexpr double kMedian = 0.9;
constexpr double kFlat = 1e-12;  // of an edge: the distance from a plane of what lies in it

struct LongEdge {
  double rank = 0;             // m^2
  std::uint32_t a = 0, b = 0;  // vertices, a < b
  // The queue gives the greatest first: the longest, then the one with the lowest vertices.
  bool operator<(const LongEdge& other) const {
    if (rank != other.rank) return rank < other.rank;
    return a != other.a ? a > other.a : b > other.b;
  }
};

// The first `kept` rows of a column, then those that `row` names.
Column picked_rows(const Column& column, std::size_t kept, const std::vector<std::uint32_t>& row) {
  const auto n = static_cast<std::size_t>(column.components);
  Column result{column.components, {}};
  result.values.assign(column.values.begin(), column.values.begin() + static_cast<std::ptrdiff_t>(kept * n));
  for (const std::uint32_t r : row)
    for (std::size_t i = 0; i < n; ++i) result.values.push_back(column.values[r * n + i]);
  return result;
}

class Bisection {
 public:
  Bisection(Surface& surface, std::size_t first_polygon, double largest_edge)
      : vertices_(surface.vertices),
        vertex_columns_(surface.vertex_columns),
        polygon_face_(surface.polygon_face),
        limit2_(largest_edge * largest_edge),
        may_flip_(surface.vertex_columns.empty() && surface.polygon_columns.empty()) {
    for (std::size_t p = first_polygon; p < surface.polygon_count(); ++p) {
      const auto corners = surface.polygon(p);
      triangles_.push_back({corners[0], corners[1], corners[2]});
      origin_.push_back(static_cast<std::uint32_t>(p));
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t a = triangles_[t][i], b = triangles_[t][(i + 1) % 3];
        if (length2(a, b) > limit2_) users_[key(a, b)].push_back(t);
      }
    for (const auto& [edge, users] : users_) {
      const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
      queue_.push({(lies_in_a_plane({0, a, b}, users) ? kMedian : 1) * length2(a, b), a, b});
    }
  }

  [[nodiscard]] bool done() const { return queue_.empty(); }
  [[nodiscard]] std::size_t count() const { return triangles_.size(); }

  void split_longest() {
    const LongEdge edge = queue_.top();
    queue_.pop();
    const auto entry = users_.find(key(edge.a, edge.b));
    const std::vector<std::uint32_t> users = std::move(entry->second);
    users_.erase(entry);
    if (flip(edge, users)) return;
    const auto middle = static_cast<std::uint32_t>(vertices_.size());
    vertices_.push_back(0.5 * (vertices_[edge.a] + vertices_[edge.b]));
    for (auto& [name, column] : vertex_columns_) {
      const auto n = static_cast<std::size_t>(column.components);
      for (std::size_t i = 0; i < n; ++i)
        column.values.push_back(0.5 * (column.values[edge.a * n + i] + column.values[edge.b * n + i]));
    }
    for (const std::uint32_t t : users) split(t, edge, middle);
  }

  // Puts the triangles in the place of those they came from.
  void write(Surface& surface, std::size_t first_polygon) const {
    std::vector<std::uint32_t> order(triangles_.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t s, std::uint32_t t) { return origin_[s] < origin_[t]; });
    const std::vector<std::uint32_t> face(surface.polygon_face.begin() + static_cast<long>(first_polygon),
                                          surface.polygon_face.end());
    surface.polygon_face.resize(first_polygon);
    surface.polygon_offsets.resize(first_polygon + 1);
    surface.polygon_vertices.resize(surface.polygon_offsets.back());
    for (const std::uint32_t t : order) {
      surface.polygon_vertices.insert(surface.polygon_vertices.end(), triangles_[t].begin(),
                                      triangles_[t].end());
      surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
      surface.polygon_face.push_back(face[origin_[t] - first_polygon]);
    }
    for (auto& [name, column] : surface.polygon_columns) {
      std::vector<std::uint32_t> row;
      for (const std::uint32_t t : order) row.push_back(origin_[t]);
      column = picked_rows(column, first_polygon, row);
    }
  }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }

  // Notes that triangle t has the edge, if that is over the limit.
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t t, double rank = 1) {
    if (!(length2(a, b) > limit2_)) return;
    std::vector<std::uint32_t>& users = users_[key(a, b)];
    if (users.empty()) queue_.push({rank * length2(a, b), std::min(a, b), std::max(a, b)});
    users.push_back(t);
  }
  void change_user(std::uint32_t a, std::uint32_t b, std::uint32_t before, std::uint32_t after) {
    const auto entry = users_.find(key(a, b));
    if (entry != users_.end()) std::replace(entry->second.begin(), entry->second.end(), before, after);
  }

  // Where the edge's corner in a triangle (3) stands.
  [[nodiscard]] std::size_t place(std::uint32_t t, const LongEdge& edge) const {
    std::size_t i = 0;
    while (key(triangles_[t][i], triangles_[t][(i + 1) % 3]) != key(edge.a, edge.b)) ++i;
    return i;
  }

  [[nodiscard]] double length2(std::uint32_t a, std::uint32_t b) const {
    return (vertices_[a] - vertices_[b]).squaredNorm();
  }

  // Two triangles of one face and one plane have the edge.
  [[nodiscard]] bool lies_in_a_plane(const LongEdge& edge, const std::vector<std::uint32_t>& users) const {
    if (!may_flip_ || users.size() != 2 || users[0] == users[1]) return false;
    const std::uint32_t s = users[0], t = users[1];
    if (polygon_face_[origin_[s]] != polygon_face_[origin_[t]]) return false;
    const std::size_t i = place(s, edge), j = place(t, edge);
    const std::uint32_t a = triangles_[s][i], b = triangles_[s][(i + 1) % 3];
    if (triangles_[t][j] != b) return false;  // they face opposite sides
    const Vec3 along = vertices_[b] - vertices_[a];
    const Vec3 normal = along.cross(vertices_[triangles_[s][(i + 2) % 3]] - vertices_[a]);
    const Vec3 across = vertices_[triangles_[t][(j + 2) % 3]] - vertices_[a];
    return std::abs(normal.dot(across)) <= kFlat * along.norm() * normal.norm();
  }

  // Triangles (a, b, c) and (b, a, d) of one face and one plane become (a, d, c) and (d, b, c) where c d is shorter and lies
  // between a and b. False, with nothing changed, where not.
  bool flip(const LongEdge& edge, const std::vector<std::uint32_t>& users) {
    if (!lies_in_a_plane(edge, users)) return false;
    const std::uint32_t s = users[0], t = users[1];
    const std::size_t i = place(s, edge), j = place(t, edge);
    const std::uint32_t a = triangles_[s][i], b = triangles_[s][(i + 1) % 3], c = triangles_[s][(i + 2) % 3],
                        d = triangles_[t][(j + 2) % 3];
    if (c == d || users_.contains(key(c, d)) || !(length2(c, d) < kMedian * length2(a, b))) return false;
    const Vec3 normal = area_vector(a, b, c);
    const double least = kFlat * normal.squaredNorm();
    if (!(normal.dot(area_vector(a, d, c)) > least && normal.dot(area_vector(d, b, c)) > least)) return false;
    triangles_[s] = {a, d, c};
    triangles_[t] = {d, b, c};
    change_user(a, d, t, s);
    change_user(b, c, s, t);
    add(c, d, s, kMedian);
    add(c, d, t, kMedian);
    return true;
  }
  // Twice the area.
  [[nodiscard]] Vec3 area_vector(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return (vertices_[b] - vertices_[a]).cross(vertices_[c] - vertices_[a]);
  }

  // Triangle (a, b, c), bisected at the middle of a b, becomes (a, middle, c) and a new (middle, b, c).
  void split(std::uint32_t t, const LongEdge& edge, std::uint32_t middle) {
    const std::size_t i = place(t, edge);
    const std::uint32_t a = triangles_[t][i], b = triangles_[t][(i + 1) % 3], c = triangles_[t][(i + 2) % 3];
    const auto added = static_cast<std::uint32_t>(triangles_.size());
    triangles_[t] = {a, middle, c};
    triangles_.push_back({middle, b, c});
    origin_.push_back(origin_[t]);
    change_user(b, c, t, added);
    add(a, middle, t);
    add(middle, b, added);
    add(middle, c, t, kMedian);
    add(middle, c, added, kMedian);
  }

  std::vector<Vec3>& vertices_;
  Columns& vertex_columns_;
  const decltype(Surface::polygon_face)& polygon_face_;
  double limit2_;                                        // m^2
  bool may_flip_;                                        // what is between vertices is not interpolated
  std::vector<std::array<std::uint32_t, 3>> triangles_;  // corners
  std::vector<std::uint32_t> origin_;                    // (triangles) polygon it is a piece of
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> users_;  // triangles on each long edge
  std::priority_queue<LongEdge> queue_;                                  // the keys of users_
};

}  // namespace

bool subdivide(Surface& surface, std::size_t first_polygon, double largest_edge, std::size_t most_triangles) {
  Bisection bisection(surface, first_polygon, largest_edge);
  while (!bisection.done() && bisection.count() < most_triangles) bisection.split_longest();
  bisection.write(surface, first_polygon);
  return bisection.done();
}

void subdivide(Surface& surface, std::size_t first_polygon, double largest_edge, const std::string& where) {
  if (!(largest_edge > 0)) throw InputError(where, "the largest edge of the mesh must be above zero");
  // A triangle without an edge above L has at most the area of the equilateral one: a bound from below.
  double area = 0;
  for (std::size_t p = first_polygon; p < surface.polygon_count(); ++p) {
    const auto corners = surface.polygon(p);
    area += (surface.vertices[corners[1]] - surface.vertices[corners[0]])
                .cross(surface.vertices[corners[2]] - surface.vertices[corners[0]])
                .norm() /
            2;
  }
  const double most = std::sqrt(3.0) / 4 * largest_edge * largest_edge;
  const std::size_t left = kMostTriangles - std::min(kMostTriangles, first_polygon);
  if (area > most * static_cast<double>(left) || !subdivide(surface, first_polygon, largest_edge, left))
    throw InputError(where,
                     fmt::format("edges of at most {} would take more than {} triangles: give a larger "
                                 "--edge",
                                 human_length(largest_edge), kMostTriangles));
}

void subdivide_mesh(Surface& surface, double largest_edge, const std::string& where) {
  const Triangles triangles = triangulate(surface);
  double longest = 0;
  for (const auto& t : triangles.corners)
    for (std::size_t i = 0; i < 3; ++i)
      longest = std::max(longest, (surface.vertices[t[i]] - surface.vertices[t[(i + 1) % 3]]).norm());
  if (longest <= largest_edge) return;
  std::vector<std::uint32_t> face, offsets{0}, corners;
  for (std::size_t t = 0; t < triangles.corners.size(); ++t) {
    corners.insert(corners.end(), triangles.corners[t].begin(), triangles.corners[t].end());
    offsets.push_back(static_cast<std::uint32_t>(corners.size()));
    face.push_back(surface.polygon_face[triangles.polygon[t]]);
  }
  for (auto& [name, column] : surface.polygon_columns) column = picked_rows(column, 0, triangles.polygon);
  surface.polygon_face = std::move(face);
  surface.polygon_offsets = std::move(offsets);
  surface.polygon_vertices = std::move(corners);
  subdivide(surface, 0, largest_edge, where);
  for (SurfaceSource& source : surface.sources) source.bytes.clear();
}

}  // namespace flexel
