// The arithmetic of `smooth`, by SIMD over eight vertices.
#pragma once
#include <cstdint>
#include <vector>

#include "base/math/vec.h"

namespace flexel::mapping {

constexpr int kSmoothLanes = 8;

// An element that a group reaches.
struct SmoothNeighbour {
  Vec3 at;                   // in spacings, from the group's home
  Vec3 rest;                 // m, from the group's first element
  Vec3 displacement;         // m
  std::uint8_t from = 0xff;  // the corners of the cell that reach it; 0xff: all
};

// Eight vertices of a group; where there are fewer, the last one again.
struct SmoothPoints {
  double at[3][kSmoothLanes];     // in spacings, from the group's home
  double share[8][kSmoothLanes];  // how much each corner of the cell counts
};

// Sums over the elements e with their shares c_e in the polynomial's value at the vertex.
struct SmoothFit {
  double weight[kSmoothLanes];           // sum of the weights; 0: no element in the radius
  double value[kSmoothLanes];            // sum of c_e
  double rest[3][kSmoothLanes];          // sum of c_e X_e, m
  double displacement[3][kSmoothLanes];  // sum of c_e u_e, m
};

// Fits the quadratic polynomial about each of the points (mapping/methods/smooth.h) to the `count`
// neighbours, with c_e = w_e (a . t_e) and M a = (1, 0, ...), M = sum_e w_e t_e t_e^T + ridge, t_e the ten
// monomials up to degree two of X_e - x in spacings. `weights`: room for the weights of `count` neighbours.
void fit_quadratics(const SmoothNeighbour* neighbours, std::size_t count, const SmoothPoints& points,
                    std::vector<double>& weights, SmoothFit& fit);

}  // namespace flexel::mapping
