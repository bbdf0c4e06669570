// Topology of a triangle mesh: welding, closed or open, orientation, shells, enclosed volume.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/part/surface.h"

namespace flexel {

// For each vertex the index of the first vertex at exactly the same position (-0 equals 0). Topology only: no
// vertex moves.
[[nodiscard]] std::vector<std::uint32_t> weld(const std::vector<Vec3>& vertices);

constexpr std::uint32_t kNoTriangle = 0xffffffffu;

// Topology of a set of triangles with welded corners.
struct Topology {
  // (triangles x 3) the triangle across edge (corner i, corner i+1), or kNoTriangle where the edge is
  // open or non-manifold
  std::vector<std::array<std::uint32_t, 3>> neighbour;
  std::vector<std::uint32_t> shell;  // (triangles) edge-connected shell, numbered from 0 in order of first
                                     // triangle; kNoTriangle for degenerate triangles
  std::uint32_t shell_count = 0;
  std::size_t open_edges = 0;            // edges with one triangle
  std::size_t non_manifold_edges = 0;    // edges with more than two
  std::size_t misoriented_edges = 0;     // two-triangle edges run in the same direction by both
  std::size_t degenerate_triangles = 0;  // a repeated welded corner; they take part in nothing
  [[nodiscard]] bool closed() const { return open_edges == 0 && non_manifold_edges == 0; }
  [[nodiscard]] bool oriented() const { return misoriented_edges == 0; }
};

// `corners` index vertices; `welded` maps each vertex to its representative. Only the triangles listed take
// part.
[[nodiscard]] Topology topology(const std::vector<std::array<std::uint32_t, 3>>& corners,
                                const std::vector<std::uint32_t>& welded);

// Signed volume [m^3] enclosed by the triangles (divergence theorem, about the first vertex for accuracy far
// from the origin).
[[nodiscard]] double signed_volume(const std::vector<Vec3>& vertices,
                                   const std::vector<std::array<std::uint32_t, 3>>& corners);

// Numbers regions of triangles bounded by edges whose dihedral angle exceeds `degrees` (or that are open or
// non-manifold). A sliver (lower than a millionth of the diagonal) takes the region of its neighbour across
// the longest edge; a degenerate triangle that of the triangle before it (at the front: the first after).
// Returns (triangles) region ids from 0 in order of first triangle.
[[nodiscard]] std::vector<std::uint32_t> dihedral_regions(
    const std::vector<Vec3>& vertices, const std::vector<std::array<std::uint32_t, 3>>& corners,
    const Topology& topology, double degrees);

}  // namespace flexel
