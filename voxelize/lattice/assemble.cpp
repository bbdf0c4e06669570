// Kept pieces become cells in the order of the body (k, j, i, piece). At centre placement two elements are
// connected when their pieces share a group at a lattice point, that is, when they are joined inside the
// block of 2, 4 or 8 voxels that they span. A polygon whose matter was dropped is attached to the adjoining
// neighbour cell of largest fill.
#include "voxelize/lattice/assemble.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/bucket.h"
#include "base/parallel.h"
#include "voxelize/lattice/elements.h"

namespace flexel::voxelize {
namespace {

constexpr std::uint32_t kNoCell = 0xffffffffu, kElsewhere = kLeftOut;

// Pieces that become something, numbered on from `first`.
struct KeptPieces {
  std::vector<std::uint32_t> number;  // (pieces) or kNoCell, or kElsewhere
  std::size_t count = 0;
};

// Numbers those that lie outside the box as kElsewhere, and the others on.
void leave_out(const Voxels& voxels, const VoxelBox& held, std::uint32_t first, KeptPieces& kept) {
  std::uint32_t next = first;
  for (std::size_t s = 0; s < voxels.slabs.size(); ++s) {
    const Slab& slab = voxels.slabs[s];
    const int k = voxels.k_begin + static_cast<int>(s);
    for (int j = slab.j_begin; j < slab.j_begin + slab.rows(); ++j)
      for (std::uint32_t p = slab.row_begin[j - slab.j_begin]; p < slab.row_begin[j - slab.j_begin + 1];
           ++p) {
        std::uint32_t& number = kept.number[voxels.first_piece[s] + p];
        if (number != kNoCell) number = held.holds(slab.pieces[p].i, j, k) ? next++ : kElsewhere;
      }
  }
  kept.count = next - first;
}

template <class Keep>
KeptPieces number_kept(const Voxels& voxels, const Keep& keep, std::uint32_t first) {
  const std::size_t slabs = voxels.slabs.size();
  std::vector<std::uint32_t> next(slabs);
  parallel_for_each(
      slabs,
      [&](std::size_t s) {
        const std::vector<Piece>& pieces = voxels.slabs[s].pieces;
        next[s] = static_cast<std::uint32_t>(std::count_if(pieces.begin(), pieces.end(), keep));
      },
      2);
  KeptPieces kept;
  for (std::uint32_t& number : next) {
    const std::uint32_t here = number;
    number = first + static_cast<std::uint32_t>(kept.count);
    kept.count += here;
  }
  resize_touched(kept.number, voxels.piece_count());
  parallel_for_each(
      slabs,
      [&](std::size_t s) {
        std::size_t p = voxels.first_piece[s];
        for (const Piece& piece : voxels.slabs[s].pieces)
          kept.number[p++] = keep(piece) ? next[s]++ : kNoCell;
      },
      2);
  return kept;
}

bool has_centre(const Piece& piece) {
  return piece.flags & kContainsCentre;
}

template <class Keep>
AssembledPart count_slab(const Slab& slab, const Keep& keep) {
  AssembledPart result;
  for (const Piece& piece : slab.pieces) add_piece(piece.fill, keep(piece), result);
  return result;
}

template <class Keep>
AssembledPart count_volumes(const Voxels& voxels, const Keep& keep) {
  std::vector<AssembledPart> of_slab(voxels.slabs.size());
  parallel_for_each(
      of_slab.size(), [&](std::size_t s) { of_slab[s] = count_slab(voxels.slabs[s], keep); }, 2);
  AssembledPart result;
  for (const AssembledPart& slab : of_slab) {
    result.volume += slab.volume;
    result.dropped_volume += slab.dropped_volume;
    result.dropped_cells += slab.dropped_cells;
  }
  return result;
}

// Moved where `to` has nothing yet, as it is for the first part.
template <class Value>
void append(std::vector<Value>&& from, std::vector<Value>& to) {
  if (to.empty()) {
    to = std::move(from);
    return;
  }
  to.insert(to.end(), from.begin(), from.end());
}

// The row of voxels (j, k) and the number of its first piece.
struct Row {
  const Slab* slab = nullptr;
  std::uint32_t begin = 0, end = 0;
  std::size_t first = 0;
};
Row row_of(const Voxels& voxels, int j, int k) {
  const Slab* slab = voxels.slab(k);
  if (slab == nullptr || j < slab->j_begin || j >= slab->j_begin + slab->rows()) return {};
  return {slab, slab->row_begin[j - slab->j_begin], slab->row_begin[j - slab->j_begin + 1],
          voxels.first_piece[k - voxels.k_begin]};
}

// Calls visit(piece within slab) for the pieces of voxel i of a row.
template <class Visit>
void for_voxel(const Row& row, int i, const Visit& visit) {
  if (row.slab == nullptr) return;
  const auto begin = row.slab->pieces.begin() + row.begin, end = row.slab->pieces.begin() + row.end;
  auto at = std::lower_bound(begin, end, i, [](const Piece& piece, int value) { return piece.i < value; });
  for (; at != end && at->i == i; ++at) visit(static_cast<std::uint32_t>(at - row.slab->pieces.begin()));
}

// A piece and where it is.
struct PlacedPiece {
  int j = 0, k = 0;
  std::uint32_t piece = 0;  // within the slab
};

// Calls visit(neighbour) for every piece that meets `at` through a face.
template <class Visit>
void for_meeting(const Voxels& voxels, const PlacedPiece& at, const Visit& visit) {
  const Slab& slab = *voxels.slab(at.k);
  const int i = slab.pieces[at.piece].i;
  for (int axis = 0; axis < 3; ++axis)
    for (int step = -1; step <= 1; step += 2) {
      const int j = at.j + (axis == 1 ? step : 0), k = at.k + (axis == 2 ? step : 0);
      const Row row = row_of(voxels, j, k);
      for_voxel(row, i + (axis == 0 ? step : 0), [&](std::uint32_t other) {
        const bool meets = step > 0 ? meet(slab, at.piece, *row.slab, other, axis)
                                    : meet(*row.slab, other, slab, at.piece, axis);
        if (meets) visit(PlacedPiece{j, k, other});
      });
    }
}

// The kept piece with most fill within two steps through dropped pieces; kNoCell where there is none, kElsewhere where
// its cell is not here.
std::uint32_t substitute(const Voxels& voxels, const PlacedPiece& dropped,
                         const std::vector<std::uint32_t>& cell) {
  std::uint32_t best = kNoCell;
  double most = 0;
  std::vector<PlacedPiece> ring(1, dropped), next;
  for (int step = 0; step < 2 && best == kNoCell; ++step) {
    next.clear();
    for (const PlacedPiece& from : ring)
      for_meeting(voxels, from, [&](const PlacedPiece& other) {
        const Slab& slab = *voxels.slab(other.k);
        const std::uint32_t number = cell[voxels.first_piece[other.k - voxels.k_begin] + other.piece];
        if (number == kNoCell)
          next.push_back(other);
        else if (slab.pieces[other.piece].fill > most) {
          most = slab.pieces[other.piece].fill;
          best = number;
        }
      });
    ring = next;
  }
  return best;
}

// Pairs of one slab.
void trace_slab(const Voxels& voxels, std::size_t s, const std::vector<std::uint32_t>& cell,
                std::vector<PolygonCell>& pairs) {
  const Slab& slab = voxels.slabs[s];
  const int k = voxels.k_begin + static_cast<int>(s);
  std::uint32_t known = kNoCell, known_substitute = kNoCell;
  int j = slab.j_begin;
  for (const Trace& trace : slab.traces) {
    while (slab.row_begin[j - slab.j_begin + 1] <= trace.piece) ++j;
    std::uint32_t number = cell[voxels.first_piece[s] + trace.piece];
    if (number == kNoCell) {
      if (known != trace.piece) known_substitute = substitute(voxels, {j, k, trace.piece}, cell);
      known = trace.piece;
      number = known_substitute;
    }
    if (number != kNoCell && number != kElsewhere) pairs.push_back({trace.polygon, number});
  }
}

// Cells of the part: their elements, numbered within it so far, and their fills.
void append_cells(const Voxels& voxels, const KeptPieces& kept, std::uint32_t first_element,
                  std::vector<std::array<std::uint32_t, 8>>&& cell_elements, Body& body) {
  const std::size_t first_cell = body.cell_count(), cells = cell_elements.size();
  append(std::move(cell_elements), body.cell_elements);
  if (first_element > 0)
    parallel_for_each(cells, [&](std::size_t c) {
      for (std::uint32_t& element : body.cell_elements[first_cell + c]) element += first_element;
    });
  resize_touched(body.fill, first_cell + cells);
  resize_touched(body.broken, first_cell + cells);
  parallel_for_each(
      voxels.slabs.size(),
      [&](std::size_t s) {
        const std::uint32_t* cell = &kept.number[voxels.first_piece[s]];
        for (const Piece& piece : voxels.slabs[s].pieces) {
          if (*cell != kNoCell && *cell != kElsewhere) body.fill[*cell] = piece.fill;
          ++cell;
        }
      },
      2);
}

// Leaves out elements that no cell here has, and numbers the others over the whole lattice.
void drop_unused(LatticeElements& elements, PartSlice& slice) {
  std::vector<bool> used(elements.index.size(), false);
  for (const auto& of_piece : elements.of_piece)
    for (const std::uint32_t e : of_piece) used[e] = true;
  std::vector<std::uint32_t> number(elements.index.size(), kNoElement);
  std::vector<std::int64_t> next_point =
      slice.plane_point;  // elements of a plane are numbered in their order
  std::uint32_t next = 0;
  slice.points.reserve(slice.points.size() +
                       static_cast<std::size_t>(std::count(used.begin(), used.end(), true)));
  for (std::size_t e = 0; e < used.size(); ++e) {
    const auto plane = static_cast<std::size_t>(elements.index[e][slice.axis] - slice.first_plane);
    if (plane < next_point.size()) ++next_point[plane];
    if (!used[e]) continue;
    slice.points.push_back(next_point[plane] - 1);
    number[e] = next;
    elements.index[next] = elements.index[e];
    elements.number[next++] = elements.number[e];
  }
  elements.index.resize(next);
  elements.number.resize(next);
  for (auto& of_piece : elements.of_piece)
    for (std::uint32_t& e : of_piece) e = number[e];
}

AssembledPart assemble_corners(const Voxels& voxels, const Part& part, Body& body,
                               PolygonCells& polygon_cells, PartSlice* slice) {
  const auto first_element = static_cast<std::uint32_t>(body.element_count());
  const auto first_cell = static_cast<std::uint32_t>(body.cell_count());
  const auto keep = [&](const Piece& piece) { return has_cell(voxels, piece); };
  AssembledPart result = count_volumes(voxels, keep);
  KeptPieces kept = number_kept(voxels, keep, first_cell);
  if (slice != nullptr) leave_out(voxels, slice->held, first_cell, kept);
  result.cells = kept.count;
  LatticeElements elements = make_elements(voxels, kept.number, first_cell, kept.count);
  if (slice != nullptr) drop_unused(elements, *slice);
  result.elements = elements.index.size();
  append(std::move(elements.index), body.lattice_index);
  append(std::move(elements.number), body.piece);
  if (slice == nullptr) place_elements(part, body);
  append_cells(voxels, kept, first_element, std::move(elements.of_piece), body);
  const std::size_t first_list = polygon_cells.size();
  polygon_cells.resize(first_list + voxels.slabs.size());
  parallel_for_each(
      voxels.slabs.size(),
      [&](std::size_t s) {
        polygon_cells[first_list + s].reserve(voxels.slabs[s].traces.size());
        trace_slab(voxels, s, kept.number, polygon_cells[first_list + s]);
      },
      2);
  return result;
}

bool share_element(const std::array<std::uint32_t, 8>& a, const std::array<std::uint32_t, 8>& b) {
  for (const std::uint32_t e : a)
    if (e != kNoElement && std::find(b.begin(), b.end(), e) != b.end()) return true;
  return false;
}

AssembledPart assemble_centres(const Voxels& voxels, const Part& part, Body& body) {
  const LatticeElements corners = make_elements(voxels);
  const auto first = static_cast<std::uint32_t>(body.element_count());
  AssembledPart result = count_volumes(voxels, has_centre);
  const std::vector<std::uint32_t> number = number_kept(voxels, has_centre, first).number;
  std::vector<Index3> index;
  std::vector<std::uint32_t> connections;
  for (std::size_t s = 0; s < voxels.slabs.size(); ++s) {
    const Slab& slab = voxels.slabs[s];
    const int k = voxels.k_begin + static_cast<int>(s);
    for (int j = slab.j_begin; j < slab.j_begin + slab.rows(); ++j)
      for (std::uint32_t p = slab.row_begin[j - slab.j_begin]; p < slab.row_begin[j - slab.j_begin + 1];
           ++p) {
        const std::size_t global = voxels.first_piece[s] + p;
        if (number[global] == kNoCell) continue;
        index.push_back({slab.pieces[p].i, j, k});
        std::uint32_t bits = 0;
        for (std::uint32_t b = 0; b < half_neighbourhood.size(); ++b) {
          const Index3& d = half_neighbourhood[b];
          const Row row = row_of(voxels, j + d[1], k + d[2]);
          for_voxel(row, slab.pieces[p].i + d[0], [&](std::uint32_t other) {
            const std::size_t neighbour = row.first + other;
            if (number[neighbour] != kNoCell &&
                share_element(corners.of_piece[global], corners.of_piece[neighbour]))
              bits |= 1u << b;
          });
        }
        connections.push_back(bits);
      }
  }
  result.elements = index.size();
  result.dropped_cells = 0;  // what lies off the centres is no sliver: centre placement counts voxels
  result.volume = static_cast<double>(index.size());
  result.dropped_volume = 0;
  std::vector<std::uint16_t> pieces(index.size(), 0);
  append(std::move(index), body.lattice_index);
  append(std::move(pieces), body.piece);
  place_elements(part, body);
  body.connections.resize(first, 0);
  body.connections.insert(body.connections.end(), connections.begin(), connections.end());
  return result;
}

}  // namespace

void place_elements(const Part& part, Body& body) {
  const std::size_t first = body.rest.size(), all = body.lattice_index.size();
  const Vec3 shift = Vec3::Constant(part.placement == Placement::centre ? .5 : 0);
  resize_touched(body.rest, all);
  resize_touched(body.position, all);
  parallel_for_each(all - first, [&](std::size_t e) {
    const Index3& at = body.lattice_index[first + e];
    body.position[first + e] = body.rest[first + e] =
        part.lattice.to_world(Vec3(at[0], at[1], at[2]) + shift);
  });
}

void add_piece(double fill, bool kept, AssembledPart& found) {
  constexpr double kNothing = 1e-9;  // the rim of a face that lies on a lattice plane, no sliver
  if (kept)
    found.volume += fill;
  else if (std::abs(fill) > kNothing)
    found.dropped_volume += fill;
  found.cells += kept;
  found.dropped_cells += !kept && fill > kNothing;
}

AssembledPart assemble_part(const Voxels& voxels, const Part& part, Body& body, PolygonCells& polygon_cells,
                            PartSlice* slice) {
  Part placed = part;
  placed.element_begin = static_cast<std::uint32_t>(body.element_count());
  placed.cell_begin = static_cast<std::uint32_t>(body.cell_count());
  const AssembledPart result = part.placement == Placement::corner
                                   ? assemble_corners(voxels, part, body, polygon_cells, slice)
                                   : assemble_centres(voxels, part, body);
  placed.element_end = static_cast<std::uint32_t>(body.lattice_index.size());
  placed.cell_end = static_cast<std::uint32_t>(body.cell_count());
  body.parts.push_back(placed);
  return result;
}

void set_surface_cells(const PolygonCells& polygon_cells, std::size_t polygons, Body& body) {
  Buckets<std::uint32_t> cells = sort_into_buckets<std::uint32_t>(polygons, [&](const auto& use) {
    for (const std::vector<PolygonCell>& list : polygon_cells)
      for (const PolygonCell& pair : list) use(pair.polygon, pair.cell);
  });
  std::vector<std::uint32_t>& offsets = body.surface_cell_offsets;
  offsets.assign(polygons + 1, 0);
  parallel_for_each(polygons, [&](std::size_t p) {
    const auto begin = cells.values.begin() + cells.begin[p], end = cells.values.begin() + cells.begin[p + 1];
    std::sort(begin, end);
    offsets[p + 1] = static_cast<std::uint32_t>(std::unique(begin, end) - begin);
  });
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  body.surface_cells.clear();
  resize_touched(body.surface_cells, offsets.back());
  parallel_for_each(polygons, [&](std::size_t p) {
    std::copy_n(cells.values.begin() + cells.begin[p], offsets[p + 1] - offsets[p],
                body.surface_cells.begin() + offsets[p]);
  });
}

}  // namespace flexel::voxelize
