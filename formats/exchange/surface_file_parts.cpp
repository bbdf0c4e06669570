// One file a part: each part is extracted with the vertices that its polygons use, in their order, and
// written as a surface.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <set>

#include "base/printable.h"
#include "formats/exchange/surface_file.h"

namespace flexel {
namespace {

constexpr std::string_view kPlace = "{part}";

// Rows `kept` of every column.
Columns rows_of(const Columns& columns, const std::vector<std::uint32_t>& kept) {
  Columns result;
  for (const auto& [name, column] : columns) {
    Column& rows = result[name];
    rows.components = column.components;
    const auto components = static_cast<std::size_t>(column.components);
    for (const std::uint32_t row : kept)
      rows.values.insert(rows.values.end(),
                         column.values.begin() + static_cast<std::ptrdiff_t>(row * components),
                         column.values.begin() + static_cast<std::ptrdiff_t>((row + 1) * components));
  }
  return result;
}

// One part, and which vertices of the whole it has.
struct Extract {
  Surface surface;
  std::vector<std::uint32_t> vertices;
};

Extract extract(const Surface& whole, std::uint32_t part) {
  Extract result;
  Surface& surface = result.surface;
  std::vector<std::uint32_t> polygons, face_of(whole.faces.size(), 0);
  for (std::uint32_t p = 0; p < whole.polygon_count(); ++p) {
    if (whole.polygon_part(p) != part) continue;
    polygons.push_back(p);
    const auto corners = whole.polygon(p);
    result.vertices.insert(result.vertices.end(), corners.begin(), corners.end());
  }
  std::sort(result.vertices.begin(), result.vertices.end());
  result.vertices.erase(std::unique(result.vertices.begin(), result.vertices.end()), result.vertices.end());
  for (const std::uint32_t v : result.vertices) surface.vertices.push_back(whole.vertices[v]);
  for (std::size_t f = 0; f < whole.faces.size(); ++f) {
    if (whole.faces[f].part != part) continue;
    face_of[f] = static_cast<std::uint32_t>(surface.faces.size());
    surface.faces.push_back({whole.faces[f].name, 0});
  }
  surface.polygon_offsets.push_back(0);
  for (const std::uint32_t p : polygons) {
    for (const std::uint32_t v : whole.polygon(p)) {
      const auto at = std::lower_bound(result.vertices.begin(), result.vertices.end(), v);
      surface.polygon_vertices.push_back(static_cast<std::uint32_t>(at - result.vertices.begin()));
    }
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(face_of[whole.polygon_face[p]]);
  }
  surface.vertex_columns = rows_of(whole.vertex_columns, result.vertices);
  surface.polygon_columns = rows_of(whole.polygon_columns, polygons);
  surface.parts.push_back(whole.parts[part]);
  SurfaceSource source = whole.sources[whole.part_source[part]];
  source.bytes.clear();  // those of the whole file, which has other parts
  surface.sources.push_back(std::move(source));
  surface.part_source.push_back(0);
  return result;
}

// The path with a part's file name in it.
std::string path_of(std::string path, const std::string& name) {
  for (std::size_t at = path.find(kPlace); at != std::string::npos; at = path.find(kPlace, at + name.size()))
    path.replace(at, kPlace.size(), name);
  return path;
}

// A part's name as one of a file: no folder in it, and nothing that acts on a terminal (a body's names are
// whatever its file says).
std::string fit_for_file(std::string_view name) {
  std::string fit;
  while (!name.empty()) {
    const std::size_t length = utf8_length(name);
    const std::string_view character = name.substr(0, std::max<std::size_t>(length, 1));
    if (length == 0 || character == "/" || acts_on_terminal(character))
      fit += '_';
    else
      fit += character;
    name.remove_prefix(character.size());
  }
  return fit;
}

// Names fit for files, no two alike: a part whose own name fits has it, others get "-2", "-3" ... where
// theirs is taken.
std::vector<std::string> file_names(const std::vector<SurfacePart>& parts) {
  std::vector<std::string> names(parts.size());
  std::set<std::string> taken;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    names[p] = fit_for_file(parts[p].name);
    if (names[p] == parts[p].name) taken.insert(names[p]);
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (names[p] == parts[p].name) continue;
    const std::string fit = names[p];
    for (int number = 2; !taken.insert(names[p]).second; ++number)
      names[p] = fmt::format("{}-{}", fit, number);
  }
  return names;
}

}  // namespace

bool names_parts(const std::string& path) {
  return path.find(kPlace) != std::string::npos;
}

void write_parts(const Surface& surface, const std::vector<Vec3>& displacement, SurfaceFormat format,
                 double unit, const std::string& path) {
  const std::vector<std::string> names = file_names(surface.parts);
  if (surface.parts.size() == 1) {
    write_surface(surface, displacement, format, unit, path_of(path, names[0]));
    return;
  }
  for (std::uint32_t part = 0; part < surface.parts.size(); ++part) {
    const Extract own = extract(surface, part);
    if (own.surface.polygon_count() == 0) continue;
    std::vector<Vec3> moved;
    for (const std::uint32_t v : own.vertices) moved.push_back(displacement[v]);
    write_surface(own.surface, moved, format, unit, path_of(path, names[part]));
  }
}

}  // namespace flexel
