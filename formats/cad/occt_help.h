// Helpers of the STEP, IGES and BREP readers that do not use OpenCASCADE.
#pragma once
#include <istream>
#include <streambuf>

#include "formats/common/readers.h"

namespace flexel {

// A stream over bytes in memory.
class MemoryStream : private std::streambuf, public std::istream {
 public:
  explicit MemoryStream(Bytes& bytes) : std::istream(static_cast<std::streambuf*>(this)) {
    char* begin = reinterpret_cast<char*>(bytes.data());
    setg(begin, begin, begin + bytes.size());
  }
};

// Throws InputError when the bytes are no STEP file, or when its end is missing.
void check_step_complete(const ImportInput& input);

// Turns the polygons from `first_polygon` on outward, all together, where they enclose a negative volume.
void orient_outward(Surface& surface, std::size_t first_polygon);

}  // namespace flexel
