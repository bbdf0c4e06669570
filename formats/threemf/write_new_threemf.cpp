// Writes a new 3MF file (Core Specification 1.3, Materials and Properties Extension 1.2): an object and an item of the
// build for each part, its polygons as triangles, colours as one colour group. The same surface gives the same bytes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/files/output_file.h"
#include "base/parallel.h"
#include "base/printable.h"
#include "base/version.h"
#include "formats/common/surface_writers.h"
#include "formats/threemf/threemf_content.h"

namespace flexel {
namespace {

constexpr const char* kDeclaration = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
constexpr const char* kContentTypes =
    "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
    "<Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
    "<Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>"
    "</Types>\n";
constexpr const char* kRelationships =
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    "<Relationship Id=\"rel0\" Target=\"/3D/3dmodel.model\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n";
constexpr const char* kModel =
    "<model unit=\"{}\" xml:lang=\"en-US\" "
    "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\""
    "{}>\n<metadata name=\"Application\">Flexel {}</metadata>\n<resources>\n";
constexpr const char* kMaterials =
    " xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\"";
constexpr std::size_t kColorGroup = 1, kFirstObject = 2;  // ids

// A name as the value of an attribute. Bytes that XML does not have become '?'.
std::string xml_text(std::string_view name) {
  std::string text;
  while (!name.empty()) {
    const std::size_t length = utf8_length(name);
    const std::string_view character = name.substr(0, std::max<std::size_t>(length, 1));
    const auto code = static_cast<unsigned char>(character[0]);
    if (length == 0 || code < ' ' || character == "\xef\xbf\xbe" || character == "\xef\xbf\xbf")
      text += '?';
    else if (const std::size_t special = std::string_view("&<>\"").find(character);
             special != std::string_view::npos)
      text += std::array{"&amp;", "&lt;", "&gt;", "&quot;"}[special];
    else
      text += character;
    name.remove_prefix(character.size());
  }
  return text;
}

const Column* threemf_color_column(const Columns& columns) {
  const auto found = columns.find(kColorColumn);
  return found == columns.end() ? nullptr : &found->second;
}

// The unit that the model is in: that which was asked for where 3MF has it.
std::pair<std::string_view, double> threemf_unit(double unit) {
  const auto units = threemf_units();
  const auto found =
      std::find_if(units.begin(), units.end(), [&](const auto& each) { return each.second == unit; });
  return found == units.end() ? units.front() : *found;
}

using TriangleColors = std::array<std::uint32_t, 3>;  // of the corners, in the group

class ThreeMfMaker {
 public:
  explicit ThreeMfMaker(const DeformedSurface& deformed)
      : surface_(deformed.surface),
        unit_(threemf_unit(deformed.unit)),
        deformed_{deformed.surface, deformed.displacement, unit_.second},
        triangles_(triangulate(deformed.surface)),
        vertex_color_(threemf_color_column(surface_.vertex_columns)),
        polygon_color_(threemf_color_column(surface_.polygon_columns)) {}

  std::string run() {
    std::vector<std::vector<std::uint32_t>> of_part(surface_.parts.size());
    for (std::size_t t = 0; t < triangles_.corners.size(); ++t)
      of_part[surface_.polygon_part(triangles_.polygon[t])].push_back(static_cast<std::uint32_t>(t));
    if (colored()) find_colors();
    std::string text = kDeclaration;
    text += fmt::format(kModel, unit_.first, colored() ? kMaterials : "", version());
    add_group(text);
    local_.resize(surface_.vertices.size());
    std::string build;
    for (std::size_t part = 0; part < of_part.size(); ++part) {
      if (of_part[part].empty()) continue;
      add_object(text, part, of_part[part]);
      append_text(build, "<item objectid=\"{}\"/>\n", kFirstObject + part);
    }
    return text + "</resources>\n<build>\n" + build + "</build>\n</model>\n";
  }

 private:
  [[nodiscard]] bool colored() const { return vertex_color_ != nullptr || polygon_color_ != nullptr; }

  // In the order in which triangles use them.
  void find_colors() {
    std::map<std::uint32_t, std::uint32_t> numbers;
    colors_.resize(triangles_.corners.size());
    for (std::size_t t = 0; t < colors_.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t color = color_of(triangles_.polygon[t], triangles_.corners[t][i]);
        const auto [found, is_new] = numbers.emplace(color, static_cast<std::uint32_t>(group_.size()));
        if (is_new) group_.push_back(color);
        colors_[t][i] = found->second;
      }
  }

  // 0xRRGGBBAA. A polygon's colour tints those of its vertices, as a material of glTF does.
  [[nodiscard]] std::uint32_t color_of(std::uint32_t polygon, std::uint32_t vertex) const {
    std::array<double, 4> color = {1, 1, 1, 1};
    const auto tint = [&](const Column* column, std::uint32_t row) {
      if (column == nullptr) return;
      const auto n = static_cast<std::size_t>(column->components);
      for (std::size_t c = 0; c < std::min<std::size_t>(n, 4); ++c) color[c] *= column->values[row * n + c];
    };
    tint(vertex_color_, vertex);
    tint(polygon_color_, polygon);
    std::uint32_t packed = 0;
    for (const double value : color)
      packed = packed << 8 | static_cast<std::uint32_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
    return packed;
  }

  void add_group(std::string& text) const {
    if (!colored()) return;
    append_text(text, "<m:colorgroup id=\"{}\">\n", kColorGroup);
    for (const std::uint32_t color : group_)
      if ((color & 0xff) == 0xff)
        append_text(text, "<m:color color=\"#{:06X}\"/>\n", color >> 8);
      else
        append_text(text, "<m:color color=\"#{:08X}\"/>\n", color);
    text += "</m:colorgroup>\n";
  }

  void add_object(std::string& text, std::size_t part, const std::vector<std::uint32_t>& triangles) {
    append_text(text, "<object id=\"{}\" type=\"model\" name=\"{}\"", kFirstObject + part,
                xml_text(surface_.parts[part].name));
    const bool same =
        colored() && std::all_of(triangles.begin(), triangles.end(), [&](std::uint32_t t) {
          return colors_[t] ==
                 TriangleColors{colors_[triangles[0]][0], colors_[triangles[0]][0], colors_[triangles[0]][0]};
        });
    if (colored()) append_text(text, " pid=\"{}\" pindex=\"{}\"", kColorGroup, colors_[triangles[0]][0]);
    text += ">\n<mesh>\n<vertices>\n";
    add_vertices(text, triangles);
    text += "</vertices>\n<triangles>\n";
    for (const std::uint32_t t : triangles) {
      const auto& corners = triangles_.corners[t];
      append_text(text, "<triangle v1=\"{}\" v2=\"{}\" v3=\"{}\"", local_[corners[0]], local_[corners[1]],
                  local_[corners[2]]);
      if (colored() && !same) add_colors(text, colors_[t]);
      text += "/>\n";
    }
    text += "</triangles>\n</mesh>\n</object>\n";
  }

  static void add_colors(std::string& text, const TriangleColors& colors) {
    append_text(text, " pid=\"{}\" p1=\"{}\"", kColorGroup, colors[0]);
    if (colors[1] != colors[0] || colors[2] != colors[0])
      append_text(text, " p2=\"{}\" p3=\"{}\"", colors[1], colors[2]);
  }

  // Those that the part's triangles use, in their order.
  void add_vertices(std::string& text, const std::vector<std::uint32_t>& triangles) {
    constexpr std::size_t kGrain = 4096;
    std::vector<std::uint32_t> used;
    used.reserve(3 * triangles.size());
    for (const std::uint32_t t : triangles)
      used.insert(used.end(), triangles_.corners[t].begin(), triangles_.corners[t].end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    std::vector<std::string> chunks(used.size() / kGrain + 1);
    parallel_chunks(used.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      std::string& chunk = chunks[begin / kGrain];
      for (std::size_t i = begin; i < end; ++i) {
        local_[used[i]] = static_cast<std::uint32_t>(i);
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
          chunk += std::array{"<vertex x=\"", "\" y=\"", "\" z=\""}[static_cast<std::size_t>(axis)];
          append_coordinate(chunk, deformed_, used[i], axis);
        }
        chunk += "\"/>\n";
      }
    });
    for (const std::string& chunk : chunks) text += chunk;
  }

  const Surface& surface_;
  const std::pair<std::string_view, double> unit_;
  const DeformedSurface deformed_;
  const Triangles triangles_;
  const Column *vertex_color_, *polygon_color_;
  std::vector<std::uint32_t> group_;    // colours, 0xRRGGBBAA
  std::vector<TriangleColors> colors_;  // (triangles)
  std::vector<std::uint32_t> local_;    // (vertices) number within their object
};

}  // namespace

void write_new_3mf(const DeformedSurface& deformed, OutputFile& out) {
  ZipWriter archive;
  archive.add("[Content_Types].xml", std::string(kDeclaration) + kContentTypes);
  archive.add("_rels/.rels", std::string(kDeclaration) + kRelationships);
  archive.add("3D/3dmodel.model", ThreeMfMaker(deformed).run());
  const Bytes bytes = archive.finish();
  out.write(bytes.data(), bytes.size());
}

}  // namespace flexel
