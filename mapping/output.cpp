// Displacements times a scale, a note of it in the file's own comments, and attributes as columns.
#include "mapping/output.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/outputs.h"
#include "formats/common/file_formats.h"
#include "formats/lattice/column_names.h"
#include "mapping/report/attributes.h"

namespace flexel::mapping {
namespace {

// Says in the file that displacements are not true to scale, where its format has a place for it.
void note_scale(Surface& surface, const MapOutput& output) {
  if (output.format->file->add_note != nullptr)
    output.format->file->add_note(surface, output.format->ascii,
                                  fmt::format("Flexel: displacements times {:g}", output.scale));
}

}  // namespace

void check_unit(SurfaceFormat format, double unit) {
  if (unit > 0 && format.file->carries_unit)
    throw InputError(fmt::format("{} has a unit of its own: leave out --unit", capitals(*format.file)));
}

MapOutput map_output(const std::string& format, const std::string& path, bool ascii, double unit,
                     double scale, bool attributes) {
  MapOutput output;
  output.path = path;
  output.unit = unit;
  output.scale = scale;
  output.attributes = attributes;
  if (!std::isfinite(scale)) throw InputError("--scale: a number is needed");
  if (format == "vtu" || (format.empty() && extension(path) == "vtu")) return output;
  output.format = surface_format(format, path, ascii, true);
  if (unit > 0 && output.format->file->is_cad)
    throw InputError(
        fmt::format("{} keeps the unit of the part: leave out --unit", output.format->file->title));
  check_unit(*output.format, unit);
  if (attributes && !output.format->file->holds_attributes)
    throw InputError(fmt::format(
        "--attributes: {} holds no attributes of vertices, only {} and .vtu do: write no other surface",
        output.format->file->title,
        written_titles([](const FileFormat& each) { return each.holds_attributes; }, "and")));
  return output;
}

void write_mapped(const Surface& surface, const Body& body, const MapResult& result,
                  const MapOutput& output) {
  const double unit = output.unit > 0 ? output.unit : default_unit(surface);
  std::vector<Vec3> scaled;
  if (output.scale != 1) {
    scaled = result.displacement;
    for (Vec3& displacement : scaled) displacement *= output.scale;
  }
  const std::vector<Vec3>& displacement = output.scale != 1 ? scaled : result.displacement;
  if (!output.format)
    return write_surface_vtu(surface, displacement, vertex_attributes(surface, body, result), unit,
                             output.path);
  const bool stressed = !output.attributes && has_surface_stress(body);
  if (output.scale == 1 && !output.attributes && !stressed)
    return write_surface(surface, displacement, *output.format, unit, output.path);
  Surface changed = surface;
  if (stressed) erase_surface_stress(changed.vertex_columns);
  if (output.scale != 1) note_scale(changed, output);
  if (output.attributes) {
    changed.vertex_columns.merge(vertex_attributes(surface, body, result));
    for (SurfaceSource& source : changed.sources) source.bytes.clear();  // a new file, with all columns
  }
  write_surface(changed, displacement, *output.format, unit, output.path);
}

void keep_source(const Body& body, const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  for (const std::string& file : files_replaced(path)) {
    const std::string name = fs::path(file).filename().string();
    for (const SurfaceSource& source : body.surface.sources)
      if (source.file == name && fs::is_regular_file(file, ignored) &&
          content_hash(read_all(file)) == source.hash)
        throw InputError(file,
                         "is the part that the body was made of: name another output, or add --force to "
                         "replace it");
  }
}

}  // namespace flexel::mapping
