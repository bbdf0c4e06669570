// Helpers of the STEP, IGES and BREP readers that do not use OpenCASCADE.
#pragma once
#include <istream>
#include <streambuf>

#include "formats/cad/cad_reading.h"
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

// The surface of what OpenCASCADE gave, once it has been checked: solids that are inside out are turned, edges
// split, colours those of the polygons. Throws InputError: damaged, an edge that is not positive.
[[nodiscard]] Surface finished(CadMesh mesh, SurfaceSource source, const ImportOptions& options,
                               const std::string& where);

}  // namespace flexel
