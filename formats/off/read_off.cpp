// OFF, read by hand because the same lines must come out again, in double precision (docs/reference/surfaces.md). One
// file is one part; its faces are dihedral regions. Colours are whole numbers up to 255, or, where any has a
// point, 0 to 1 (Geomview).
#include "formats/off/off_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "base/error.h"
#include "formats/common/readers.h"
#include "formats/part/topology.h"

namespace flexel {
namespace {

// The colours as a column; none where one is out of range. Entries without a colour are white.
std::optional<Column> color_column(const std::vector<OffColor>& colors, const std::string& where) {
  if (colors.empty()) return std::nullopt;
  bool opacity = false, real = false;
  for (const OffColor& color : colors) {
    opacity = opacity || !color[3].empty();
    for (const std::string_view word : color)
      real = real || word.find_first_of(".eE") != std::string_view::npos;
  }
  const double full = real ? 1 : 255;
  Column column{opacity ? 4 : 3, {}};
  for (const OffColor& color : colors)
    for (std::size_t i = 0; i < (opacity ? 4u : 3u); ++i) {
      const double value = color[i].empty() ? full : off_number(color[i], where);
      if (!(value >= 0 && value <= full)) return std::nullopt;
      column.values.push_back(value / full);
    }
  return column;
}

Evidence sniff_off(const ImportInput& input) {
  return looks_like_off(beginning(input)) ? Evidence::text : Evidence::none;
}

Surface read_off(ImportInput& input, const ImportOptions& options) {
  OffFile file =
      parse_off({reinterpret_cast<const char*>(input.bytes.data()), input.bytes.size()}, input.where);
  if (file.offsets.size() < 2) throw InputError(input.where, "holds no faces: nothing to work on");
  Surface surface;
  surface.sources.push_back(unitless_source("off", options));
  surface.vertices.reserve(file.positions.size());
  for (const OffTriple& words : file.positions) {
    const std::string where = fmt::format("{}: vertex {}", input.where, surface.vertices.size() + 1);
    Vec3 position;
    for (std::size_t i = 0; i < 3; ++i) position[static_cast<Eigen::Index>(i)] = off_number(words[i], where);
    surface.vertices.push_back(position * surface.sources[0].unit);
  }
  surface.polygon_offsets = std::move(file.offsets);
  surface.polygon_vertices = std::move(file.corners);
  if (auto color = color_column(file.vertex_colors, input.where))
    surface.vertex_columns[kColorColumn] = std::move(*color);
  if (auto color = color_column(file.face_colors, input.where))
    surface.polygon_columns[kColorColumn] = std::move(*color);
  complete_single_part(surface, input);
  return surface;
}

}  // namespace

constinit const FileReader kOffReader{
    .format = &kOffFormat, .sniff = sniff_off, .read = read_off, .is_text = [](const ImportInput&) {
      return true;
    }};

}  // namespace flexel
