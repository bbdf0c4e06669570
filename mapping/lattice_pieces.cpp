// The volume of the lattice is summed while the pieces go by.
#include "mapping/lattice_pieces.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/files/files.h"
#include "formats/pieces/join.h"
#include "mapping/anchors/blend_weights.h"
#include "mapping/anchors/search.h"

namespace flexel::mapping {
namespace {

// A vertex is carried by the elements a few connections from the cell under it; the motion of each by the frame found
// around it. One cell more, for vertices under whose polygons there is no cell: the nearest element is theirs.
constexpr int kCells = std::max(kBlendSteps, kSmoothSteps) + kRings + 1;

}  // namespace

bool names_pieces(const std::string& path) {
  return extension(path) == "pvtu";
}

NearBody read_near_surface(const std::string& list) {
  NearBody near;
  const auto see = [&](const PieceBody& piece) {
    const std::vector<std::uint8_t>& broken = piece.body.broken;
    if (std::any_of(broken.begin(), broken.end(), [](std::uint8_t b) { return b != 0; }))
      throw InputError(list,
                       fmt::format("its piece {} has broken cells, and cracks need the whole body: simulate "
                                   "it without --pieces",
                                   piece.numbers.index));
    const LatticeVolume own = lattice_volume(piece.body, piece.ghost_cells);
    near.volume.before += own.before;
    near.volume.after += own.after;
  };
  near.body = join_pieces(read_piece_list(list), NearSurface{kCells}, see);
  return near;
}

}  // namespace flexel::mapping
