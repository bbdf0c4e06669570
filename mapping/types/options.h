// Options of a mapping.
#pragma once
#include <cstdint>
#include <string>

namespace flexel::mapping {

// How the elements around a vertex carry it (mapping/methods/method.h; docs/theory/mapping-methods.md compares them).
struct MappingMethod;
using MapMethod = const MappingMethod*;
extern const MappingMethod kGramSchmidt,  // the paper's: the orthonormal base of four elements
    kAffine,                              // the edges of the same four elements
    kBlended,         // the frames of all elements around, blended with two continuous derivatives
    kSmooth,          // moving least squares, quadratic
    kShapeFunctions;  // the field of model `quadratic`, which is mapped so unless another method is given

// What holds a vertex. Later kinds are what is left when no four close elements span space.
enum class FrameKind : std::uint8_t { full, plane, line, rigid };

// "gram-schmidt", "affine", "blended" or "smooth"; InputError for any other word, with the nearest.
[[nodiscard]] MapMethod map_method(const std::string& name);
[[nodiscard]] std::string name_of(MapMethod method);

// What becomes of vertices that lie too far outside the lattice.
enum class FarVertices {
  follow,  // their frames, extrapolated: a distance blows up what the elements say
  rigid,   // the rotation of the frame of their origin, without its stretch
  refuse,
};
// "follow", "rigid" or "refuse"; InputError for any other word, with the nearest.
[[nodiscard]] FarVertices far_vertices(const std::string& name);

struct MapOptions {
  MapMethod method = &kBlended;
  FarVertices far = FarVertices::follow;
  double far_distance = 3;          // in spacings, beyond half a voxel's diagonal from the nearest element
  bool check_voronoi = false;       // compares the Voronoi neighbours of every origin
  bool check_intersection = false;  // counts new self-intersections of the surface
};
// "voronoi" or "self-intersection", several with commas; InputError for any other word, with the nearest.
void add_checks(MapOptions& options, const std::string& names);

}  // namespace flexel::mapping
