// What the writers of single mesh formats share. Inside flexel_formats only.
#pragma once
#include <string>
#include <vector>

#include "formats/files.h"
#include "formats/surface.h"

namespace flexel {

// A surface and where its vertices go.
struct DeformedSurface {
  const Surface& surface;
  const std::vector<Vec3>& displacement;  // (vertices x 3) m
  double unit;                            // metres per unit of the coordinates written

  // Position of vertex v in file units.
  [[nodiscard]] Vec3 at(std::size_t v) const { return (surface.vertices[v] + displacement[v]) / unit; }
};

// Appends the three coordinates of vertex v, a blank before each. Decimals that read back to the same double;
// where the vertex did not move and 15 digits give back its position, those: the file's own digits rather
// than the rounding of the unit.
void append_position(std::string& text, const DeformedSurface& deformed, std::size_t v);

void write_stl_binary(const DeformedSurface& deformed, OutputFile& out);
void write_stl_ascii(const DeformedSurface& deformed, OutputFile& out);
// The lines of the OBJ file that the surface came from, with v and vn rewritten.
void rewrite_obj(const DeformedSurface& deformed, OutputFile& out);
void write_new_obj(const DeformedSurface& deformed, OutputFile& out);

}  // namespace flexel
