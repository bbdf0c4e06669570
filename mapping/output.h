// Writes the mapped surface, on request with attributes.
#pragma once
#include <optional>
#include <string>

#include "formats/common/file_format.h"
#include "formats/exchange/surface_file.h"
#include "formats/lattice/body.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

struct MapOutput {
  std::string path = "-";
  std::optional<SurfaceFormat> format;  // nothing: .vtu
  double unit = 0;                      // metres; 0: that of the surface
  double scale = 1;  // displacements are written this many times as large, which the file says where it can
  bool attributes = false;  // what is known of each vertex (mapping/report/attributes.h), in PLY and .vtu
};

// The output's format by `format` or the extension of `path`, ".vtu" and CAD formats too; throws InputError for one
// that cannot hold attributes where they are wanted, or a unit where the format has its own.
[[nodiscard]] MapOutput map_output(const std::string& format, const std::string& path, bool ascii,
                                   double unit, double scale, bool attributes);

// Throws InputError: a unit was given and the format has its own. `unit`: 0 where none was given.
void check_unit(SurfaceFormat format, double unit);

[[nodiscard]] inline bool is_cad(const MapOutput& output) {
  return output.format && output.format->file->is_cad;
}

// A mesh or .vtu (CAD files: mapping/cad_output.h). `surface`: as it is to be written, the vertices that were mapped, in the same order.
void write_mapped(const Surface& surface, const Body& body, const MapResult& result, const MapOutput& output);

// Throws InputError: `path` is the file that `body` was made of, by name and content. It is no input of a mapping, and yet
// nobody means to lose it.
void keep_source(const Body& body, const std::string& path);

}  // namespace flexel::mapping
