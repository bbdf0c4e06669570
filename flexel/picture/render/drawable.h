// What is drawn: triangles (a surface, or the hull of a lattice's cells) or spheres (elements), in a frame
// that single precision can hold, with a value to colour each point by.
#pragma once
#include <cstdint>
#include <vector>

#include "flexel/picture/render/tracer.h"
#include "formats/part/surface.h"
#include "formats/part/topology.h"

namespace flexel::picture {

// How an edge of a triangle is drawn.
enum class EdgeKind : std::uint8_t {
  none,
  border,  // between faces of the CAD file or cells of the lattice that meet without a crease: a thin line
  crease   // a dihedral angle over 30 degrees, or an end of the surface
};

// The frame: drawn = (world - centre) / radius, so that all of it lies in the unit sphere.
struct DrawingFrame {
  Vec3 centre = Vec3::Zero();
  double radius = 1;  // m
  [[nodiscard]] Vec3f drawn(const Vec3& world) const { return ((world - centre) / radius).cast<float>(); }
};

struct Drawable {
  std::vector<Vec3f> vertices;                          // (vertices x 3)
  std::vector<std::array<std::uint32_t, 3>> triangles;  // (triangles x 3)
  std::vector<std::array<Vec3f, 3>> normals;            // (triangles x 3) unit, smooth up to a crease
  std::vector<std::uint32_t> face;                      // (triangles) what counts as one face of the part
  std::vector<std::uint32_t> part;                      // (triangles, or spheres) picks the tint
  std::vector<std::array<EdgeKind, 3>> edges;           // (triangles x 3) of corner i to i + 1
  std::vector<std::array<std::uint32_t, 3>> neighbour;  // (triangles x 3) as Topology::neighbour
  std::vector<Eigen::Vector4f> spheres;                 // (spheres) centre and radius; empty with triangles

  enum class ValuesAt : std::uint8_t { none, vertices, primitives };
  ValuesAt values_at = ValuesAt::none;
  std::vector<float> values;  // SI; NaN where nothing is known
  ValuesAt colours_at = ValuesAt::none;
  std::vector<Vec3f> colours;  // the file's own, sRGB

  [[nodiscard]] bool empty() const { return triangles.empty() && spheres.empty(); }
  [[nodiscard]] std::size_t primitive_count() const {
    return triangles.empty() ? spheres.size() : triangles.size();
  }
};

// The triangles of a mesh and their connectivity, found once for the shape at rest.
struct MeshTopology {
  Triangles triangles;
  std::vector<std::uint32_t> welded;
  Topology topology;
  std::vector<std::array<EdgeKind, 3>> edges;
};

[[nodiscard]] MeshTopology mesh_topology(const Surface& surface);

// The surface with its vertices at `positions` (vertices x 3, m), with the edges of the shape at rest.
[[nodiscard]] Drawable draw_surface(const Surface& surface, const MeshTopology& mesh,
                                    const std::vector<Vec3>& positions, const DrawingFrame& frame);

// Normals of the triangles' corners: the mean, weighted by area and angle, over the triangles round the
// corner that are within 35 degrees of the triangle's own. `welded` (vertices) names one vertex for each
// place.
[[nodiscard]] std::vector<std::array<Vec3f, 3>> smooth_normals(
    const std::vector<Vec3f>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles,
    const std::vector<std::uint32_t>& welded);

}  // namespace flexel::picture
