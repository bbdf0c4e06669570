// Bodies in pieces (formats/pieces): what their mapping needs of them.
#pragma once
#include <string>

#include "formats/lattice/body.h"
#include "mapping/report/quality.h"

namespace flexel::mapping {

// Whether the name is that of a list of pieces (.pvtu).
[[nodiscard]] bool names_pieces(const std::string& path);

// What of a body in pieces its surface's mapping depends on, which is read piece by piece.
struct NearBody {
  Body body;             // the cells near the surface
  LatticeVolume volume;  // of all cells
};
// Throws InputError: as read_piece(), or a cell is broken.
[[nodiscard]] NearBody read_near_surface(const std::string& list);

}  // namespace flexel::mapping
