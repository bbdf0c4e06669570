// Ties every vertex of the surface to a frame of elements, at rest. Done once; apply() then maps any deformed
// state.
#pragma once
#include "mapping/frame.h"

namespace flexel {

struct Binding {
  MapMethod method = MapMethod::affine;
  std::vector<Frame> frames;         // distinct
  std::vector<std::uint32_t> frame;  // (vertices) index into frames
  std::vector<Vec3>
      coordinates;  // (vertices x 3) in the rest base of the frame: m (gram_schmidt) or edges (affine)
  std::vector<std::uint8_t> referenced;  // (vertices) 1: some polygon uses it
  Adjacency connections;                 // of the elements, as they are now
  double rest_residual = 0;              // m, largest distance of a vertex rebuilt at rest from itself
  double distance_outside = 0;           // in spacings; see MapResult
};

// Binds the surface that travels in `body`.
//
// Corner placement: the origin is the nearest corner of the cell under the vertex, which the polygons around
// the vertex name (Body::surface_cells): two leaves nearer to each other than a spacing keep to their own
// elements. Else, and where the polygons name no cell, it is the nearest element of the vertex's part.
// Vertices at exactly the same position in the same part are bound alike, so that no seam opens. A vertex
// that no polygon uses takes the nearest element of any part.
//
// Throws InputError: the body carries no surface, a part has no elements.
[[nodiscard]] Binding bind(const Body& body, MapMethod method);

// Maps the state `position` (elements x 3, m) onto the vertices: displacement and flags (vertices).
struct Mapped {
  std::vector<Vec3> displacement;   // (vertices x 3) m
  std::vector<std::uint8_t> flags;  // (vertices) bits of MapFlag; 0 for vertices that no polygon uses
};
[[nodiscard]] Mapped apply(const Binding& binding, const Body& body, const std::vector<Vec3>& position);

}  // namespace flexel
