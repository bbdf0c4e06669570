// A surface whose polygons were split, with the file that it came from split alike.
#pragma once
#include <span>
#include <string>

#include "formats/exchange/surface_file.h"
#include "formats/part/refinement.h"

namespace flexel {

// The surface with its polygons split, ready to be written in any of `formats`: where one of them is that of its file,
// this comes out with all that it holds. Throws InputError: the file holds what cannot be split.
[[nodiscard]] Surface refined_with_file(const Surface& surface, const Refinement& refinement,
                                        std::span<const SurfaceFormat> formats);

}  // namespace flexel
