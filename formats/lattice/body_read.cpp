// .vtu -> Body: first the version, then the metadata, then the arrays, and at the end check(). Displacement,
// part, material, offsets and types repeat other fields and are not read back (only their sizes are checked).
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "base/error.h"
#include "base/files/named_file.h"
#include "base/parallel.h"
#include "base/resources.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/body_file_names.h"
#include "formats/lattice/body_metadata.h"
#include "formats/lattice/cell_moments.h"
#include "formats/lattice/column_names.h"
#include "formats/vtu/vtu_head.h"

namespace flexel {
namespace {

using vtu::Section;

void require_version(const vtu::File& file) {
  if (!file.has(Section::field, names::version))
    file.fail("is a .vtu but not a body file: one written by flexel-voxelize or flexel-simulate is needed");
  const std::vector<std::int32_t> version = file.read<std::int32_t>(Section::field, names::version);
  if (version.size() != 1)
    file.fail(fmt::format("damaged: field data \"{}\" has {} entries", names::version, version.size()));
  if (version.front() != kBodyFileVersion)
    file.fail(fmt::format(
        "is a body file of version {}; this program reads version {}: use the programs of one release",
        version.front(), kBodyFileVersion));
}

bool is_piece(const vtu::File& file) {
  return file.has(Section::field, names::pieces_run);
}

Metadata read_metadata(const vtu::File& file, const std::string& where) {
  const std::vector<std::uint8_t> text = file.read<std::uint8_t>(Section::field, names::metadata);
  return metadata_from_json(std::string(text.begin(), text.end()), where);
}

void read_sources(const vtu::File& file, const Metadata& metadata, Surface& surface) {
  const Bytes packed = file.read<std::byte>(Section::field, names::surface_source_bytes);
  const Bytes headers = file.read<std::byte>(Section::field, names::surface_source_headers);
  std::size_t at = 0, header_at = 0;
  for (std::size_t s = 0; s < surface.sources.size(); ++s) {
    const PackedSource& source = metadata.sources[s];
    const std::span<const std::byte> rest = std::span(packed).subspan(at);
    std::uint64_t packed_size = 0;
    for (const std::uint64_t size : source.block_sizes) {
      if (size > rest.size() - packed_size)
        file.fail(fmt::format("damaged: field data \"{}\" is too short for source {}",
                              names::surface_source_bytes, s));
      packed_size += size;
    }
    if (source.header_size > headers.size() - header_at || source.size / 1032 > packed_size)
      file.fail(fmt::format("damaged: flexel_metadata: surface.sources[{}] has wrong sizes", s));
    Bytes& bytes = surface.sources[s].bytes;
    bytes.resize(source.size);
    try {
      vtu::unpack_blocks(rest, source.block_sizes, vtu::kBlockSize, source.size, bytes.data());
    } catch (const InputError& error) {
      file.fail(fmt::format("field data \"{}\": {}", names::surface_source_bytes, error.what()));
    }
    surface.sources[s].stl_header.assign(headers.begin() + header_at,
                                         headers.begin() + header_at + source.header_size);
    at += packed_size;
    header_at += source.header_size;
  }
}

// Attributes of the surface: the arrays of the field data whose names begin with `prefix`.
void read_surface_columns(const vtu::File& file, const std::string& prefix, Columns& columns) {
  for (const std::string& name : file.names(Section::field)) {
    if (!name.starts_with(prefix)) continue;
    Column column{static_cast<int>(file.components(Section::field, name)),
                  file.read_flat(Section::field, name)};
    columns.emplace(name.substr(prefix.size()), std::move(column));
  }
}

void read_surface(const vtu::File& file, const Metadata& metadata, Body& body) {
  Surface& surface = body.surface;
  surface.vertices = file.read<Vec3>(Section::field, names::surface_vertices);
  surface.polygon_offsets = file.read<std::uint32_t>(Section::field, names::surface_polygon_offsets);
  surface.polygon_vertices = file.read<std::uint32_t>(Section::field, names::surface_polygon_vertices);
  surface.polygon_face = file.read<std::uint32_t>(Section::field, names::surface_polygon_face);
  for (const std::uint32_t part : file.read<std::uint32_t>(Section::field, names::surface_face_part))
    surface.faces.push_back({"", part});
  for (const auto& [face, name] : metadata.face_names) {
    if (face >= surface.faces.size())
      file.fail(fmt::format("damaged: flexel_metadata: face_names names face {}", face));
    surface.faces[face].name = name;
  }
  read_sources(file, metadata, surface);
  read_surface_columns(file, names::surface_vertex_columns, surface.vertex_columns);
  read_surface_columns(file, names::surface_polygon_columns, surface.polygon_columns);
}

void read_surface_cells(const vtu::File& file, Body& body) {
  body.surface_cell_offsets = file.read<std::uint32_t>(Section::field, names::surface_cell_offsets);
  body.surface_cells = file.read<std::uint32_t>(Section::field, names::surface_cells);
}

void read_columns(const vtu::File& file, Section section, std::size_t count, Columns& columns) {
  for (const std::string& name : file.names(section)) {
    if (names::reserved(name, section)) continue;
    if (!names::valid_column(name, section))
      file.fail(fmt::format("damaged: \"{}\" is not the name of a column", name));
    Column column;
    column.components = static_cast<int>(file.components(section, name));
    column.values = file.read_flat(section, name);
    const std::size_t values = count * file.components(section, name);
    // A factor that another program gave the vertices of centre-placed parts would be lost without a word.
    if (std::any_of(kChangeColumns.begin(), kChangeColumns.end(),
                    [&](const ChangeColumn& change) { return change.name == name; }) &&
        values < column.values.size() &&
        std::any_of(column.values.begin() + static_cast<std::ptrdiff_t>(values), column.values.end(),
                    [](double value) { return value != 0; }))
      file.fail(fmt::format(
          "cell data \"{}\" is not 0 at a vertex: elements of centre-placed parts have theirs in the "
          "point data",
          name));
    column.values.resize(values);
    columns.emplace(name, std::move(column));
  }
}

// VTK's connectivity -> cells; `Index` is the type that the file has.
template <class Index>
void read_connectivity(const vtu::File& file, std::size_t cells, Body& body) {
  const std::vector<Index> indices = file.read<Index>(Section::cells, names::connectivity);
  if (indices.size() != 8 * cells + (file.cells() - cells))
    file.fail(
        fmt::format("damaged: cells \"connectivity\" has {} entries for {} cells", indices.size(), cells));
  const Index most = static_cast<Index>(body.element_count());
  const auto begin = indices.begin();
  if (std::any_of(begin, begin + 8 * cells, [most](Index e) { return e < 0 || e >= most; }))
    file.fail("damaged: cells \"connectivity\" names an element that is not there");
  body.cell_elements.resize(cells);
  parallel_for_each(cells, [&](std::size_t c) {
    for (std::size_t v = 0; v < 8; ++v)
      body.cell_elements[c][names::vtk_corner[v]] = static_cast<std::uint32_t>(indices[8 * c + v]);
  });
}

void read_elements(const vtu::File& file, Body& body) {
  body.position = file.read<Vec3>(Section::points, names::position);
  body.rest = file.read<Vec3>(Section::point_data, names::rest);
  body.lattice_index = file.read<Index3>(Section::point_data, names::lattice_index);
  body.piece = file.read<std::uint16_t>(Section::point_data, names::piece);
  body.connections = file.read<std::uint32_t>(Section::point_data, names::connections);
  read_columns(file, Section::point_data, body.element_count(), body.element_columns);
}

void read_cells(const vtu::File& file, Body& body) {
  const std::size_t cells = body.parts.empty() ? 0 : body.parts.back().cell_end;
  if (cells > file.cells())
    file.fail(fmt::format("damaged: there are {} cells for the parts' {}", file.cells(), cells));
  if (file.type(Section::cells, names::connectivity) == vtu::type_name<std::int32_t>())
    read_connectivity<std::int32_t>(file, cells, body);
  else
    read_connectivity<std::int64_t>(file, cells, body);
  body.fill = file.read<double>(Section::cell_data, names::fill);
  body.broken = file.read<std::uint8_t>(Section::cell_data, names::broken);
  body.fill.resize(cells);
  body.broken.resize(cells);
  read_columns(file, Section::cell_data, cells, body.cell_columns);
}

// Bodies that were made without have neither.
void read_moments(const vtu::File& file, Body& body) {
  if (!file.has(Section::field, names::moment_cells) && !file.has(Section::field, names::moments)) return;
  body.moment_cells = file.read<std::uint32_t>(Section::field, names::moment_cells);
  for (const CellMoments& each : file.read<CellMoments>(Section::field, names::moments))
    body.moments.insert(body.moments.end(), each.begin(), each.end());
}

vtu::File open_body(Bytes bytes, const std::string& where) {
  if (vtu::is_file_of(bytes, "PUnstructuredGrid"))
    throw InputError(
        where,
        "lists the pieces of a lattice, which flexel-simulate-mpi and flexel-map take, and one body is "
        "needed here: name one of its pieces (.vtu), or let flexel-voxelize write the whole, without "
        "--pieces");
  if (!looks_like_body(bytes))
    throw InputError(where,
                     "is not a body file: one written by flexel-voxelize or flexel-simulate is needed");
  vtu::File file(std::move(bytes), where);
  require_version(file);
  return file;
}

// All but what lies in another file, not checked yet. A piece keeps its cells under polygons and its moments.
Metadata read_arrays(const vtu::File& file, const std::string& where) {
  Metadata metadata = read_metadata(file, where);
  Body& body = metadata.body;
  check_elements(body.parts.empty() ? 0 : static_cast<double>(body.parts.back().element_end), where);
  read_elements(file, body);
  read_cells(file, body);
  read_moments(file, body);
  if (metadata.with_surface) read_surface(file, metadata, body);
  if (metadata.with_surface || is_piece(file)) read_surface_cells(file, body);
  return metadata;
}

struct ReadBody {
  Body body;
  std::optional<SurfaceBeside> beside;
};

ReadBody read_file(const vtu::File& file, const std::string& where) {
  Metadata metadata = read_arrays(file, where);
  Body& body = metadata.body;
  if (metadata.with_surface && body.element_count() == 0)
    file.fail("holds the surface that pieces share, no lattice: name their .pvtu, or one of them");
  if (is_piece(file)) {  // without its surface these would belong to no polygon
    body.surface_cell_offsets.clear();
    body.surface_cells.clear();
  }
  check(body, where);
  return {std::move(body), std::move(metadata.beside)};
}

// The file beside `path` that it says holds its surface.
std::string beside_path(const SurfaceBeside& beside, const std::string& path, const char* is) {
  const std::string file = (std::filesystem::path(path).parent_path() / beside.file).string();
  refuse_device(file, path);
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored))
    throw InputError(path, fmt::format("is {} whose surface is in \"{}\" beside it, which is missing: copy "
                                       "that along",
                                       is, beside.file));
  return file;
}

void require_surface(const Surface& surface, const SurfaceBeside& beside, const std::string& path,
                     const char* is) {
  if (surface_hash(surface) != beside.hash)
    throw InputError(path,
                     fmt::format("is {} whose surface is in \"{}\" beside it, which has another one now: "
                                 "take that of the same run",
                                 is, beside.file));
}

void take_surface_beside(Body& frame, const SurfaceBeside& beside, const std::string& path) {
  constexpr const char* kIs = "a frame of a series";
  const std::string file = beside_path(beside, path, kIs);
  Body from = read_file(open_body(read_all(file), file), file).body;
  require_surface(from.surface, beside, path, kIs);
  take_surface(frame, from, path);
}

}  // namespace

Body read_piece_body(const vtu::File& file, const std::string& path) {
  constexpr const char* kIs = "a piece";
  require_version(file);
  Metadata metadata = read_arrays(file, path);
  Body& body = metadata.body;
  if (metadata.beside) {
    const std::string beside = beside_path(*metadata.beside, path, kIs);
    const vtu::File shared = open_body(read_all(beside), beside);
    const Metadata with = read_metadata(shared, beside);
    Body from = with.body;
    if (!with.with_surface) shared.fail("is to hold the surface of pieces and has none");
    read_surface(shared, with, from);
    require_surface(from.surface, *metadata.beside, path, kIs);
    body.surface = std::move(from.surface);
  }
  check(body, path);
  return std::move(body);
}

Body read_body(const std::string& path) {
  if (path == "-") return read_body(read_all(path), "stdin");
  const vtu::File file = open_body(read_all(path), path);
  if (is_piece(file)) return read_piece_body(file, path);
  ReadBody read = read_file(file, path);
  if (read.beside) take_surface_beside(read.body, *read.beside, path);
  return std::move(read.body);
}

Body read_body(Bytes bytes, const std::string& where) {
  return read_file(open_body(std::move(bytes), where), where).body;
}

Body read_frame(const std::string& path) {
  return read_body(read_all(path), path);
}

void take_surface(Body& frame, Body& from, const std::string& where) {
  const auto same = [](const Part& a, const Part& b) { return a.name == b.name; };
  if (!std::equal(frame.parts.begin(), frame.parts.end(), from.parts.begin(), from.parts.end(), same))
    throw InputError(where, "has other parts than the frame with the surface: map it with its own surface");
  frame.surface = std::move(from.surface);
  const bool same_cells = frame.cell_elements == from.cell_elements;
  // else cells are renumbered: anchors come from the elements
  frame.surface_cell_offsets =
      same_cells ? std::move(from.surface_cell_offsets) : std::vector<std::uint32_t>();
  frame.surface_cells = same_cells ? std::move(from.surface_cells) : std::vector<std::uint32_t>();
  frame.moment_cells = same_cells ? std::move(from.moment_cells) : std::vector<std::uint32_t>();
  frame.moments = same_cells ? std::move(from.moments) : std::vector<double>();
}

bool looks_like_body(std::span<const std::byte> bytes) {
  return vtu::is_file_of(bytes, "UnstructuredGrid");
}

}  // namespace flexel
