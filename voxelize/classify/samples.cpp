// Samples are packed 64 to a voxel and split into connected pieces by flooding bits.
#include "voxelize/classify/samples.h"

#include <bit>

#include "base/parallel.h"
#include "voxelize/classify/clip.h"

namespace flexel::voxelize {
namespace {

// The samples of a voxel that are connected with the lowest one set.
std::uint64_t lowest_component(std::uint64_t samples) {
  constexpr std::uint64_t kNotXLow = 0xeeeeeeeeeeeeeeeeu, kNotXHigh = 0x7777777777777777u;
  constexpr std::uint64_t kNotYLow = 0xfff0fff0fff0fff0u, kNotYHigh = 0x0fff0fff0fff0fffu;
  std::uint64_t component = samples & (~samples + 1), before = 0;
  while (component != before) {
    before = component;
    component |= (component << 1 & kNotXLow) | (component >> 1 & kNotXHigh) | (component << 4 & kNotYLow) |
                 (component >> 4 & kNotYHigh) | component << 16 | component >> 16;
    component &= samples;
  }
  return component;
}

Piece make_piece(std::uint64_t samples, int i, bool several) {
  Piece piece;
  piece.i = i;
  for (int a = 0; a < 8; ++a) {
    const int bit = 3 * (a & 1) + 12 * (a >> 1 & 1) + 48 * (a >> 2);
    piece.corners = static_cast<std::uint8_t>(piece.corners | (samples >> bit & 1) << a);
  }
  constexpr std::uint64_t kAroundCentre = 0x0000066006600000u;
  if (several) piece.flags |= kOneOfSeveral;
  if (std::popcount(samples & kAroundCentre) > 4) piece.flags |= kContainsCentre;
  return piece;
}

void build_slab(const Range& range, const SampleSource& source, int layer, Slab& slab) {
  slab.j_begin = range.begin[1];
  slab.row_begin.push_back(0);
  for (int j = 0; j < range.count[1]; ++j) {
    for (int i = 0; i < range.count[0]; ++i) {
      const VoxelSamples samples = source(i, j, layer);
      std::uint64_t inside = samples.inside;
      const bool several = inside != 0 && lowest_component(inside) != inside;
      const double share = samples.fill < 0 ? 1. / 64 : samples.fill / std::max(1, std::popcount(inside));
      slab.split_voxels += several;
      slab.disagreements += samples.differ;
      while (inside != 0) {
        const std::uint64_t component = lowest_component(inside);
        slab.pieces.push_back(make_piece(component, range.begin[0] + i, several));
        slab.pieces.back().fill = share * std::popcount(component);
        slab.samples.push_back(component);
        inside &= ~component;
      }
    }
    slab.row_begin.push_back(static_cast<std::uint32_t>(slab.pieces.size()));
  }
}

}  // namespace

Range voxel_range(const PartMesh& mesh) {
  const Box box = bounding_box(mesh.vertices);
  Range range;
  for (int a = 0; a < 3; ++a) {
    range.begin[a] = floor_int(box.min[a]);
    range.count[a] = floor_int(box.max[a]) - range.begin[a] + 1;
  }
  return range;
}

Voxels voxels_from_samples(const Range& range, const SampleSource& source) {
  Voxels voxels;
  voxels.k_begin = range.begin[2];
  voxels.slabs.resize(static_cast<std::size_t>(range.count[2]));
  parallel_for_each(
      voxels.slabs.size(),
      [&](std::size_t s) { build_slab(range, source, static_cast<int>(s), voxels.slabs[s]); }, 1);
  number_pieces(voxels);
  return voxels;
}

}  // namespace flexel::voxelize
