// Names of the arrays of a body file, for its writer and its reader; docs/reference/body-file.md explains them. And what
// pieces of a lattice (formats/pieces), whose files hold more arrays and share one surface, take of both.
#pragma once
#include <array>
#include <string>

#include "formats/lattice/body_file.h"
#include "formats/part/column.h"
#include "formats/vtu/vtu_head.h"

namespace flexel::names {

constexpr const char* version = "flexel_version";
constexpr const char* metadata = "flexel_metadata";
constexpr const char* surface_vertices = "surface_vertices";
constexpr const char* surface_polygon_offsets = "surface_polygon_offsets";
constexpr const char* surface_polygon_vertices = "surface_polygon_vertices";
constexpr const char* surface_polygon_face = "surface_polygon_face";
constexpr const char* surface_face_part = "surface_face_part";
constexpr const char* surface_cell_offsets = "surface_cell_offsets";
constexpr const char* surface_cells = "surface_cells";
constexpr const char* moment_cells = "moment_cells";
constexpr const char* moments = "moments";
// Before the name of each attribute of the surface.
constexpr const char* surface_vertex_columns = "surface_vertex_columns.";
constexpr const char* surface_polygon_columns = "surface_polygon_columns.";
constexpr const char* surface_source_bytes = "surface_source_bytes";
constexpr const char* surface_source_headers = "surface_source_headers";
constexpr const char* position = "position";
constexpr const char* rest = "rest";
constexpr const char* displacement = "displacement";
constexpr const char* lattice_index = "lattice_index";
constexpr const char* piece = "piece";
constexpr const char* part = "part";
constexpr const char* connections = "connections";
constexpr const char* connectivity = "connectivity";
constexpr const char* offsets = "offsets";
constexpr const char* types = "types";
constexpr const char* fill = "fill";
constexpr const char* material = "material";
constexpr const char* broken = "broken";
// Of pieces alone
constexpr const char* ghost = "vtkGhostType";
constexpr const char* pieces_run = "pieces_run";
constexpr const char* pieces_index = "pieces_index";
constexpr const char* pieces_points = "pieces_points";

// Our corner a = i + 2 j + 4 k at place v of VTK's hexahedron (which runs around the lower face, then the
// upper). Its own inverse.
constexpr std::array<std::size_t, 8> vtk_corner = {0, 1, 3, 2, 4, 5, 7, 6};
constexpr std::uint8_t vtk_hexahedron = 12, vtk_vertex = 1;

// True for the arrays of point or cell data that are not columns.
[[nodiscard]] inline bool reserved(const std::string& name, vtu::Section section) {
  if (name == ghost) return true;
  if (section == vtu::Section::point_data)
    return name == vtu::kGlobalPointIds || name == rest || name == displacement || name == lattice_index ||
           name == piece || name == part || name == connections;
  return name == fill || name == part || name == material || name == broken;
}

[[nodiscard]] inline bool valid_column(const std::string& name, vtu::Section section) {
  return valid_column_name(name) && !reserved(name, section);
}

}  // namespace flexel::names

namespace flexel {

// A piece's file: the arrays of the body, with the cells under polygons and the moments but not the surface, which the
// file `surface` holds (a body file without elements), and `more`. All of them are returned, to be listed.
std::vector<vtu::HeadArray> write_piece_body(const Body& body, const std::string& path,
                                             const SurfaceBeside& surface,
                                             const std::vector<vtu::Array>& more, bool compress);

// The body that such a file holds. Throws InputError as read_body does.
[[nodiscard]] Body read_piece_body(const vtu::File& file, const std::string& path);

}  // namespace flexel
