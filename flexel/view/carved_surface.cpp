// Pieces number their faces anew; which of the body's a face is its name tells, if that is its number.
#include "flexel/view/carved_surface.h"

#include "mapping/crack/crack_carved.h"

namespace flexel::view {
namespace {

Surface with_numbered_faces(const Surface& surface) {
  Surface numbered = surface;
  for (std::size_t f = 0; f < numbered.faces.size(); ++f) numbered.faces[f].name = std::to_string(f);
  numbered.polygon_columns.erase("carved");
  return numbered;
}

}  // namespace

CarvedSurface carved_surface(const Body& body) {
  Body numbered = body;
  numbered.surface = with_numbered_faces(body.surface);
  mapping::CrackedSurface cracked = mapping::close_carved(
      numbered, find_components(body, element_adjacency(body)), mapping::CrackMode::cap);
  CarvedSurface carved;
  carved.face_numbers = face_numbers(body.surface);
  const auto own_faces = static_cast<std::uint32_t>(body.surface.faces.size());
  std::vector<std::uint32_t> body_face;  // (faces of `cracked`)
  for (const SurfaceFace& face : cracked.surface.faces)
    body_face.push_back(face.name == "crack" ? own_faces + cracked.pieces[cracked.part_piece[face.part]].part
                                             : static_cast<std::uint32_t>(std::stoul(face.name)));
  carved.surface = std::move(cracked.surface);
  for (std::uint32_t& face : carved.surface.polygon_face) face = body_face[face];
  carved.surface.parts = body.surface.parts;
  carved.surface.part_source = body.surface.part_source;
  carved.surface.faces = body.surface.faces;
  for (std::uint32_t part = 0; part < body.surface.parts.size(); ++part)
    carved.surface.faces.push_back({"", part});
  carved.face_numbers.resize(carved.surface.faces.size(), 0);
  for (std::size_t v = 0; v < carved.surface.vertices.size(); ++v) {
    const mapping::VertexAnchor& anchor = cracked.anchors.anchor[v];
    carved.element.push_back(anchor.in_cell ? 0 : anchor.owner);
    carved.cell.emplace_back();
    if (anchor.in_cell) carved.cell.back() = cell_point(body, anchor.owner, carved.surface.vertices[v]);
  }
  return carved;
}

}  // namespace flexel::view
