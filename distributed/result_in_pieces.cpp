// A piece's elements and cells are found in the whole by what every body is sorted by: part, place in the lattice and number there.
#include "distributed/result_in_pieces.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <tuple>

#include "base/files/files.h"

namespace flexel::distributed {
namespace {

using Places = std::vector<std::uint32_t>;

// Of elements `e` of a body in a part's range.
auto place_key(const Body& body, std::uint32_t e) {
  const Index3& at = body.lattice_index[e];
  return std::tuple(at[2], at[1], at[0], body.piece[e]);
}

Places places_of_elements(const Body& piece, const Body& whole) {
  Places places;
  for (std::size_t p = 0; p < piece.parts.size(); ++p) {
    std::uint32_t next = whole.parts.at(p).element_begin;
    for (std::uint32_t e = piece.parts[p].element_begin; e < piece.parts[p].element_end; ++e) {
      const auto key = place_key(piece, e);
      while (next < whole.parts[p].element_end && place_key(whole, next) < key) ++next;
      if (next == whole.parts[p].element_end || place_key(whole, next) != key)
        throw std::logic_error("an element of a piece is not in the whole");
      places.push_back(next);
    }
  }
  return places;
}

Places places_of_cells(const Body& piece, const Body& whole, const Places& elements) {
  Places places;
  for (std::size_t p = 0; p < piece.parts.size(); ++p) {
    const auto end = whole.cell_elements.begin() + whole.parts[p].cell_end;
    for (std::uint32_t c = piece.parts[p].cell_begin; c < piece.parts[p].cell_end; ++c) {
      std::array<std::uint32_t, 8> corners = piece.cell_elements[c];
      for (std::uint32_t& corner : corners) corner = elements[corner];
      // Several cells of one voxel are in no order.
      const auto voxel = [&](const auto& of) {
        const Index3& at = whole.lattice_index[of[0]];
        return std::tuple(at[2], at[1], at[0]);
      };
      auto at = std::lower_bound(whole.cell_elements.begin() + whole.parts[p].cell_begin, end, corners,
                                 [&](const auto& a, const auto& b) { return voxel(a) < voxel(b); });
      while (at != end && voxel(*at) == voxel(corners) && *at != corners) ++at;
      if (at == end || *at != corners) throw std::logic_error("a cell of a piece is not in the whole");
      places.push_back(static_cast<std::uint32_t>(at - whole.cell_elements.begin()));
    }
  }
  return places;
}

Columns taken(const Columns& whole, const Places& places) {
  Columns result;
  for (const auto& [name, column] : whole) {
    Column& own = result[name];
    own.components = column.components;
    const auto width = static_cast<std::size_t>(column.components);
    for (const std::uint32_t at : places)
      for (std::size_t i = 0; i < width; ++i) own.values.push_back(column.values[width * at + i]);
  }
  return result;
}

}  // namespace

std::uint64_t hash_of(const Body& result) {
  const std::span<const Vec3> positions = result.position;
  std::vector<std::uint64_t> made_from = {content_hash(std::as_bytes(positions))};
  for (const Columns* columns : {&result.element_columns, &result.cell_columns})
    for (const auto& [name, column] : *columns) {
      made_from.push_back(content_hash(std::as_bytes(std::span(name))));
      made_from.push_back(content_hash(std::as_bytes(std::span(column.values))));
    }
  for (const Part& part : result.parts)
    made_from.push_back(content_hash(std::as_bytes(std::span(part.material))));
  return run_number(made_from);
}

bool is_piece_list(const std::string& path) {
  return extension(path) == "pvtu";
}

void write_pieces(Body& result, const PieceFiles& files, const PieceRange& range, const std::string& list,
                  bool compress) {
  const bool first = range.begin == 0;
  const SurfaceBeside surface =
      first ? write_shared_surface(result, list, compress) : shared_surface(result, list);
  std::vector<vtu::HeadArray> arrays;
  for (std::uint32_t p = range.begin; p < range.end; ++p) {
    PieceBody piece = read_piece(files, p);
    const Places elements = places_of_elements(piece.body, result);
    const Places cells = places_of_cells(piece.body, result, elements);
    for (std::size_t e = 0; e < elements.size(); ++e) piece.body.position[e] = result.position[elements[e]];
    piece.body.element_columns = taken(result.element_columns, elements);
    piece.body.cell_columns = taken(result.cell_columns, cells);
    for (std::size_t part = 0; part < result.parts.size(); ++part)
      piece.body.parts[part].material = result.parts[part].material;
    const std::string which = piece.body.notes["piece"];
    piece.body.notes = result.notes;
    piece.body.notes["piece"] = which;
    piece.numbers.run = range.run;
    arrays = write_piece(piece, list, surface, compress);
  }
  if (first) write_piece_list(list, range.run, static_cast<std::uint32_t>(files.files.size()), arrays);
}

void write_in_pieces(Body& result, const PieceFiles& files, const std::string& list, bool compress) {
  const std::array<std::uint64_t, 2> made_from = {files.run, hash_of(result)};
  write_pieces(result, files, {0, static_cast<std::uint32_t>(files.files.size()), run_number(made_from)},
               list, compress);
}

}  // namespace flexel::distributed
