// What the writers of single mesh formats share. Inside flexel_formats only.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/files/files.h"
#include "base/files/output_file.h"
#include "formats/part/surface.h"

namespace flexel {

// A surface and where its vertices go.
struct DeformedSurface {
  const Surface& surface;
  const std::vector<Vec3>& displacement;  // (vertices x 3) m
  double unit;                            // metres per unit of the coordinates written

  // Position of vertex v in file units.
  [[nodiscard]] Vec3 at(std::size_t v) const { return (surface.vertices[v] + displacement[v]) / unit; }

  // For a file that is written again from its source: the number to put in place of `source_value`,
  // coordinate i of vertex v in the source's file; nothing where that text can stay.
  [[nodiscard]] std::optional<double> rewritten(std::size_t v, Eigen::Index i, double source_value) const {
    const double source_unit = surface.sources[0].unit;
    if (displacement[v][i] == 0 && unit == source_unit) return std::nullopt;
    return source_value * (source_unit / unit) + displacement[v][i] / unit;
  }
};

// Copies a source with other words or bytes in some places, which come in order.
class Rewriter {
 public:
  Rewriter(std::string_view text, OutputFile& out) : text_(text), out_(out) {}
  // Puts `value` where `word`, a piece of the text, is.
  void replace(std::string_view word, const std::string& value) {
    copy_to(static_cast<std::size_t>(word.data() - text_.data()));
    out_.write(value);
    done_ += word.size();
  }
  void copy_rest() { copy_to(text_.size()); }

 private:
  void copy_to(std::size_t end) {
    out_.write(text_.data() + done_, end - done_);
    done_ = end;
  }
  std::string_view text_;
  OutputFile& out_;
  std::size_t done_ = 0;
};

// Appends coordinate i of vertex v: the decimal that reads back to the same double; where the vertex did not move and
// 15 digits give back its position, those: the file's own digits rather than the rounding of the unit.
void append_coordinate(std::string& text, const DeformedSurface& deformed, std::size_t v, Eigen::Index i);
// All three, a blank before each.
void append_position(std::string& text, const DeformedSurface& deformed, std::size_t v);

// Puts `line` after the `skip` first lines of the text of every source of `format` (a FileFormat's name) whose
// bytes are there.
void add_source_line(Surface& surface, std::string_view format, const std::string& line, int skip);

void write_stl_binary(const DeformedSurface& deformed, OutputFile& out);
void write_stl_ascii(const DeformedSurface& deformed, OutputFile& out);
// The lines of the OBJ file that the surface came from, with v and vn rewritten.
void rewrite_obj(const DeformedSurface& deformed, OutputFile& out);
void write_new_obj(const DeformedSurface& deformed, OutputFile& out);
// The PLY file that the surface came from, with x, y, z and nx, ny, nz rewritten.
void rewrite_ply(const DeformedSurface& deformed, OutputFile& out);
void write_new_ply(const DeformedSurface& deformed, bool ascii, OutputFile& out);
// The OFF file that the surface came from, with coordinates and normals rewritten.
void rewrite_off(const DeformedSurface& deformed, OutputFile& out);
void write_new_off(const DeformedSurface& deformed, OutputFile& out);
// The GLB file that the surface came from, with positions and normals rewritten.
void rewrite_glb(const DeformedSurface& deformed, OutputFile& out);
void write_new_glb(const DeformedSurface& deformed, OutputFile& out);
// The 3MF file that the surface came from, with other coordinates, in its own unit.
void rewrite_3mf(const DeformedSurface& deformed, OutputFile& out);
void write_new_3mf(const DeformedSurface& deformed, OutputFile& out);

}  // namespace flexel
