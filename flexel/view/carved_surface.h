// The surface of a body from which matter was carved, as it is drawn.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "formats/lattice/body.h"
#include "formats/lattice/locate.h"

namespace flexel::view {

struct CarvedSurface {
  // Parts and faces are the body's, in their order, also where a part fell apart or a face is gone; then comes a face of each
  // part for its walls.
  Surface surface;
  std::vector<std::uint32_t> face_numbers;  // (faces) within their parts, from 1; of walls 0
  // (vertices) What carries each: a cell with weights, or (nothing) `element`.
  std::vector<std::optional<CellPoint>> cell;
  std::vector<std::uint32_t> element;
};

// At rest; closed, with walls along the voxels that went (docs/reference/cracks.md). Throws InputError: the part's surface is
// not closed.
[[nodiscard]] CarvedSurface carved_surface(const Body& body);

}  // namespace flexel::view
