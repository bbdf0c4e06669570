// A slab is classified with some layers more on either side: whether pieces of matter are joined, and which cell stands in
// under a polygon whose own was dropped, depends on at most four. Nothing in a lattice depends on what is farther: a part
// in several fragments keeps them all.
#include "voxelize/slabs/slab_body.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/human.h"
#include "voxelize/classify/assign_polygons.h"
#include "voxelize/classify/classify.h"
#include "voxelize/lattice/assemble_moments.h"

namespace flexel::voxelize {
namespace {

constexpr int kFar = 1 << 29, kMoreLayers = 4;

VoxelBox layers_of(const PartLayers& layers, int begin, int end) {
  VoxelBox box{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};
  box.lower[layers.axis] = layers.first + begin;
  box.upper[layers.axis] = layers.first + end;
  return box;
}

VoxelBox widened(VoxelBox box, int axis, int layers) {
  box.lower[axis] -= layers;
  box.upper[axis] += layers;
  return box;
}

}  // namespace

SlabBodies::SlabBodies(std::vector<SlabPart> parts, std::size_t pieces, std::size_t polygons, bool moments)
    : parts_(std::move(parts)), polygons_(polygons), moments_(moments) {
  for (const SlabPart& each : parts_) {
    cut_.push_back(cut_layers(*each.layers, pieces));
    if (!cut_.back().empty()) continue;
    const auto full = std::count_if(each.layers->cells.begin(), each.layers->cells.end(),
                                    [](std::size_t cells) { return cells > 0; });
    throw InputError(
        fmt::format("--pieces {}: part \"{}\" has {} along its longest axis, and a piece takes one at "
                    "least: --pieces {}, or a smaller size",
                    pieces, each.part.name, counted(static_cast<std::size_t>(full), "layer"), full));
  }
  number_points(pieces);
}

// Piece by piece, part by part, plane by plane: a piece owns the planes above its layers, the first that below too.
void SlabBodies::number_points(std::size_t pieces) {
  for (const SlabPart& each : parts_) plane_point_.emplace_back(each.layers->elements.size(), 0);
  first_point_.assign(1, 0);
  std::int64_t next = 0;
  for (std::size_t r = 0; r < pieces; ++r) {
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (std::size_t plane = r == 0 ? 0 : cut_[p][r] + 1; plane <= cut_[p][r + 1]; ++plane) {
        plane_point_[p][plane] = next;
        next += static_cast<std::int64_t>(parts_[p].layers->elements[plane]);
      }
    first_point_.push_back(next);
  }
}

std::size_t SlabBodies::own_cells(std::uint32_t index) const {
  std::size_t cells = 0;
  for (std::size_t p = 0; p < parts_.size(); ++p)
    for (std::size_t layer = cut_[p][index]; layer < cut_[p][index + 1]; ++layer)
      cells += parts_[p].layers->cells[layer];
  return cells;
}

void SlabBodies::add_part(std::size_t p, std::uint32_t index, PieceBody& piece, PolygonCells& polygon_cells,
                          std::size_t& spread) const {
  const SlabPart& each = parts_[p];
  const PartLayers& layers = *each.layers;
  const int begin = static_cast<int>(cut_[p][index]), end = static_cast<int>(cut_[p][index + 1]);
  PartSlice slice{layers_of(layers, begin - 1, end + 1),
                  layers_of(layers, begin, end),
                  layers.axis,
                  layers.first,
                  plane_point_[p],
                  std::move(piece.global_point)};
  Body& body = piece.body;
  {
    Voxels voxels = classify_closed(
        each.healed->mesh, {.with_moments = moments_, .box = widened(slice.held, layers.axis, kMoreLayers)});
    if (moments_) voxels.dropped_fill = kDroppedFillWithMoments;
    if (!layers.missing.empty()) trace_polygons(each.healed->original, layers.missing, voxels);
    (void)assemble_part(voxels, each.part, body, polygon_cells, &slice);
    if (moments_) spread = append_moments(voxels, body, &slice);
  }
  place_elements(each.part, body);
  piece.global_point = std::move(slice.points);
  const Part& placed = body.parts.back();
  piece.ghost_cells.reserve(placed.cell_end);
  for (std::uint32_t c = placed.cell_begin; c < placed.cell_end; ++c) {
    const int layer = body.lattice_index[body.cell_elements[c][0]][layers.axis] - layers.first;
    piece.ghost_cells.push_back(layer < begin || layer >= end);
  }
}

PieceBody SlabBodies::make(std::uint32_t index, std::vector<std::size_t>& spread) const {
  PieceBody piece;
  piece.numbers.index = index;
  piece.numbers.first_point = first_point_;
  PolygonCells polygon_cells;
  spread.assign(parts_.size(), 0);
  for (std::size_t p = 0; p < parts_.size(); ++p) add_part(p, index, piece, polygon_cells, spread[p]);
  set_surface_cells(polygon_cells, polygons_, piece.body);
  derive_connections(piece.body);
  piece.body.notes["piece"] = fmt::format("{} of {}", index, piece.numbers.count());
  return piece;
}

}  // namespace flexel::voxelize
