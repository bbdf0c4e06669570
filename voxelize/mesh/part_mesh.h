// The triangles of one part as the voxeliser sees them: welded, without degenerate ones, with their edges
// numbered.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::voxelize {

using Corners = std::array<std::uint32_t, 3>;
// A triangle that healing added: it belongs to no polygon of the surface.
constexpr std::uint32_t kNoPolygon = 0xffffffffu;

struct PartMesh {
  std::vector<Vec3> world;             // (vertices x 3) m, equal positions are one vertex
  std::vector<Vec3> vertices;          // (vertices x 3) lattice coordinates; filled by place_on_lattice
  std::vector<Corners> corners;        // (triangles x 3) indices into vertices
  std::vector<std::uint32_t> polygon;  // (triangles) polygon of the surface, or kNoPolygon
  std::vector<Corners> edges;          // (triangles x 3) number of the edge (corner e, corner e + 1)
  std::vector<std::uint32_t> shell;    // (triangles) edge-connected shell, from 0 in order of first triangle
  std::uint32_t edge_count = 0, shell_count = 0;
  std::size_t open_edges = 0;            // edges with an odd number of triangles
  std::size_t crowded_edges = 0;         // edges with more than two triangles
  std::size_t unbalanced_edges = 0;      // edges run more often one way than the other
  std::size_t degenerate_triangles = 0;  // left out: a corner repeats once equal positions are one
  std::size_t flipped_triangles = 0;     // turned over by repair_orientation
  std::size_t inverted_shells = 0;       // shells turned inside out by repair_orientation
  bool cracks_closed = false;            // vertices within a tolerance were welded to close it

  // Every directed edge has its opposite: winding numbers are whole and the divergence theorem holds.
  [[nodiscard]] bool balanced() const { return unbalanced_edges == 0; }
};

// The meshes of all parts of a surface, in world coordinates. Where exact welding leaves a part open and
// welding at 1e-7 of its diagonal closes it, the latter is taken (`cracks_closed`).
[[nodiscard]] std::vector<PartMesh> part_meshes(const Surface& surface);
// The same without closing cracks.
[[nodiscard]] std::vector<PartMesh> exact_part_meshes(const Surface& surface);

// Numbers edges and shells and counts open and unbalanced edges. Needs `world` and `corners`.
void number_edges(PartMesh& mesh);

// Regions of triangles that hang together across edges with two triangles, and which triangles to turn so
// that all of a region face the same side of it: the side that most of its area faces.
struct FacingRegions {
  std::vector<std::uint8_t> turn;     // (triangles) 1: turn it over
  std::vector<std::uint32_t> region;  // (triangles) from 0, in order of first triangle
  std::uint32_t count = 0;
};
[[nodiscard]] FacingRegions facing_regions(const PartMesh& mesh);

// Fills mesh.vertices. Coordinates within `tolerance` of a lattice plane are put on it, so that faces meant
// to lie there do.
constexpr double kSnapTolerance = 1e-6;  // in spacings
void place_on_lattice(PartMesh& mesh, const Lattice& lattice, double tolerance = kSnapTolerance);

// Volume enclosed [m^3], signed, of one part (each shell by its orientation), and its area [m^2].
[[nodiscard]] double enclosed_volume(const PartMesh& mesh);
[[nodiscard]] double surface_area(const PartMesh& mesh);
[[nodiscard]] double triangle_area(const PartMesh& mesh, std::uint32_t triangle);
[[nodiscard]] Vec3 unit_normal(const PartMesh& mesh, std::uint32_t triangle);

}  // namespace flexel::voxelize
