// Chord error: the distance of the mapped surface from its flat triangles.
#pragma once
#include "formats/lattice/body.h"
#include "mapping/report/flat_triangle.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// Triangles that miss more than this share of the largest displacement are too coarse: a bar whose end moves without turning
// misses 4.9 % where its sides are flat. So are those that miss more than this share of a spacing, however far the part moves.
constexpr double kCoarseShare = 0.03, kCoarseSpacings = 0.25;

// A triangle with an edge of over two spacings.
struct LongTriangle {
  std::uint32_t number = 0;  // among those of triangulate(body.surface)
  double longest = 0;        // m
  FlatTriangle flat;
};
// All but those that are stretched across a fracture (CrackReport::spanning_triangles has them).
[[nodiscard]] std::vector<LongTriangle> long_triangles(const Body& body, const MapResult& result);

// Whether there may be any, or any with an edge of so many spacings; quick.
[[nodiscard]] bool has_long_triangles(const Body& body, double spacings = kLongEdge);

// What each of them misses.
[[nodiscard]] std::vector<MissedPoint> look_at(const std::vector<FlatTriangle>& triangles, const Body& body,
                                               const SpaceMap& map);

// Looks at points of every triangle with an edge of over two spacings, which is what a lattice can bend; of
// shorter ones nothing is counted. Points are carried as `blended` carries vertices, whatever the method.
// Triangles that are stretched across a fracture are left out (CrackReport::spanning_triangles has them).
[[nodiscard]] ChordError chord_error(const Body& body, const MapResult& result);

// Edges [m] with which the mesh would show the deformation: the share that is missed falls to a quarter of a
// percent where it goes with the square of the edge, and below kCoarseShare where a kink lets it go with the
// edge itself.
[[nodiscard]] double sufficient_edge(const ChordError& error);

}  // namespace flexel::mapping
