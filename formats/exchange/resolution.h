// The floating-point spacing of a part's coordinates in its file.
#pragma once
#include "formats/part/surface.h"

namespace flexel {

// m: the distance between neighbouring single-precision numbers at the part's largest coordinate, for files
// that store single precision (binary STL, binary PLY with float coordinates); 0 for files of double
// precision or text, and for a part without polygons.
[[nodiscard]] double coordinate_resolution(const Surface& surface, std::size_t part);

}  // namespace flexel
