// How far apart the numbers are that a file can say a part's coordinates with.
#pragma once
#include "formats/part/surface.h"

namespace flexel {

// m: distance between neighbouring single-precision numbers at the part's coordinate that is farthest from
// zero, where its file holds those (binary STL, binary PLY with float coordinates); 0 for other files, which
// hold double precision or text, and for a part without polygons.
[[nodiscard]] double coordinate_resolution(const Surface& surface, std::size_t part);

}  // namespace flexel
