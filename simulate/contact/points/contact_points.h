// Where a body can touch: points on its surface, each standing for a patch of it.
//
// Corner placement: the part's own surface is gathered into patches of at most half a cell, apart where its
// normal turns by more than 20 degrees; each becomes a contact sphere that lies just under the surface and
// touches it there: its point on the surface is carried by the cell's trilinear weights, its normal by the
// cell's mean deformation gradient, n ~ F^-T N. Convex edges sharper than 30 degrees and their corners have
// points of their own. Centre placement: the outer elements themselves, balls that reach to the surface.
#pragma once
#include <vector>

#include "simulate/matter/interpolation_weights.h"

namespace flexel::simulate {

enum class ContactShape : std::uint8_t { face, edge, ball };

struct ContactPoint {
  ContactShape shape = ContactShape::face;
  std::uint32_t part = 0;
  InterpolationWeights at;     // of the point
  Vec3 rest = Vec3::Zero();    // m, world frame
  Vec3 normal = Vec3::Zero();  // unit, outward, at rest; of an edge the mean of its faces'; of a ball 0
  double area = 0;             // m^2 that it stands for
  double depth = 0;            // m, radius of the contact sphere: half a spacing, or half the wall
  double radius = 0;           // m, of a ball, from its element; else 0
  double width = 0;            // m, the part's mean spacing
  double facing_from = 0.5;    // cosines against what faces it: contact begins to count at this one
  double facing_fully = 0.87;  //   and counts fully from this one on
};

// A contact point as one side of a pair, in a state.
struct ContactSide {
  Vec3 position = Vec3::Zero();  // m
  Vec3 normal = Vec3::Zero();    // unit; of a ball 0
  double own_plane = 0;          // 1: a face, whose plane gives the direction of contact; else 0
  double radius = 0;             // m, of a ball; else 0
};

// Points of the `parts` (parts) that are 1, by part, faces before edges before balls.
[[nodiscard]] std::vector<ContactPoint> contact_points(const Problem& problem,
                                                       const std::vector<std::uint8_t>& parts);

}  // namespace flexel::simulate
