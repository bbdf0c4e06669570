// Deformed body + its surface -> displacement of every vertex.
#pragma once
#include "base/program/progress.h"
#include "formats/lattice/body.h"
#include "mapping/types/options.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// Maps the deformed state of `body` onto the surface that travels in it (mapping/methods/bind.h says how
// vertices are bound). Throws InputError: the body carries no surface, a part has no elements; Interrupted.
[[nodiscard]] MapResult map_surface(const Body& body, const MapOptions& options, Progress& progress);
// The same with known anchors (mapping/crack/crack.h).
struct VertexAnchors;
[[nodiscard]] MapResult map_surface(const Body& body, const MapOptions& options, const VertexAnchors& anchors,
                                    Progress& progress);

}  // namespace flexel::mapping
