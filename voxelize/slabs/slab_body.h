// The bodies of a lattice's slabs, one after another.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/pieces/pieces.h"
#include "voxelize/slabs/layers.h"

namespace flexel::voxelize {

// A closed part, placed on its lattice. Both must outlive what uses it.
struct SlabPart {
  Part part;  // without ranges
  const HealedPart* healed = nullptr;
  const PartLayers* layers = nullptr;
};

class SlabBodies {
 public:
  // `polygons`: of the surface. Throws InputError naming a part that has fewer layers with cells than `pieces`.
  SlabBodies(std::vector<SlabPart> parts, std::size_t pieces, std::size_t polygons, bool moments);

  // The piece, but for its run. Cells, elements and what belongs to them are to the bit those of the whole lattice; bits of
  // connections are those of the cells that the piece holds. `spread`: (parts) set to the own cells whose moments are those
  // of matter spread evenly.
  [[nodiscard]] PieceBody make(std::uint32_t index, std::vector<std::size_t>& spread) const;
  // Cells of its own.
  [[nodiscard]] std::size_t own_cells(std::uint32_t index) const;
  // (parts x (pieces + 1)) where the layers of each piece begin.
  [[nodiscard]] const std::vector<std::vector<std::size_t>>& cuts() const { return cut_; }

 private:
  void number_points(std::size_t pieces);
  void add_part(std::size_t p, std::uint32_t index, PieceBody& piece, PolygonCells& polygon_cells,
                std::size_t& spread) const;

  std::vector<SlabPart> parts_;
  std::size_t polygons_;
  bool moments_;
  std::vector<std::vector<std::size_t>> cut_;
  std::vector<std::vector<std::int64_t>> plane_point_;  // (parts x planes) number of the plane's first point
  std::vector<std::int64_t> first_point_;               // (pieces + 1)
};

}  // namespace flexel::voxelize
