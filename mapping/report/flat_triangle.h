// What one flat triangle of a surface misses of the deformation between its corners.
#pragma once
#include <array>

#include "formats/lattice/body.h"
#include "mapping/methods/space_map.h"

namespace flexel::mapping {

constexpr double kLongEdge = 2;  // spacings, which is what a lattice can bend: shorter edges are not sampled
constexpr double kChordNoise = 1e-9;  // of the part's diagonal: rounding

// `polygon`: of the body's surface, which it is or is a piece of.
struct FlatTriangle {
  std::array<Vec3, 3> corners;  // m, at rest
  std::uint32_t part = 0, polygon = 0;
  std::uint8_t unshared = 0;  // bit i: no one triangle lies across the edge from corner i to the next
};

struct MissedPoint {
  double largest = 0;       // m, from the plane of the mapped corners; on unshared edges from the edge
  Vec3 at = Vec3::Zero();   // m, at rest
  double displacement = 0;  // m, the largest of a point that was looked at
  double facing =
      1;  // cosine between the normal of the mapped corners and that of the deformation at its middle
};

// Looks at one triangle after the other. One for each thread.
class FlatTriangles {
 public:
  FlatTriangles(const Body& body, const SpaceMap& map) : body_(body), probe_(map) {}
  MissedPoint operator()(const FlatTriangle& triangle);

 private:
  const Body& body_;
  SpaceMap::Probe probe_;
};

}  // namespace flexel::mapping
