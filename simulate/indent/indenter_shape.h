// The shape of a rigid indenter: a ball, or the round end of a rod with a flat face.
//
// Both are what lies within `rounding` of a convex core: the centre of the ball; the rod without its outermost layer. So
// the distance to them is smooth outside the core.
#pragma once
#include <array>

#include "base/math/vec.h"

namespace flexel::simulate {

inline constexpr double kPlateRounding = 0.25;  // of its radius, where nobody says it

struct IndenterShape {
  bool plate = false;
  double radius = 0;    // m
  double rounding = 0;  // m, of the edge of a plate, under its radius; of a ball: its radius
};

// How much of its rounding it may go in one step of a run (simulate/indent/indenters.h).
inline constexpr double kIndenterStep = 0.5;

// Where an indenter is.
struct IndenterPlace {
  Vec3 centre = Vec3::Zero();   // m, of the ball, of the plate's face
  Vec3 normal = Vec3::UnitZ();  // that the face looks along; the rod has no end the other way
};

struct IndenterGap {
  double distance = 0;            // m, to the surface; below 0 inside
  Vec3 gradient = Vec3::UnitZ();  // of the distance by the point: a unit vector
  Mat3 curvature = Mat3::Zero();  // 1/m, the second derivative; zero inside the core
};

[[nodiscard]] IndenterGap gap_to(const IndenterShape& shape, const IndenterPlace& place, const Vec3& point);

// Whether a point that goes straight from one place to another is deep inside on the way, by a third of the rounding (a
// quarter may do), while the indenter goes as straight: then it may have come out on the other side. Both ends are all but
// outside.
[[nodiscard]] bool goes_through(const IndenterShape& shape, const std::array<IndenterPlace, 2>& places,
                                const std::array<Vec3, 2>& point);

}  // namespace flexel::simulate
