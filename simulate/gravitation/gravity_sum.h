// The attraction of every element on every other (Jansson and Vergeest, equations 1 and 13), per unit of the
// gravitational constant. As printed, (13) points away from the other element; attraction points towards it.
// An element does not act on itself.
//
// An element is a ball of matter: where two are closer than a, half the sum of their radii, the attraction
// falls linearly to 0 at no distance, as inside a homogeneous ball of radius a, and with it the potential:
//     r >= a: g = m d / r^3, phi = -m / r;   r < a: g = m d / a^3, phi = -m (3 - r^2 / a^2) / (2 a)
// so that elements at one place (corners of two lattices that coincide) do no harm. There is no other
// softening.
#pragma once
#include <cstdint>
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

// Masses at points; columns of equal length.
struct PointMasses {
  std::vector<Vec3> position;  // m
  std::vector<double> mass;    // kg
  std::vector<double> radius;  // m, above 0
};

// What all others do at each point.
struct Attraction {
  std::vector<Vec3> field;        // kg/m^2, towards them
  std::vector<double> potential;  // kg/m
  std::vector<double> tide;       // kg/m^3, sum m / r^3
};

// By summing over all pairs: the forces m G field sum up to 0 to rounding. The same bits for any number of
// threads.
[[nodiscard]] Attraction attraction_by_pairs(const PointMasses& points);

// Of one mass at `offset` = its position less that of the point, `reach` = a.
struct Pull {
  Vec3 field = Vec3::Zero();
  double potential = 0, tide = 0;
};
[[nodiscard]] Pull pull_of(double mass, const Vec3& offset, double reach);

}  // namespace flexel::simulate
