// Removes the debris: its polygons, and the faces, parts and vertices that only it uses.
#include "base/error.h"
#include "mapping/crack/crack_pieces.h"

namespace flexel::mapping {
namespace {

// Rows `kept` of every column.
Columns rows_of(const Columns& columns, const std::vector<std::uint32_t>& kept) {
  Columns result;
  for (const auto& [name, column] : columns) {
    Column& rows = result[name];
    rows.components = column.components;
    const auto width = static_cast<std::ptrdiff_t>(column.components);
    for (const std::uint32_t row : kept) {
      const auto from = column.values.begin() + static_cast<std::ptrdiff_t>(row) * width;
      rows.values.insert(rows.values.end(), from, from + width);
    }
  }
  return result;
}

// Numbers in the new surface; kNoBox: gone.
struct Renumbering {
  std::vector<std::uint32_t> part, face, vertex;
};

Renumbering keep_parts(CrackedSurface& cracked, Surface& kept) {
  const Surface& surface = cracked.surface;
  Renumbering to{std::vector<std::uint32_t>(surface.parts.size(), kNoBox),
                 std::vector<std::uint32_t>(surface.faces.size(), kNoBox),
                 {}};
  std::vector<std::uint32_t> part_piece;
  for (std::size_t part = 0; part < surface.parts.size(); ++part) {
    CrackPiece& piece = cracked.pieces[cracked.part_piece[part]];
    piece.dropped = piece.debris;
    if (piece.dropped) continue;
    to.part[part] = static_cast<std::uint32_t>(kept.parts.size());
    kept.parts.push_back(surface.parts[part]);
    kept.part_source.push_back(surface.part_source[part]);
    part_piece.push_back(cracked.part_piece[part]);
  }
  for (std::size_t f = 0; f < surface.faces.size(); ++f)
    if (to.part[surface.faces[f].part] != kNoBox) {
      to.face[f] = static_cast<std::uint32_t>(kept.faces.size());
      kept.faces.push_back({surface.faces[f].name, to.part[surface.faces[f].part]});
    }
  cracked.part_piece = std::move(part_piece);
  return to;
}

// Vertices that no polygon used before stay.
std::vector<std::uint32_t> keep_vertices(const CrackedSurface& cracked, Renumbering& to) {
  const Surface& surface = cracked.surface;
  std::vector<std::uint8_t> stays(surface.vertices.size());
  for (std::size_t v = 0; v < stays.size(); ++v) stays[v] = cracked.anchors.referenced[v] == 0;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (to.face[surface.polygon_face[p]] != kNoBox)
      for (const std::uint32_t v : surface.polygon(p)) stays[v] = 1;
  std::vector<std::uint32_t> vertices;
  to.vertex.assign(stays.size(), kNoBox);
  for (std::uint32_t v = 0; v < stays.size(); ++v)
    if (stays[v]) {
      to.vertex[v] = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(v);
    }
  return vertices;
}

}  // namespace

void drop_debris(CrackedSurface& cracked) {
  Surface kept;
  Renumbering to = keep_parts(cracked, kept);
  if (kept.parts.empty())
    throw InputError("--debris drop: nothing would be left: every piece is a single element");
  const std::vector<std::uint32_t> vertices = keep_vertices(cracked, to);
  const Surface& surface = cracked.surface;
  std::vector<std::uint32_t> polygons;
  kept.polygon_offsets.push_back(0);
  for (std::uint32_t p = 0; p < surface.polygon_count(); ++p) {
    if (to.face[surface.polygon_face[p]] == kNoBox) continue;
    polygons.push_back(p);
    for (const std::uint32_t v : surface.polygon(p)) kept.polygon_vertices.push_back(to.vertex[v]);
    kept.polygon_offsets.push_back(static_cast<std::uint32_t>(kept.polygon_vertices.size()));
    kept.polygon_face.push_back(to.face[surface.polygon_face[p]]);
  }
  VertexAnchors anchors;
  for (const std::uint32_t v : vertices) {
    kept.vertices.push_back(surface.vertices[v]);
    anchors.anchor.push_back(cracked.anchors.anchor[v]);
    anchors.referenced.push_back(cracked.anchors.referenced[v]);
  }
  kept.vertex_columns = rows_of(surface.vertex_columns, vertices);
  kept.polygon_columns = rows_of(surface.polygon_columns, polygons);
  kept.sources = surface.sources;
  std::vector<CrackedSurface::Shift> shifts;
  for (const CrackedSurface::Shift& shift : cracked.shifts)
    if (to.vertex[shift.vertex] != kNoBox) shifts.push_back({to.vertex[shift.vertex], shift.by});
  cracked.surface = std::move(kept);
  cracked.anchors = std::move(anchors);
  cracked.shifts = std::move(shifts);
}

}  // namespace flexel::mapping
