// A piece keeps the body's order of elements and cells, so that parts stay ranges.
#include "distributed/piece.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "base/files/packing.h"
#include "base/math/vec.h"
#include "formats/lattice/body_file.h"

namespace flexel::distributed {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

Column entries(const Column& column, const std::vector<std::uint32_t>& kept) {
  Column result{column.components, {}};
  const auto width = static_cast<std::size_t>(column.components);
  for (const std::uint32_t i : kept)
    result.values.insert(result.values.end(), column.values.begin() + static_cast<std::ptrdiff_t>(width * i),
                         column.values.begin() + static_cast<std::ptrdiff_t>(width * (i + 1)));
  return result;
}

// Where a range of the body begins or ends among those of its entries that are kept (ascending).
std::uint32_t place_among(const std::vector<std::uint32_t>& kept, std::uint32_t bound) {
  return static_cast<std::uint32_t>(std::lower_bound(kept.begin(), kept.end(), bound) - kept.begin());
}

// Of a body the cells `cells` and their elements; `elements` becomes which those are, ascending.
Body body_of(const Body& body, const std::vector<std::uint32_t>& cells, std::vector<std::uint32_t>& elements,
             std::vector<std::uint32_t>& local) {
  for (const std::uint32_t c : cells)
    elements.insert(elements.end(), body.cell_elements[c].begin(), body.cell_elements[c].end());
  std::sort(elements.begin(), elements.end());
  elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
  local.assign(body.element_count(), kNone);
  Body piece;
  for (std::uint32_t i = 0; i < elements.size(); ++i) {
    local[elements[i]] = i;
    piece.lattice_index.push_back(body.lattice_index[elements[i]]);
    piece.piece.push_back(body.piece[elements[i]]);
    piece.rest.push_back(body.rest[elements[i]]);
  }
  piece.position = piece.rest;
  piece.connections.assign(elements.size(), 0);  // of centre placement
  for (const std::uint32_t c : cells) {
    std::array<std::uint32_t, 8> corners;
    for (std::size_t a = 0; a < 8; ++a) corners[a] = local[body.cell_elements[c][a]];
    piece.cell_elements.push_back(corners);
    piece.fill.push_back(body.fill[c]);
  }
  piece.surface.parts = body.surface.parts;  // their assemblies, which scenes name
  piece.broken.assign(cells.size(), 0);
  for (const auto& [name, column] : body.cell_columns) piece.cell_columns[name] = entries(column, cells);
  for (const Part& part : body.parts) {
    Part own = part;
    own.element_begin = place_among(elements, part.element_begin);
    own.element_end = place_among(elements, part.element_end);
    own.cell_begin = place_among(cells, part.cell_begin);
    own.cell_end = place_among(cells, part.cell_end);
    piece.parts.push_back(own);
  }
  return piece;
}

// So that it and the body take as much memory as the cells of another rank.
std::size_t cells_of_first(std::size_t cells, int ranks) {
  constexpr double kBody = 350.0 / 3000;  // bytes of a cell of the body beside those of a cell of a piece
  const double count = static_cast<double>(cells);
  const double left = count * ((1 + kBody) / ranks - kBody);
  return ranks == 1 ? cells : std::max<std::size_t>(1, left < 0 ? 0 : static_cast<std::size_t>(left));
}

// The rank that has a cell of both elements.
std::int32_t rank_of_pair(const std::vector<std::uint32_t>& cells_of_row, const Body& body,
                          const Partition& partition, std::uint32_t column) {
  for (const std::uint32_t c : cells_of_row)
    if (std::find(body.cell_elements[c].begin(), body.cell_elements[c].end(), column) !=
        body.cell_elements[c].end())
      return partition.rank[c];
  throw std::logic_error("an effect couples elements of no common cell");
}

std::vector<AddedBlock> added_blocks(const Body& body, const Partition& partition, int rank,
                                     const simulate::BlockMatrix& added,
                                     const std::vector<std::uint32_t>& local) {
  std::vector<std::vector<std::uint32_t>> cells_of(body.element_count());
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (partition.rank[c] >= 0)
      for (const std::uint32_t e : body.cell_elements[c])
        if (added.row_offsets[e] < added.row_offsets[e + 1]) cells_of[e].push_back(c);
  std::vector<AddedBlock> result;
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    for (std::uint64_t q = added.row_offsets[e]; q < added.row_offsets[e + 1]; ++q) {
      if (added.values[q].isZero(0) || partition.number[e] < 0) continue;
      if (rank_of_pair(cells_of[e], body, partition, added.columns[q]) != rank) continue;
      AddedBlock block{local[e], local[added.columns[q]], {}};
      std::copy_n(added.values[q].data(), 9, block.value.begin());
      result.push_back(block);
    }
  return result;
}

}  // namespace

Bytes pack(Piece& piece) {
  Packer packer;
  std::vector<std::byte> body = body_bytes(piece.body);
  std::vector<std::string> assemblies;  // a body file without a surface has none
  for (const SurfacePart& part : piece.body.surface.parts) assemblies.push_back(part.assembly);
  visit_all(packer, body, assemblies, piece.cell, piece.number, piece.owned, piece.mask, piece.added);
  return std::move(packer.bytes);
}

Piece unpack_piece(const Bytes& bytes) {
  Unpacker unpacker(bytes, "the message of a piece", "is damaged");
  Piece piece;
  Bytes body;
  std::vector<std::string> assemblies;
  visit_all(unpacker, body, assemblies, piece.cell, piece.number, piece.owned, piece.mask, piece.added);
  unpacker.finish();
  piece.body = read_body(std::move(body), "the message of a piece");
  if (assemblies.size() != piece.body.parts.size()) unpacker.fail();
  piece.body.surface.parts.clear();
  for (std::size_t p = 0; p < assemblies.size(); ++p)
    piece.body.surface.parts.push_back({piece.body.parts[p].name, assemblies[p]});
  return piece;
}

Partition partition(const Body& body, const std::vector<std::uint8_t>& active, int ranks) {
  const Box box = bounding_box(body.rest);
  Eigen::Index longest = 0;
  (box.max - box.min).maxCoeff(&longest);
  std::vector<std::uint32_t> cells;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (active[c]) cells.push_back(c);
  const auto place = [&](std::uint32_t c) { return body.rest[body.cell_elements[c][0]][longest]; };
  std::sort(cells.begin(), cells.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(place(a), a) < std::pair(place(b), b);
  });
  Partition result{std::vector<std::int32_t>(body.cell_count(), -1),
                   std::vector<PetscInt>(body.element_count(), -1),
                   std::vector<PetscInt>(static_cast<std::size_t>(ranks), 0)};
  std::vector<std::int32_t> owner(body.element_count(), ranks);
  const std::size_t of_first = cells_of_first(cells.size(), ranks),
                    others = static_cast<std::size_t>(ranks) - 1;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto rank =
        static_cast<std::int32_t>(i < of_first ? 0 : 1 + (i - of_first) * others / (cells.size() - of_first));
    result.rank[cells[i]] = rank;
    for (const std::uint32_t e : body.cell_elements[cells[i]]) owner[e] = std::min(owner[e], rank);
  }
  for (const std::int32_t rank : owner)
    if (rank < ranks) ++result.owned[static_cast<std::size_t>(rank)];
  std::vector<PetscInt> next(result.owned.size(), 0);
  std::partial_sum(result.owned.begin(), result.owned.end() - 1, next.begin() + 1);
  for (std::size_t e = 0; e < owner.size(); ++e)
    if (owner[e] < ranks) result.number[e] = next[static_cast<std::size_t>(owner[e])]++;
  return result;
}

Piece cut_piece(const Body& body, const Partition& partition, int rank, const std::vector<std::uint8_t>& mask,
                const simulate::BlockMatrix& added) {
  std::vector<std::uint32_t> cells, elements, local;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (partition.rank[c] == rank) cells.push_back(c);
  Piece piece;
  piece.body = body_of(body, cells, elements, local);
  piece.owned = partition.owned[static_cast<std::size_t>(rank)];
  for (const std::uint32_t e : elements) {
    piece.number.push_back(partition.number[e]);
    piece.mask.push_back(mask[e]);
  }
  piece.added = added_blocks(body, partition, rank, added, local);
  piece.cell = std::move(cells);
  return piece;
}

}  // namespace flexel::distributed
