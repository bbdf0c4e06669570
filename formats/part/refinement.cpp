// New vertices come after the two they lie between, so one pass in their order finds all they need.
#include "formats/part/refinement.h"

namespace flexel {
namespace {

Column with_means(const Column& column, const Refinement& refinement) {
  const auto n = static_cast<std::size_t>(column.components);
  Column result = column;
  result.values.reserve(n * (refinement.vertices + refinement.ends.size()));
  for (const auto& [a, b] : refinement.ends)
    for (std::size_t i = 0; i < n; ++i)
      result.values.push_back(0.5 * (result.values[a * n + i] + result.values[b * n + i]));
  return result;
}

Column of_origins(const Column& column, const Refinement& refinement) {
  const auto n = static_cast<std::size_t>(column.components);
  Column result{column.components, {}};
  result.values.reserve(n * refinement.origin.size());
  for (const std::uint32_t p : refinement.origin)
    for (std::size_t i = 0; i < n; ++i) result.values.push_back(column.values[p * n + i]);
  return result;
}

}  // namespace

Refinement composed(const Refinement& first, const Refinement& second) {
  Refinement result = second;
  result.vertices = first.vertices;
  result.ends.insert(result.ends.begin(), first.ends.begin(), first.ends.end());
  for (std::uint32_t& p : result.origin) p = first.origin[p];
  return result;
}

Refinement unsplit(const Surface& surface) {
  Refinement result;
  result.vertices = static_cast<std::uint32_t>(surface.vertices.size());
  result.offsets = surface.polygon_offsets;
  result.corners = surface.polygon_vertices;
  for (std::uint32_t p = 0; p < surface.polygon_count(); ++p) result.origin.push_back(p);
  return result;
}

std::vector<std::uint32_t> first_pieces(const Refinement& refinement) {
  std::vector<std::uint32_t> first;
  for (std::uint32_t p = 0; p < refinement.origin.size(); ++p)
    while (first.size() <= refinement.origin[p]) first.push_back(p);
  first.push_back(static_cast<std::uint32_t>(refinement.origin.size()));
  return first;
}

Surface refined(const Surface& surface, const Refinement& refinement) {
  Surface result;
  result.vertices = surface.vertices;
  result.vertices.reserve(surface.vertices.size() + refinement.ends.size());
  for (const auto& [a, b] : refinement.ends)
    result.vertices.push_back(0.5 * (result.vertices[a] + result.vertices[b]));
  result.polygon_offsets = refinement.offsets;
  result.polygon_vertices = refinement.corners;
  result.polygon_face.reserve(refinement.origin.size());
  for (const std::uint32_t p : refinement.origin) result.polygon_face.push_back(surface.polygon_face[p]);
  for (const auto& [name, column] : surface.vertex_columns)
    result.vertex_columns[name] = with_means(column, refinement);
  for (const auto& [name, column] : surface.polygon_columns)
    result.polygon_columns[name] = of_origins(column, refinement);
  result.faces = surface.faces;
  result.parts = surface.parts;
  result.part_source = surface.part_source;
  for (const SurfaceSource& source : surface.sources) {
    SurfaceSource& copy = result.sources.emplace_back();
    copy.file = source.file;
    copy.format = source.format;
    copy.unit = source.unit;
    copy.unit_given = source.unit_given;
    copy.hash = source.hash;
    copy.stl_header = source.stl_header;
  }
  return result;
}

}  // namespace flexel
