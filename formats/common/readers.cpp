// Helpers of several readers: faces of meshes without groups, names, units.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "base/error.h"
#include "base/math/weld.h"
#include "base/printable.h"
#include "formats/common/readers.h"
#include "formats/part/topology.h"

namespace flexel {

std::string_view beginning(const ImportInput& input) {
  constexpr std::size_t kLooked = 4096;
  return {reinterpret_cast<const char*>(input.bytes.data()), std::min(kLooked, input.bytes.size())};
}

bool begins_with_word(std::string_view text, std::string_view word) {
  std::size_t at = 0;
  while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) != 0) ++at;
  return text.size() - at >= word.size() &&
         std::equal(word.begin(), word.end(), text.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char w, char t) { return w == std::tolower(static_cast<unsigned char>(t)); });
}

void assign_dihedral_faces(Surface& surface, const std::vector<std::uint32_t>& polygon_part,
                           const std::vector<std::uint32_t>& welded) {
  constexpr std::uint32_t kNoFace = 0xffffffffu;
  const Triangles triangles = triangulate(surface);
  const auto regions =
      dihedral_regions(surface.vertices, triangles.corners, topology(triangles.corners, welded), kFaceAngle);
  const std::size_t polygons = surface.polygon_count();
  surface.polygon_face.resize(polygons);
  // A region may reach from one part into the next only by a degenerate triangle, so the last face made for
  // it is enough.
  std::vector<std::uint32_t> region_face(regions.size(), kNoFace);
  for (std::size_t p = 0; p < polygons; ++p) {
    const std::uint32_t region = regions[surface.polygon_offsets[p] - 2 * p];
    if (region_face[region] == kNoFace || surface.faces[region_face[region]].part != polygon_part[p]) {
      region_face[region] = static_cast<std::uint32_t>(surface.faces.size());
      surface.faces.push_back({"", polygon_part[p]});
    }
    surface.polygon_face[p] = region_face[region];
  }
}

void assign_group_faces(Surface& surface, const std::vector<std::uint32_t>& polygon_part,
                        const std::vector<std::uint32_t>& polygon_group,
                        const std::vector<std::string>& group_names,
                        const std::vector<std::uint32_t>& welded) {
  std::vector<std::set<std::uint32_t>> groups(surface.parts.size());
  for (std::size_t p = 0; p < polygon_group.size(); ++p) groups[polygon_part[p]].insert(polygon_group[p]);
  assign_dihedral_faces(surface, polygon_part, welded);
  // The groups' numbers come after those of the regions.
  const std::size_t regions = surface.faces.size();
  std::map<std::size_t, std::uint32_t> face_of;
  std::vector<SurfaceFace> faces;
  for (std::size_t p = 0; p < polygon_group.size(); ++p) {
    const bool grouped = groups[polygon_part[p]].size() > 1;
    const std::size_t key = grouped ? regions + polygon_group[p] : surface.polygon_face[p];
    const auto [face, added] = face_of.emplace(key, static_cast<std::uint32_t>(faces.size()));
    if (added) faces.push_back({grouped ? group_names[polygon_group[p]] : "", polygon_part[p]});
    surface.polygon_face[p] = face->second;
  }
  surface.faces = std::move(faces);
}

void check_indices(const Surface& surface, const ImportInput& input) {
  for (const std::uint32_t vertex : surface.polygon_vertices)
    if (vertex >= surface.vertices.size())
      throw InputError(input.where, fmt::format("a face names vertex {}, but there are only {}",
                                                std::uint64_t{vertex} + 1, surface.vertices.size()));
}

std::string clean_name(std::string_view text) {
  std::string name;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length > 0 && !acts_on_terminal(text.substr(0, length)))
      name.append(text.substr(0, length));
    else
      name.push_back(std::isspace(static_cast<unsigned char>(text[0])) != 0 ? ' ' : '?');
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  const std::size_t begin = name.find_first_not_of(' ');
  return begin == std::string::npos ? "" : name.substr(begin, name.find_last_not_of(' ') - begin + 1);
}

SurfaceSource unitless_source(const char* format, const ImportOptions& options) {
  SurfaceSource source;
  source.format = format;
  source.unit = options.unit.value_or(1e-3);
  source.unit_given = options.unit.has_value();
  return source;
}

SurfaceSource source_in_unit(const char* format, double unit) {
  SurfaceSource source;
  source.format = format;
  source.unit = unit;
  source.unit_given = true;
  return source;
}

void complete_single_part(Surface& surface, ImportInput& input) {
  surface.parts.push_back({""});
  assign_dihedral_faces(surface, std::vector<std::uint32_t>(surface.polygon_count(), 0),
                        weld(surface.vertices));
  surface.sources[0].bytes = std::move(input.bytes);
}

}  // namespace flexel
