// What the deformation did to the triangles of a surface.
#pragma once
#include "formats/lattice/body.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// `gradients`: (frames of result) deformation_gradient().
[[nodiscard]] SurfaceQuality surface_quality(const Surface& surface, const MapResult& result,
                                             const std::vector<Mat3>& gradients);

// Volume of the matter in the whole cells at rest and in the state, m^3: what a mapping that follows the
// lattice would do to the part's volume. Both 0 where there are no cells.
struct LatticeVolume {
  double before = 0, after = 0;
};
// `but`: (cells) 1: left out; empty: none.
[[nodiscard]] LatticeVolume lattice_volume(const Body& body, const std::vector<std::uint8_t>& but = {});

// Largest |principal stretch - 1| of a deformation gradient.
[[nodiscard]] double stretch(const Mat3& gradient);

}  // namespace flexel::mapping
