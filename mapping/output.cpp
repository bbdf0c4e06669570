// Displacements times a scale, a note of it in the file's own comments, and attributes as columns.
#include "mapping/output.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "base/error.h"
#include "mapping/report/attributes.h"

namespace flexel::mapping {
namespace {

// Puts `line` before the first line of a text file, or after its `skip` first lines.
void insert_line(Bytes& bytes, const std::string& line, int skip) {
  auto at = bytes.begin();
  for (; skip > 0; --skip) {
    at = std::find(at, bytes.end(), std::byte{'\n'});
    if (at == bytes.end()) return;
    ++at;
  }
  const auto* text = reinterpret_cast<const std::byte*>(line.data());
  bytes.insert(at, text, text + line.size());
}

// Says in the file that displacements are not true to scale: the header of an STL, the solids' names of an
// ASCII one, a comment in what is written again from an OBJ, PLY or OFF file.
void note_scale(Surface& surface, const MapOutput& output) {
  constexpr std::size_t kHeader = 80;
  const std::string note = fmt::format("Flexel: displacements times {:g}", output.scale);
  if (output.format == SurfaceFormat::stl_ascii)
    for (SurfacePart& part : surface.parts) part.name += fmt::format(" ({})", note);
  for (SurfaceSource& source : surface.sources) {
    source.stl_header.assign(kHeader, std::byte{0});
    std::memcpy(source.stl_header.data(), note.data(), std::min(note.size(), kHeader));
    if (source.bytes.empty()) continue;
    if (source.format == "obj") insert_line(source.bytes, "# " + note + "\n", 0);
    if (source.format == "off") insert_line(source.bytes, "# " + note + "\n", 1);
    if (source.format.starts_with("ply")) insert_line(source.bytes, "comment " + note + "\n", 2);
  }
}

}  // namespace

MapOutput map_output(const std::string& format, const std::string& path, bool ascii, double unit,
                     double scale, bool attributes) {
  MapOutput output;
  output.path = path;
  output.unit = unit;
  output.scale = scale;
  output.attributes = attributes;
  if (!std::isfinite(scale)) throw InputError("--scale: a number is needed");
  if (format == "vtu" || (format.empty() && extension(path) == "vtu")) return output;
  output.format = surface_format(format, path, ascii);
  if (unit > 0 && output.format == SurfaceFormat::glb)
    throw InputError("GLB has a unit of its own: leave out --unit");
  if (attributes && output.format != SurfaceFormat::ply && output.format != SurfaceFormat::ply_ascii)
    throw InputError("--attributes: only PLY and .vtu hold attributes of vertices: write one of them");
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
  if (output.scale == 1 && !output.attributes)
    return write_surface(surface, displacement, *output.format, unit, output.path);
  Surface changed = surface;
  if (output.scale != 1) note_scale(changed, output);
  if (output.attributes) {
    changed.vertex_columns.merge(vertex_attributes(surface, body, result));
    for (SurfaceSource& source : changed.sources) source.bytes.clear();  // a new file, with all columns
  }
  write_surface(changed, displacement, *output.format, unit, output.path);
}

}  // namespace flexel::mapping
