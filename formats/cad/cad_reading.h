// What the process that reads a CAD file tells the one that asked for it.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "formats/part/surface.h"

namespace flexel {

// The tessellation of a CAD file's solids: triangles in metres, one solid after the other, as OpenCASCADE
// gives them. No columns, no sources.
struct CadMesh {
  Surface surface;
  std::vector<double> face_colors;  // (faces x 3) red, green, blue in [0, 1]; empty: the file has none
};

struct CadReading {
  std::vector<std::string> warnings;
  bool refused = false;
  std::string where, why;  // of an InputError, where the file is refused
  CadMesh mesh;            // else
};

[[nodiscard]] Bytes pack(const CadReading& reading);

// Throws InputError(where, ...): these bytes are not from pack(), or what they hold does not fit together.
[[nodiscard]] CadReading unpack_reading(std::span<const std::byte> bytes, const std::string& where);

}  // namespace flexel
