// The matter of one part, voxel by voxel: the result of classification, from which elements and cells are
// made.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/math/vec.h"
#include "formats/lattice/cell_moments.h"

namespace flexel::voxelize {

// One connected piece of the part's matter inside one voxel. The pieces of a voxel follow each other.
struct Piece {
  double fill = 0;  // share of the voxel's volume
  std::int32_t i = 0;
  std::uint8_t corners = 0;  // bit a: contains corner a = di + 2 dj + 4 dk of the voxel
  std::uint8_t faces = 0;    // bit: its surface crosses face x-, x+, y-, y+, z-, z+ of the voxel
  std::uint8_t flags = 0;    // bits of PieceFlag
};
enum PieceFlag : std::uint8_t {
  kOneOfSeveral = 1,    // the voxel holds other pieces too
  kContainsCentre = 2,  // only set on request
};

// A polygon of the surface bounds this piece.
struct Trace {
  std::uint32_t polygon = 0;
  std::uint32_t piece = 0;  // within the slab
};

// A triangle bounds this piece, which is one of several in its voxel, and crosses these faces of the voxel
// (bits as Piece::faces).
struct SplitTrace {
  std::uint32_t piece = 0;  // within the slab
  std::uint32_t triangle = 0;
  std::uint8_t faces = 0;
};

// All voxels with k <= z < k + 1 that hold matter.
struct Slab {
  int j_begin = 0;                       // first row
  std::vector<std::uint32_t> row_begin;  // (rows + 1) row j owns pieces [row_begin[j - j_begin], ...)
  std::vector<Piece> pieces;             // by (j, i, piece)
  std::vector<Trace> traces;             // by piece
  std::vector<SplitTrace> split_traces;  // by (piece, triangle)
  std::vector<std::uint64_t> samples;    // (pieces) the 4x4x4 samples of the piece, bit x + 4 y + 16 z; only
      // where the surface is not closed and the pieces were made by sampling
  std::vector<std::uint32_t> moment_pieces;  // within the slab, ascending: those that have moments
  std::vector<CellMoments> moments;          // (moment_pieces) exact; only on request
  std::size_t split_voxels = 0, undecided_voxels = 0, overlapping_voxels = 0, disagreements = 0;
  [[nodiscard]] int rows() const { return row_begin.empty() ? 0 : static_cast<int>(row_begin.size()) - 1; }
  [[nodiscard]] std::span<const Piece> row(int j) const {
    if (j < j_begin || j >= j_begin + rows()) return {};
    return {pieces.data() + row_begin[j - j_begin], row_begin[j - j_begin + 1] - row_begin[j - j_begin]};
  }
};

// Pieces with less fill become no cells. With exact moments (model `quadratic`) a sliver does no harm, and leaving it
// out makes a slanted wall softer by up to .7 %.
constexpr double kDroppedFill = 1. / 64, kDroppedFillWithMoments = 1e-4;

struct Voxels {
  double dropped_fill = kDroppedFill;
  int k_begin = 0;
  std::vector<Slab> slabs;               // slab n holds k = k_begin + n
  std::vector<std::size_t> first_piece;  // (slabs + 1) number of pieces before the slab
  [[nodiscard]] std::size_t piece_count() const { return first_piece.empty() ? 0 : first_piece.back(); }
  [[nodiscard]] const Slab* slab(int k) const {
    return k < k_begin || k >= k_begin + static_cast<int>(slabs.size()) ? nullptr : &slabs[k - k_begin];
  }
};

// Voxels lower <= (i, j, k) < upper.
struct VoxelBox {
  Index3 lower{}, upper{};
  [[nodiscard]] bool holds(int i, int j, int k) const {
    return i >= lower[0] && i < upper[0] && j >= lower[1] && j < upper[1] && k >= lower[2] && k < upper[2];
  }
};

// Fills first_piece.
void number_pieces(Voxels& voxels);

// Leaves out the voxels outside lower <= (i, j, k) < upper.
void keep_box(Voxels& voxels, const Index3& lower, const Index3& upper);

// Whether piece `a` of slab `in_a` and piece `b` of slab `in_b` (numbers within their slabs) of the
// neighbouring voxel in direction +axis meet: matter continues from one to the other through the voxels'
// common face.
[[nodiscard]] bool meet(const Slab& in_a, std::uint32_t a, const Slab& in_b, std::uint32_t b, int axis);

}  // namespace flexel::voxelize
