// Body -> .vtu. Arrays that lie in memory as they are written go out from there; the others (hexahedra in
// VTK's corner order, displacement, part and material of each cell) are made a chunk at a time.
// docs/reference/body-file.md gives every array.
#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

#include "base/files/output_file.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/body_file_names.h"
#include "formats/lattice/body_metadata.h"
#include "formats/lattice/cell_moments.h"
#include "formats/vtu/vtu.h"

namespace flexel {
namespace {

using vtu::array_of;
using vtu::made_array;
using vtu::Section;

// Values that the arrays point to while they are written.
struct Workspace {
  std::vector<std::int32_t> version = {kBodyFileVersion};
  std::vector<std::uint8_t> metadata;
  std::vector<std::uint32_t> connections;  // where the body has none
  std::vector<std::uint32_t> element_part, cell_part, part_material;
  std::vector<std::uint32_t> vertex_elements;  // elements of centre-placed parts: each is a VTK vertex
  std::vector<std::uint32_t> face_part;
  Bytes source_bytes, source_headers;
  std::vector<PackedSource> sources;
};

void pack_sources(const Surface& surface, Workspace& work) {
  constexpr int kLevel =
      1;  // the text of meshes packs nearly as well as at higher levels, several times as fast
  for (const SurfaceSource& source : surface.sources) {
    vtu::PackedBlocks packed = vtu::pack_blocks(source.bytes, kLevel);
    work.source_bytes.insert(work.source_bytes.end(), packed.bytes.begin(), packed.bytes.end());
    work.source_headers.insert(work.source_headers.end(), source.stl_header.begin(), source.stl_header.end());
    work.sources.push_back({source.bytes.size(), std::move(packed.sizes), source.stl_header.size()});
  }
  for (const SurfaceFace& face : surface.faces) work.face_part.push_back(face.part);
}

bool has_surface(const Surface& surface) {
  return !surface.vertices.empty() || !surface.polygon_offsets.empty() || !surface.faces.empty() ||
         !surface.parts.empty() || !surface.sources.empty();
}

Workspace prepare(const Body& body, const BodyFileOptions& options, bool with_surface) {
  Workspace work;
  if (with_surface) pack_sources(body.surface, work);
  const std::string metadata = metadata_to_json(body, with_surface, work.sources, options.surface_beside);
  work.metadata.assign(metadata.begin(), metadata.end());
  work.element_part = element_parts(body);
  work.cell_part = cell_parts(body);
  const std::vector<std::string> materials = materials_of(body);
  for (const Part& part : body.parts) {
    const auto found = std::find(materials.begin(), materials.end(), part.material);
    work.part_material.push_back(static_cast<std::uint32_t>(found - materials.begin()));
    if (part.placement == Placement::centre)
      for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) work.vertex_elements.push_back(e);
  }
  return work;
}

void add_surface_columns(const std::string& prefix, const Columns& columns, std::size_t count,
                         std::vector<vtu::Array>& arrays) {
  for (const auto& [name, column] : columns) {
    const auto components = static_cast<std::size_t>(column.components);
    if (column.components < 1 || column.values.size() != count * components || !valid_column_name(name))
      throw std::logic_error("attribute \"" + name +
                             "\" of the surface has a wrong size or a name that is not plain ASCII");
    vtu::Array array = array_of(Section::field, prefix + name, column.values);
    array.components = components;
    array.tuples = count;
    arrays.push_back(std::move(array));
  }
}

void add_surface(const Body& body, const Workspace& work, std::vector<vtu::Array>& arrays) {
  const Surface& surface = body.surface;
  arrays.push_back(array_of(Section::field, names::surface_vertices, surface.vertices));
  arrays.push_back(array_of(Section::field, names::surface_polygon_offsets, surface.polygon_offsets));
  arrays.push_back(array_of(Section::field, names::surface_polygon_vertices, surface.polygon_vertices));
  arrays.push_back(array_of(Section::field, names::surface_polygon_face, surface.polygon_face));
  arrays.push_back(array_of(Section::field, names::surface_face_part, work.face_part));
  add_surface_columns(names::surface_vertex_columns, surface.vertex_columns, surface.vertices.size(), arrays);
  add_surface_columns(names::surface_polygon_columns, surface.polygon_columns, surface.polygon_count(),
                      arrays);
  arrays.push_back(array_of(Section::field, names::surface_source_bytes, work.source_bytes));
  arrays.push_back(array_of(Section::field, names::surface_source_headers, work.source_headers));
}

void add_columns(Section section, const Columns& columns, std::size_t count, std::size_t padding,
                 std::vector<vtu::Array>& arrays) {
  for (const auto& [name, column] : columns) {
    const auto components = static_cast<std::size_t>(column.components);
    if (column.components < 1 || column.values.size() != count * components ||
        !names::valid_column(name, section))
      throw std::logic_error("column \"" + name +
                             "\" has a wrong size or a name that is taken or not plain ASCII");
    vtu::Array array = array_of(section, name, column.values);
    array.components = components;
    array.tuples = count + padding;
    if (padding > 0) {  // VTK's cells beyond ours have no value: 0
      array.memory = nullptr;
      array.make = [&values = column.values, components](std::size_t begin, std::size_t end, void* out) {
        double* next = static_cast<double*>(out);
        for (std::size_t i = begin * components; i < end * components; ++i)
          *next++ = i < values.size() ? values[i] : 0.0;
      };
    }
    arrays.push_back(std::move(array));
  }
}

void add_elements(const Body& body, const Workspace& work, std::vector<vtu::Array>& arrays) {
  const std::size_t n = body.element_count();
  arrays.push_back(array_of(Section::points, names::position, body.position));
  arrays.push_back(array_of(Section::point_data, names::rest, body.rest));
  arrays.push_back(
      made_array<Vec3>(Section::point_data, names::displacement, n,
                       [&body](std::size_t e) -> Vec3 { return body.position[e] - body.rest[e]; }));
  arrays.push_back(array_of(Section::point_data, names::lattice_index, body.lattice_index));
  arrays.push_back(array_of(Section::point_data, names::piece, body.piece));
  arrays.push_back(array_of(Section::point_data, names::part, work.element_part));
  arrays.push_back(array_of(Section::point_data, names::connections, body.connections));
  add_columns(Section::point_data, body.element_columns, n, 0, arrays);
}

// VTK's cells: our cells as hexahedra, then the elements of centre-placed parts as vertices. `Index` is Int32
// where all fits, for VTK takes Int32 and Int64 without a conversion, and no unsigned type.
template <class Index>
void add_connectivity(const Body& body, const Workspace& work, std::vector<vtu::Array>& arrays) {
  const std::size_t m = body.cell_count(), vertices = work.vertex_elements.size();
  vtu::Array connectivity = array_of(Section::cells, names::connectivity, std::vector<Index>());
  connectivity.tuples = 8 * m + vertices;
  connectivity.make = [&body, &work, m](std::size_t begin, std::size_t end, void* out) {
    Index* next = static_cast<Index*>(out);
    for (std::size_t i = begin; i < end; ++i)
      *next++ = static_cast<Index>(i < 8 * m ? body.cell_elements[i / 8][names::vtk_corner[i % 8]]
                                             : work.vertex_elements[i - 8 * m]);
  };
  arrays.push_back(std::move(connectivity));
  arrays.push_back(made_array<Index>(Section::cells, names::offsets, m + vertices, [m](std::size_t c) {
    return static_cast<Index>(c < m ? 8 * (c + 1) : 8 * m + (c - m) + 1);
  }));
  arrays.push_back(made_array<std::uint8_t>(Section::cells, names::types, m + vertices, [m](std::size_t c) {
    return c < m ? names::vtk_hexahedron : names::vtk_vertex;
  }));
}

void add_cells(const Body& body, const Workspace& work, std::vector<vtu::Array>& arrays) {
  const std::size_t m = body.cell_count(), vertices = work.vertex_elements.size(), all = m + vertices;
  const auto part_of = [&work, m](std::size_t c) {
    return c < m ? work.cell_part[c] : work.element_part[work.vertex_elements[c - m]];
  };
  if (8 * m + vertices <= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    add_connectivity<std::int32_t>(body, work, arrays);
  else
    add_connectivity<std::int64_t>(body, work, arrays);
  arrays.push_back(made_array<double>(Section::cell_data, names::fill, all,
                                      [&body, m](std::size_t c) { return c < m ? body.fill[c] : 1.0; }));
  arrays.push_back(made_array<std::uint32_t>(Section::cell_data, names::part, all, part_of));
  arrays.push_back(
      made_array<std::uint32_t>(Section::cell_data, names::material, all,
                                [&work, part_of](std::size_t c) { return work.part_material[part_of(c)]; }));
  arrays.push_back(made_array<std::uint8_t>(
      Section::cell_data, names::broken, all,
      [&body, m](std::size_t c) { return c < m ? body.broken[c] : std::uint8_t{0}; }));
  add_columns(Section::cell_data, body.cell_columns, m, vertices, arrays);
}

void add_moments(const Body& body, std::vector<vtu::Array>& arrays) {
  if (body.moment_cells.empty()) return;
  arrays.push_back(array_of(Section::field, names::moment_cells, body.moment_cells));
  arrays.push_back(array_of(Section::field, names::moments, body.moments));
  arrays.back().components = kMoments;
  arrays.back().tuples = body.moment_cells.size();
}

// A body whose arrays do not fit together is a mistake of the program that made it.
void require_sizes(const Body& body) {
  const std::size_t n = body.element_count(), m = body.cell_count();
  const bool agree = body.lattice_index.size() == n && body.piece.size() == n && body.position.size() == n &&
                     body.connections.size() == n && body.fill.size() == m && body.broken.size() == m &&
                     body.moments.size() == kMoments * body.moment_cells.size() && !body.parts.empty() &&
                     body.parts.back().element_end == n && body.parts.back().cell_end == m;
  if (!agree) throw std::logic_error("write_body: the sizes of the body's arrays do not agree");
}

void add_surface_cells(const Body& body, std::vector<vtu::Array>& arrays) {
  arrays.push_back(array_of(Section::field, names::surface_cell_offsets, body.surface_cell_offsets));
  arrays.push_back(array_of(Section::field, names::surface_cells, body.surface_cells));
}

std::vector<vtu::Array> arrays_of(const Body& body, const Workspace& work, bool with_surface) {
  std::vector<vtu::Array> arrays;
  arrays.push_back(array_of(Section::field, names::version, work.version));
  arrays.push_back(array_of(Section::field, names::metadata, work.metadata));
  if (with_surface) add_surface(body, work, arrays);
  add_elements(body, work, arrays);
  add_cells(body, work, arrays);
  return arrays;
}

void write_to(OutputFile& output, const Body& body, const BodyFileOptions& options) {
  require_sizes(body);
  const bool with_surface = !options.surface_beside && has_surface(body.surface);
  const Workspace work = prepare(body, options, with_surface);
  std::vector<vtu::Array> arrays = arrays_of(body, work, with_surface);
  if (with_surface) add_surface_cells(body, arrays);
  if (!options.surface_beside) add_moments(body, arrays);
  vtu::write(output, body.element_count(), body.cell_count() + work.vertex_elements.size(), arrays,
             options.compress);
  output.commit();
}

}  // namespace

void write_body(const Body& body, const std::string& path, const BodyFileOptions& options) {
  OutputFile output(path);
  write_to(output, body, options);
}

Bytes body_bytes(const Body& body) {
  Bytes bytes;
  OutputFile output(bytes);
  write_to(output, body, {});
  return bytes;
}

std::vector<vtu::HeadArray> write_piece_body(const Body& body, const std::string& path,
                                             const SurfaceBeside& surface,
                                             const std::vector<vtu::Array>& more, bool compress) {
  require_sizes(body);
  const Workspace work = prepare(body, {.surface_beside = surface}, false);
  std::vector<vtu::Array> arrays = arrays_of(body, work, false);
  add_surface_cells(body, arrays);
  add_moments(body, arrays);
  arrays.insert(arrays.end(), more.begin(), more.end());
  OutputFile output(path);
  vtu::write(output, body.element_count(), body.cell_count(), arrays, compress);
  output.commit();
  std::vector<vtu::HeadArray> heads;
  for (const vtu::Array& array : arrays)
    heads.push_back({array.section, array.name, array.type, array.components, {}, 0});
  return heads;
}

std::uint64_t surface_hash(const Surface& surface) {
  const auto bytes_of = [](const auto& values) { return std::as_bytes(std::span(values)); };
  const std::array<std::uint64_t, 3> hashes = {content_hash(bytes_of(surface.vertices)),
                                               content_hash(bytes_of(surface.polygon_offsets)),
                                               content_hash(bytes_of(surface.polygon_vertices))};
  return content_hash(bytes_of(hashes));
}

}  // namespace flexel
