// Splits single triangles of a surface, and as few others as keep it closed.
#pragma once
#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "formats/part/refinement.h"

namespace flexel {

// Longest-edge bisection where it is asked for. Triangles whose corners lie at the same positions (seams of texture
// coordinates and normals; weld_parts() says what is the same) are neighbours too, within a part: each side of the seam
// gets a vertex of its own at its midpoint.
class LocalBisection {
 public:
  // Keeps a copy of what it needs of the surface; polygons count as their triangles (triangulate()).
  explicit LocalBisection(const Surface& surface);

  using Corners = std::array<std::uint32_t, 3>;
  [[nodiscard]] std::size_t count() const { return triangles_.size(); }  // of triangles
  [[nodiscard]] const Corners& corners(std::uint32_t triangle) const { return triangles_[triangle]; }
  [[nodiscard]] std::uint32_t polygon(std::uint32_t triangle) const { return polygon_[triangle]; }
  [[nodiscard]] const Vec3& vertex(std::uint32_t v) const { return vertices_[v]; }  // m
  [[nodiscard]] double longest_edge(std::uint32_t triangle) const;                  // m
  // Bit i: the edge from corner i to the next is not shared by two triangles.
  [[nodiscard]] std::uint8_t unshared(std::uint32_t triangle) const;

  // Bisects the triangle at the middle of its longest edge, with all that have this edge, and before these, where they
  // have longer ones, them at those. False where its corners are not at three positions: it takes part in nothing.
  bool bisect(std::uint32_t triangle);
  // Triangles that changed or are new since the last call, ascending.
  [[nodiscard]] std::vector<std::uint32_t> take_changed();

  [[nodiscard]] Refinement refinement(const Surface& surface) const;

 private:
  struct Edge {
    double length2 = -1;         // m^2
    std::uint32_t a = 0, b = 0;  // welded, a < b
    // A strict order, the same on every run: the longest, then the one with the lowest vertices.
    [[nodiscard]] bool is_longer_than(const Edge& other) const {
      if (length2 != other.length2) return length2 > other.length2;
      return a != other.a ? a < other.a : b < other.b;
    }
    bool operator==(const Edge&) const = default;
  };
  [[nodiscard]] static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }
  [[nodiscard]] Edge edge(std::uint32_t triangle, std::size_t corner) const;
  [[nodiscard]] Edge longest(std::uint32_t triangle) const;
  [[nodiscard]] bool has_area(std::uint32_t triangle) const;
  std::uint32_t middle(std::uint32_t a, std::uint32_t b, std::uint32_t& first);
  void split_edge(const Edge& edge);
  void split(std::uint32_t triangle, const Edge& edge, std::uint32_t& first);

  std::uint32_t vertices_before_;
  std::vector<Vec3> vertices_;                      // m
  std::vector<std::uint32_t> welded_;               // (vertices) weld_parts(), and so on for new ones
  std::vector<std::array<std::uint32_t, 2>> ends_;  // (new vertices)
  std::vector<Corners> triangles_;
  std::vector<std::uint32_t> polygon_;                                   // (triangles) it is a piece of
  std::vector<std::uint8_t> is_split_;                                   // (polygons)
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> users_;  // triangles on each welded edge
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;             // by the two vertices
  std::vector<std::uint32_t> changed_;
};

}  // namespace flexel
