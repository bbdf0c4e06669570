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

}  // namespace flexel
