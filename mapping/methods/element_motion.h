// The motion of the matter around an element, to first order: displacement and its gradient, which `blended`
// blends.
#pragma once
#include <cstdint>
#include <vector>

#include "mapping/anchors/frame.h"
#include "mapping/types/element_motion.h"

namespace flexel::mapping {

// The elements whose motion is computed, and how. The gradient is a least-squares fit over the connected
// elements, weighted by 1 / distance^2. Where those do not span space (normalised determinant of their
// moments below kWellConditioned), the affine frame of the paper's quadruple is used, with its wider search
// and its planes, lines and rigid frames.
struct MovingElements {
  std::vector<std::uint32_t> elements;  // ascending
  std::vector<std::uint32_t> slot_of;   // (elements of the body) index into `elements`; kNoSlot
  std::vector<Mat3> inverse_moments;    // (elements) of the edges at rest over their lengths; 0 with a frame
  std::vector<std::uint32_t> frame;     // (elements) index into frames; kNoSlot: least squares
  std::vector<Frame> frames;
};

// `wanted` may hold an element more than once.
[[nodiscard]] MovingElements find_moving_elements(const Body& body, const Adjacency& connections,
                                                  const std::vector<std::uint32_t>& wanted);

// (moving.elements) The motions in the state `position` (elements of the body x 3, m): exactly zero where
// neither an element nor what it is connected with moved.
[[nodiscard]] std::vector<ElementMotion> element_motions(const MovingElements& moving, const Body& body,
                                                         const Adjacency& connections,
                                                         const std::vector<Vec3>& position);

}  // namespace flexel::mapping
