// Deformed body + its surface -> displacement of every vertex.
#pragma once
#include "base/program/progress.h"
#include "formats/lattice/body.h"
#include "mapping/methods/bind.h"
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

// apply() and judge(), and the data of each vertex in the binding.
[[nodiscard]] MapResult map_state(const Binding& binding, const Body& body);
// What `options` ask for beyond that: vertices far outside, checks by name. Throws InputError: --far refuse.
void complete(const Body& body, const MapOptions& options, MapResult& result);

}  // namespace flexel::mapping
