// Ties every vertex of the surface to a frame of elements, at rest. Done once; apply() then maps any deformed
// state.
#pragma once
#include "mapping/anchors/vertex_anchor.h"
#include "mapping/methods/method.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

struct Binding {
  MapMethod method = &kBlended;
  std::vector<Frame> frames;                  // distinct
  std::vector<std::uint32_t> frame;           // (vertices) index into frames
  std::shared_ptr<const MethodBinding> kept;  // what the method keeps
  std::vector<std::uint8_t> referenced;       // (vertices) 1: some polygon uses it
  Adjacency connections;                      // of the elements, as they are now
  double rest_residual = 0;                   // m, largest distance of a vertex rebuilt at rest from itself
  double distance_outside = 0;                // in spacings; see MapResult
};

// Binds the surface that travels in `body`. `states`: how many will be mapped; where there are several,
// methods may keep more (MethodInput).
//
// Corner placement: the origin is the nearest corner of the cell under the vertex, which the polygons around
// the vertex name (Body::surface_cells): two leaves nearer to each other than a spacing keep to their own
// elements. Else, and where the polygons name no cell, it is the nearest element of the vertex's part.
// Vertices at exactly the same position in the same part are bound alike, so that no seam opens. A vertex
// that no polygon uses goes with the part whose cells are nearest.
//
// Throws InputError: the body carries no surface, a part has no elements.
[[nodiscard]] Binding bind(const Body& body, MapMethod method, std::size_t states = 1);
// The same with known anchors: those of a surface that was cut along cracks (mapping/crack/crack.h).
[[nodiscard]] Binding bind(const Body& body, MapMethod method, VertexAnchors anchors, std::size_t states = 1);

}  // namespace flexel::mapping
