// Where parts touch: points at which the surface of one part lies on that of another.
#pragma once
#include <functional>
#include <vector>

#include "simulate/matter/interpolation_weights.h"

namespace flexel::simulate {

struct TouchingPoint {
  std::array<std::uint32_t, 2> part{};     // of the finer lattice first
  std::array<InterpolationWeights, 2> at;  // the same rest point, carried by the matter of each
  double area = 0;                         // m^2 that the point stands for
  Vec3 normal = Vec3::Zero();              // at rest, out of part[0] into part[1]
};

// m: how near a point of the surface of a part of that (least) spacing is to another part that it touches, in a body of
// that diagonal.
[[nodiscard]] double touching_distance(double diagonal, double spacing);

// Points of the finer part's surface (surface_points()) that lie within that distance, 1e-6 of the body's diagonal
// or 0.01 of the finer spacing, of a polygon of the other part that faces them within 45 degrees. Each point touches
// the nearest such polygon. Stray matter is left out. Order: by pair of parts, then by polygon.
//
// `wider`: pairs of parts (lower number first) whose surfaces count as touching over a gap [m].
struct TouchingGap {
  std::array<std::uint32_t, 2> parts{};
  double gap = 0;
};
[[nodiscard]] std::vector<TouchingPoint> touching_points(const Problem& problem,
                                                         const std::vector<TouchingGap>& wider = {});
// Calls use(point) for each of them: fine surfaces have hundreds of thousands, of 600 bytes each.
void for_each_touching_point(const Problem& problem, const std::vector<TouchingGap>& wider,
                             const std::function<void(const TouchingPoint&)>& use);

}  // namespace flexel::simulate
