// A part with curved faces as STEP, for the rows of bench_import that tessellate.
#pragma once
#include <string>

namespace flexel {

// Writes a block of 160 x 80 x 20 mm with 6 x 4 spherical dimples (radius 9 mm) in its top and a hole
// through each of its ends, as STEP in mm.
void write_dimpled_block(const std::string& path);

}  // namespace flexel
