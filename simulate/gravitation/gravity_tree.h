// The attraction of many elements on each other by a tree (Barnes and Hut 1986): far groups act as their mass
// and quadrupole at their centre of mass, near elements one by one as in simulate/gravitation/gravity_sum.h.
//
// A group of size s (the longest side of its box) acts as a whole on a point at distance d from its centre of
// mass where d > s / opening + its centre's distance from the middle of the box + the largest radius. The
// error of the field, rms over the points and relative to its rms, is under 1e-3 at an opening of 0.4;
// docs/measurements/gravity-tree.md has a table. The forces of groups have no exact counterpart: what their sum
// leaves over is taken off every point in proportion to its mass, so that momentum is kept to rounding;
// angular momentum is kept to the error of the field.
#pragma once
#include "simulate/gravitation/gravity_sum.h"

namespace flexel::simulate {

// `opening` in (0, 1]. The same bits for any number of threads.
[[nodiscard]] Attraction attraction_by_tree(const PointMasses& points, double opening);

}  // namespace flexel::simulate
