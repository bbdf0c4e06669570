// Longest-edge bisection (M.-C. Rivara, "Algorithms for refining triangular grids suitable for adaptive and
// multigrid techniques", 1984), the longest edge of the whole mesh first: that edge is the longest of every
// triangle that has it, so all of them are bisected at its midpoint and the mesh conforms after each step. A
// median to the longest edge is at most 0.87 of it, so the longest edge shrinks, and angles do not fall
// below half the smallest of the tessellation (Rosenberg and Stenger, 1975). Ties go by vertex number, so the
// order is the same on every run. Only edges over the limit are kept in the table.
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

struct LongEdge {
  double length2 = 0;          // m^2
  std::uint32_t a = 0, b = 0;  // vertices, a < b
  // The queue gives the greatest first: the longest, then the one with the lowest vertices.
  bool operator<(const LongEdge& other) const {
    if (length2 != other.length2) return length2 < other.length2;
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
        limit2_(largest_edge * largest_edge) {
    for (std::size_t p = first_polygon; p < surface.polygon_count(); ++p) {
      const auto corners = surface.polygon(p);
      triangles_.push_back({corners[0], corners[1], corners[2]});
      origin_.push_back(static_cast<std::uint32_t>(p));
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i) add(triangles_[t][i], triangles_[t][(i + 1) % 3], t);
  }

  [[nodiscard]] bool done() const { return queue_.empty(); }
  [[nodiscard]] std::size_t count() const { return triangles_.size(); }

  void split_longest() {
    const LongEdge edge = queue_.top();
    queue_.pop();
    const auto entry = users_.find(key(edge.a, edge.b));
    const std::vector<std::uint32_t> users = std::move(entry->second);
    users_.erase(entry);
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
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t t) {
    const double length2 = (vertices_[a] - vertices_[b]).squaredNorm();
    if (!(length2 > limit2_)) return;
    std::vector<std::uint32_t>& users = users_[key(a, b)];
    if (users.empty()) queue_.push({length2, std::min(a, b), std::max(a, b)});
    users.push_back(t);
  }

  // Triangle (a, b, c), bisected at the middle of a b, becomes (a, middle, c) and a new (middle, b, c).
  void split(std::uint32_t t, const LongEdge& edge, std::uint32_t middle) {
    std::size_t i = 0;
    while (key(triangles_[t][i], triangles_[t][(i + 1) % 3]) != key(edge.a, edge.b)) ++i;
    const std::uint32_t a = triangles_[t][i], b = triangles_[t][(i + 1) % 3], c = triangles_[t][(i + 2) % 3];
    const auto added = static_cast<std::uint32_t>(triangles_.size());
    triangles_[t] = {a, middle, c};
    triangles_.push_back({middle, b, c});
    origin_.push_back(origin_[t]);
    const auto moved = users_.find(key(b, c));
    if (moved != users_.end()) std::replace(moved->second.begin(), moved->second.end(), t, added);
    add(a, middle, t);
    add(middle, b, added);
    add(middle, c, t);
    add(middle, c, added);
  }

  std::vector<Vec3>& vertices_;
  Columns& vertex_columns_;
  double limit2_;                                        // m^2
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
