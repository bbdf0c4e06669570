// PLY, read by hand because the same header, order and properties must come out again, and in double
// precision where the file has it (docs/reference/surfaces.md). One file is one part; its faces are dihedral regions.
// Colours and every other single number of a vertex or a face become columns; lists other than the polygons
// stay in the source's bytes only.
#include "formats/ply/ply_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "base/error.h"
#include "formats/common/readers.h"
#include "formats/part/topology.h"

namespace flexel {
namespace {

// What full intensity is as a value of this type; floating-point colours are 0 to 1.
double full_intensity(PlyType type) {
  switch (type) {
    case PlyType::uint8:
      return std::numeric_limits<std::uint8_t>::max();
    case PlyType::uint16:
      return std::numeric_limits<std::uint16_t>::max();
    case PlyType::float32:
    case PlyType::float64:
      return 1;
    default:
      return 0;
  }
}

// The single numbers of an element, by property, gathered entry by entry.
class Attributes {
 public:
  Attributes(const PlyElement& element, const std::vector<std::size_t>& skipped) : element_(element) {
    for (std::size_t i = 0; i < element.properties.size(); ++i)
      if (!element.properties[i].list && std::find(skipped.begin(), skipped.end(), i) == skipped.end())
        values_[i].reserve(element.count);
  }
  void add(std::size_t property, double value) {
    const auto found = values_.find(property);
    if (found != values_.end()) found->second.push_back(value);
  }
  // As columns: red, green, blue (and alpha) as the colour where all are in range; of two properties of one
  // name the first; those with a value that is not finite are left out (the source's bytes keep them).
  Columns columns() && {
    Columns result;
    if (!add_color({"red", "green", "blue"}, "alpha", result))
      static_cast<void>(add_color({"diffuse_red", "diffuse_green", "diffuse_blue"}, "diffuse_alpha", result));
    for (auto& [property, values] : values_) {
      const bool finite =
          std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
      if (finite)
        result.try_emplace(column_name(element_.properties[property].name), Column{1, std::move(values)});
    }
    return result;
  }

 private:
  [[nodiscard]] std::size_t find(const std::string& name) const {
    for (const auto& [property, values] : values_)
      if (element_.properties[property].name == name) return property;
    return kNoProperty;
  }

  // True where it could; the properties are then used up.
  bool add_color(const std::array<const char*, 3>& names, const char* opacity, Columns& result) {
    std::vector<std::size_t> channels;
    for (const char* name : names) channels.push_back(find(name));
    if (find(opacity) != kNoProperty) channels.push_back(find(opacity));
    for (const std::size_t channel : channels)
      if (channel == kNoProperty || !in_range(channel)) return false;
    Column color{static_cast<int>(channels.size()), {}};
    color.values.reserve(channels.size() * element_.count);
    for (std::size_t i = 0; i < element_.count; ++i)
      for (const std::size_t channel : channels)
        color.values.push_back(values_.at(channel)[i] / full_intensity(element_.properties[channel].type));
    result.emplace(kColorColumn, std::move(color));
    for (const std::size_t channel : channels) values_.erase(channel);
    return true;
  }

  [[nodiscard]] bool in_range(std::size_t channel) const {
    const double full = full_intensity(element_.properties[channel].type);
    const std::vector<double>& values = values_.at(channel);
    return full > 0 && std::all_of(values.begin(), values.end(),
                                   [full](double value) { return value >= 0 && value <= full; });
  }

  const PlyElement& element_;
  std::map<std::size_t, std::vector<double>> values_;  // by index of the property
};

void skip(const PlyElement& element, PlyValues& values) {
  if (element.properties.empty()) return;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    values.at(element, i);
    for (const PlyProperty& property : element.properties)
      for (std::size_t left = property.list ? values.next_count(property) : 1; left > 0; --left)
        static_cast<void>(values.next(property.type));
  }
}

void read_vertices(const PlyElement& element, PlyValues& values, Surface& surface, const ImportInput& input) {
  const PlyVertexLayout layout = vertex_layout(element);
  if (std::find(layout.position.begin(), layout.position.end(), kNoProperty) != layout.position.end())
    throw InputError(input.where, "its vertices have no x, y and z");
  if (element.count > 0xffffffffu) throw InputError(input.where, "holds too many vertices");
  std::vector<std::size_t> skipped(layout.position.begin(), layout.position.end());
  skipped.insert(skipped.end(), layout.normal.begin(), layout.normal.end());
  Attributes attributes(element, skipped);
  std::vector<double> entry(element.properties.size());
  surface.vertices.reserve(element.count);
  for (std::uint64_t v = 0; v < element.count; ++v) {
    values.at(element, v);
    for (std::size_t i = 0; i < entry.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      for (std::size_t left = property.list ? values.next_count(property) : 1; left > 0; --left)
        entry[i] = values.next(property.type);
      if (!property.list) attributes.add(i, entry[i]);
    }
    const Vec3 position(entry[layout.position[0]], entry[layout.position[1]], entry[layout.position[2]]);
    if (!position.allFinite()) values.fail("a coordinate is not a finite number");
    surface.vertices.push_back(position);
  }
  surface.vertex_columns = std::move(attributes).columns();
}

std::uint32_t index_of(double value, PlyValues& values) {
  if (!(value >= 0) || value >= 0xffffffffu || value != std::floor(value))
    values.fail(fmt::format("\"{}\" is not the index of a vertex", value));
  return static_cast<std::uint32_t>(value);
}

void read_faces(const PlyElement& element, PlyValues& values, Surface& surface, const ImportInput& input) {
  const auto corners =
      std::find_if(element.properties.begin(), element.properties.end(), [](const PlyProperty& property) {
        return property.list && (property.name == "vertex_indices" || property.name == "vertex_index");
      });
  if (corners == element.properties.end())
    throw InputError(input.where, "its faces have no list \"vertex_indices\"");
  Attributes attributes(element, {});
  surface.polygon_offsets.reserve(element.count + 1);
  for (std::uint64_t f = 0; f < element.count; ++f) {
    values.at(element, f);
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (!property.list) {
        attributes.add(i, values.next(property.type));
        continue;
      }
      const bool polygon = &property == &*corners;
      const std::size_t count = values.next_count(property);
      if (polygon && count < 3) values.fail(fmt::format("has {} corners, fewer than three", count));
      for (std::size_t left = count; left > 0; --left) {
        const double value = values.next(property.type);
        if (polygon) surface.polygon_vertices.push_back(index_of(value, values));
      }
    }
    if (surface.polygon_vertices.size() > 0xffffffffu) values.fail("the file holds too many polygons");
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
  }
  surface.polygon_columns = std::move(attributes).columns();
}

Surface read_elements(const PlyHeader& header, const ImportInput& input) {
  Surface surface;
  surface.polygon_offsets.push_back(0);
  PlyValues values(input.bytes, header, input.where);
  bool vertices = false, faces = false, strips = false;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex" && !std::exchange(vertices, true))
      read_vertices(element, values, surface, input);
    else if (element.name == "face" && !std::exchange(faces, true))
      read_faces(element, values, surface, input);
    else
      skip(element, values);
    strips = strips || element.name == "tristrips";
  }
  if (surface.polygon_count() > 0) return surface;
  throw InputError(input.where, strips     ? "holds triangle strips, not faces: write it with faces"
                                : vertices ? "holds points but no faces: a surface is needed"
                                           : "holds no faces: nothing to work on");
}

Evidence sniff_ply(const ImportInput& input) {
  const std::string_view text = beginning(input);
  return text.starts_with("ply\n") || text.starts_with("ply\r") ? Evidence::magic : Evidence::none;
}

bool is_ascii_ply(const ImportInput& input) {
  return beginning(input).find("format ascii") != std::string_view::npos;
}

Surface read_ply(ImportInput& input, const ImportOptions& options) {
  const PlyHeader header = parse_ply_header(input.bytes, input.where);
  Surface surface = read_elements(header, input);
  check_indices(surface, input);
  surface.sources.push_back(
      unitless_source(header.encoding == PlyEncoding::ascii ? "ply-ascii" : "ply-binary", options));
  for (Vec3& vertex : surface.vertices) vertex *= surface.sources[0].unit;
  complete_single_part(surface, input);
  return surface;
}

}  // namespace

constinit const FileReader kPlyReader{
    .format = &kPlyFormat, .sniff = sniff_ply, .read = read_ply, .is_text = is_ascii_ply};

}  // namespace flexel
