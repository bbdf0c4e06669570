// Pieces put together again: all of their cells, or those near the surface.
#pragma once
#include <functional>
#include <optional>

#include "formats/pieces/pieces.h"

namespace flexel {

// Cells near the surface: those that lie under a polygon, and what is at most so many cells from one along each axis.
struct NearSurface {
  int cells = 0;
};

// One body of the own cells of all pieces, read one after another; with `near`, twice, and of those cells alone. What it
// holds is to the bit that of the whole body: order, surface, cells under polygons, moments, columns. `see`, where given,
// gets each piece before it goes. Throws InputError as read_piece does; or a piece has other parts or columns than the first.
[[nodiscard]] Body join_pieces(const PieceFiles& files, const std::optional<NearSurface>& near = std::nullopt,
                               const std::function<void(const PieceBody& piece)>& see = {});

// What one process holds of a body in pieces: their own cells, and those of two layers around.
struct PiecesAround {
  Body body;                         // in the order of every body
  std::vector<std::int64_t> point;   // (elements) number over all pieces
  std::vector<std::uint32_t> piece;  // (cells) whose own they are
  // (cells) 0: of the pieces asked for; 1: shares an element with such a cell; 2: with one of those, or is a ghost of theirs all the same
  std::vector<std::uint8_t> ring;
  std::vector<std::int64_t> first_point;  // PieceNumbers::first_point
};

// The pieces from `first` to `end` - 1. Reads them and the two beside them, one after another. Throws InputError as join_pieces does.
[[nodiscard]] PiecesAround join_around(const PieceFiles& files, std::uint32_t first, std::uint32_t end);

}  // namespace flexel
