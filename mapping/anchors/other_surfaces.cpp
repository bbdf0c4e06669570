// The polygons of another surface name no cells, so its vertices are anchored at their nearest elements
// (mapping/anchors/vertex_anchor.h). Points of a table ask the body's own surface which matter they are of.
#include "mapping/anchors/other_surfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "formats/lattice/locate.h"
#include "mapping/anchors/nearest.h"

namespace flexel::mapping {
namespace {

constexpr std::size_t kSamples = 500;  // vertices of a part that say where it lies

// (parts of the surface) the part of the body that carries each.
std::vector<std::uint32_t> partners(const Body& body, const Surface& surface) {
  std::vector<std::uint32_t> partner(surface.parts.size(), 0);
  if (body.parts.size() == 1) return partner;
  std::vector<ElementGrid> grids;
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) grids.emplace_back(body, p);
  std::vector<std::vector<std::uint32_t>> vertices(surface.parts.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (const std::uint32_t v : surface.polygon(p)) vertices[surface.polygon_part(p)].push_back(v);
  for (std::size_t s = 0; s < partner.size(); ++s) {
    const auto same = std::find_if(body.parts.begin(), body.parts.end(),
                                   [&](const Part& part) { return part.name == surface.parts[s].name; });
    if (same != body.parts.end()) {
      partner[s] = static_cast<std::uint32_t>(same - body.parts.begin());
      continue;
    }
    const std::size_t stride = std::max<std::size_t>(1, vertices[s].size() / kSamples);
    double least = 1e300;
    for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
      double sum = 0;
      for (std::size_t i = 0; i < vertices[s].size(); i += stride) {
        const Vec3& x = surface.vertices[vertices[s][i]];
        sum += (body.rest[grids[p].nearest(x)] - x).norm();
      }
      if (sum < least) least = sum, partner[s] = p;
    }
  }
  return partner;
}

void drop_cells_under_surface(Body& body) {
  body.surface_cell_offsets.clear();
  body.surface_cells.clear();
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(",;\t", begin), line.size());
    std::string_view word = line.substr(begin, end - begin);
    while (!word.empty() && word.front() == ' ') word.remove_prefix(1);
    while (!word.empty() && (word.back() == ' ' || word.back() == '\r')) word.remove_suffix(1);
    words.push_back(word);
    begin = end + 1;
  }
  return words;
}

std::optional<double> number(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

bool is_comment(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first == std::string_view::npos || line[first] == '#';
}

// Columns named x, y, z in a header line (any case); nothing where a name is missing.
std::optional<std::array<std::size_t, 3>> named_columns(const std::vector<std::string_view>& words) {
  std::array<std::size_t, 3> column{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto found = std::find_if(words.begin(), words.end(), [&](std::string_view word) {
      return word.size() == 1 && (word[0] == "xyz"[axis] || word[0] == "XYZ"[axis]);
    });
    if (found == words.end()) return std::nullopt;
    column[axis] = static_cast<std::size_t>(found - words.begin());
  }
  return column;
}

}  // namespace

void map_onto(Body& body, const Surface& surface) {
  for (const Part& part : body.parts)
    if (part.element_begin == part.element_end)
      throw InputError("part \"" + part.name + "\" has no elements: voxelize it with a smaller --size");
  const std::vector<std::uint32_t> partner = partners(body, surface);
  const std::vector<SurfacePart> parts = body.surface.parts;
  body.surface = surface;
  body.surface.parts = parts;
  body.surface.parts.resize(body.parts.size());
  for (SurfaceFace& face : body.surface.faces) face.part = partner[face.part];
  for (SurfaceSource& source : body.surface.sources) source.bytes.clear();
  drop_cells_under_surface(body);
}

PointTable read_points(const std::string& path, double unit) {
  const Bytes bytes = read_all(path);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // the mark of UTF-8, as Excel writes it
  const std::string name = path == "-" ? "stdin" : path;
  PointTable table;
  table.column = {0, 1, 2};
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    table.lines.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  bool first = true;
  for (std::size_t l = 0; l < table.lines.size(); ++l) {
    if (is_comment(table.lines[l])) continue;
    const std::string where = fmt::format("{}:{}", name, l + 1);
    const std::vector<std::string_view> words = words_of(table.lines[l]);
    if (std::exchange(first, false) && !number(words[0])) {
      const auto columns = named_columns(words);
      if (!columns) throw InputError(where, "a table of points has columns x, y, z: none of that name here");
      table.column = *columns;
      continue;
    }
    Vec3 point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t column = table.column[axis];
      if (column >= words.size()) throw InputError(where, "a point needs x, y and z, with commas between");
      const std::optional<double> value = number(words[column]);
      if (!value) throw InputError(where, fmt::format("\"{}\" is no number", words[column]));
      point[static_cast<Eigen::Index>(axis)] = *value * unit;
    }
    table.line.push_back(l);
    table.points.push_back(point);
  }
  if (table.points.empty()) throw InputError(name, "holds no point: a line \"x,y,z\" for each is needed");
  return table;
}

std::string moved_points(const PointTable& table, const std::vector<Vec3>& displacement, double unit) {
  std::vector<std::string> lines = table.lines;
  for (std::size_t i = 0; i < table.points.size(); ++i) {
    const std::string& line = table.lines[table.line[i]];
    const std::vector<std::string_view> words = words_of(line);
    std::array<std::size_t, 3> axes = {0, 1, 2};  // last column first, so that places before it stay
    std::sort(axes.begin(), axes.end(),
              [&](std::size_t a, std::size_t b) { return table.column[a] > table.column[b]; });
    for (const std::size_t axis : axes) {
      const auto at = static_cast<Eigen::Index>(axis);
      if (displacement[i][at] == 0) continue;
      const std::string_view word = words[table.column[axis]];
      lines[table.line[i]].replace(static_cast<std::size_t>(word.data() - line.data()), word.size(),
                                   fmt::format("{}", (table.points[i][at] + displacement[i][at]) / unit));
    }
  }
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

VertexAnchors map_points(Body& body, const std::vector<Vec3>& points) {
  std::vector<std::optional<PointHome>> homes(points.size());
  {
    const PointHomes find(body);
    parallel_for_each(
        points.size(), [&](std::size_t i) { homes[i] = find.find_near(points[i]); }, 64);
  }
  Surface surface;
  surface.vertices = points;
  surface.polygon_offsets = {0};
  surface.parts = body.surface.parts;
  surface.parts.resize(body.parts.size());
  body.surface = std::move(surface);
  drop_cells_under_surface(body);
  return locate_vertices(body, homes);
}

}  // namespace flexel::mapping
