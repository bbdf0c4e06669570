// What one rank has of a body: the cells of a slab, and what acts on their elements.
#pragma once
#include <petscsys.h>

#include <vector>

#include "base/files/files.h"
#include "formats/lattice/body.h"
#include "simulate/linear/block_matrix.h"

namespace flexel::distributed {

// A block of stiffness that effects add between two elements of one cell [N/m].
struct AddedBlock {
  std::uint32_t row = 0, column = 0;  // elements of the piece
  std::array<double, 9> value = {};   // row by row
};

struct Piece {
  Body body;  // cells that resist, each of one piece only, and their elements; no surface
  std::vector<std::uint32_t> cell;  // (cells) numbers in the whole body
  std::vector<PetscInt> number;     // (elements) of their unknowns, by threes, over all ranks
  PetscInt owned = 0;               // elements whose unknowns are this rank's: the lowest that has them
  std::vector<std::uint8_t> mask;   // (elements) bit i: axis i is prescribed
  std::vector<AddedBlock> added;
};

[[nodiscard]] Bytes pack(Piece& piece);
[[nodiscard]] Piece unpack_piece(const Bytes& bytes);

// Who has what of a body.
struct Partition {
  std::vector<std::int32_t> rank;  // (cells) -1: resists nothing
  std::vector<PetscInt> number;    // (elements) -1: of no cell that resists
  std::vector<PetscInt> owned;     // (ranks)
};

// Slabs of the cells with active[cell] != 0, at least one a rank, along the body's longest side: equally many, but fewer for rank 0,
// which holds the body besides.
[[nodiscard]] Partition partition(const Body& body, const std::vector<std::uint8_t>& active, int ranks);

// The piece of a rank. `mask` (elements of the body). `added`: symmetric; throws std::logic_error where it couples elements of no
// common cell.
[[nodiscard]] Piece cut_piece(const Body& body, const Partition& partition, int rank,
                              const std::vector<std::uint8_t>& mask, const simulate::BlockMatrix& added);

}  // namespace flexel::distributed
