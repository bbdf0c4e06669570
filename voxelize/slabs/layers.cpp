// Blocks of rows and slabs are classified by themselves, each with the row and the slab before it, and what they hold is
// counted.
#include "voxelize/slabs/layers.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/program/share_scope.h"
#include "base/stop.h"
#include "voxelize/classify/classify.h"
#include "voxelize/lattice/elements.h"

namespace flexel::voxelize {
namespace {

constexpr int kFar = 1 << 29;

// All voxels that the mesh reaches.
VoxelBox reach_of(const PartMesh& mesh) {
  Vec3 low = mesh.vertices.at(0), high = low;
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  VoxelBox box;
  for (int a = 0; a < 3; ++a) {
    box.lower[a] = static_cast<int>(std::floor(low[a])) - 1;
    box.upper[a] = static_cast<int>(std::floor(high[a])) + 2;
  }
  return box;
}

// Blocks of rows and slabs with about so many voxels, so that a part of any shape is counted in little memory.
constexpr int kBlockVoxels = 1 << 19, kBlockSlabs = 8;

class Surveyor {
 public:
  Surveyor(const HealedPart& part, double dropped_fill)
      : part_(part), dropped_fill_(dropped_fill), reach_(reach_of(part.mesh)) {
    PartLayers& layers = result_.layers;
    for (int a = 0; a < 3; ++a)
      if (length(a) >= length(layers.axis)) layers.axis = a;
    layers.first = reach_.lower[layers.axis];
    layers.cells.assign(static_cast<std::size_t>(length(layers.axis)), 0);
    layers.elements.assign(layers.cells.size() + 1, 0);
    std::uint32_t polygons = 0;
    for (const std::uint32_t p : part.original.polygon)
      if (p != kNoPolygon) polygons = std::max(polygons, p + 1);
    traced_.assign(polygons, 0);
  }

  Survey run() {
    const int rows = std::clamp(kBlockVoxels / (kBlockSlabs * length(0)), 8, length(1) + 1);
    const int blocks = (length(1) / rows + 1) * (length(2) / kBlockSlabs + 1);
    int done = 0;
    for (int k = reach_.lower[2]; k <= reach_.upper[2]; k += kBlockSlabs)
      for (int j = reach_.lower[1]; j <= reach_.upper[1]; j += rows) {
        check_stop();
        const ShareScope scope(static_cast<double>(done) / blocks, static_cast<double>(done + 1) / blocks);
        ++done;
        count({{-kFar, j, k}, {kFar, j + rows, k + kBlockSlabs}});
      }
    for (const std::uint32_t p : part_.original.polygon)
      if (p != kNoPolygon && !traced_[p]) result_.layers.missing.push_back(p);
    std::sort(result_.layers.missing.begin(), result_.layers.missing.end());
    trim();
    return std::move(result_);
  }

 private:
  [[nodiscard]] int length(int axis) const { return reach_.upper[axis] - reach_.lower[axis]; }

  // The elements at the block's lattice points need the rows and the slab before it too.
  void count(const VoxelBox& block) {
    VoxelBox box = block;
    --box.lower[1];
    --box.lower[2];
    Voxels voxels = classify_closed(part_.mesh, {.box = box, .counted = block});
    voxels.dropped_fill = dropped_fill_;
    for (std::size_t s = 0; s < voxels.slabs.size(); ++s)
      count_slab(voxels, voxels.slabs[s], block, voxels.k_begin + static_cast<int>(s));
    const LatticeElements elements = make_elements(voxels);
    for (const Index3& at : elements.index)
      if (block.holds(at[0], at[1], at[2])) {
        ++result_.layers.elements[place(at)];
        ++result_.found.elements;
      }
  }

  [[nodiscard]] std::size_t place(const Index3& at) const {
    return static_cast<std::size_t>(at[result_.layers.axis] - result_.layers.first);
  }

  void count_slab(const Voxels& voxels, const Slab& slab, const VoxelBox& block, int k) {
    result_.split_voxels += slab.split_voxels;
    result_.undecided_voxels += slab.undecided_voxels;
    result_.overlapping_voxels += slab.overlapping_voxels;
    for (const Trace& trace : slab.traces)
      if (trace.polygon < traced_.size()) traced_[trace.polygon] = 1;
    for (int j = slab.j_begin; j < slab.j_begin + slab.rows(); ++j)
      for (const Piece& piece : slab.row(j)) {
        if (!block.holds(piece.i, j, k)) continue;
        const bool kept = has_cell(voxels, piece);
        add_piece(piece.fill, kept, result_.found);
        result_.layers.cells[place({piece.i, j, k})] += kept;
      }
  }

  // Without the empty layers at either end.
  void trim() {
    PartLayers& layers = result_.layers;
    const auto full = [](std::size_t cells) { return cells > 0; };
    const auto begin = std::find_if(layers.cells.begin(), layers.cells.end(), full);
    const auto end = std::find_if(layers.cells.rbegin(), layers.cells.rend(), full).base();
    if (begin >= end) {
      layers.cells.clear();
      layers.elements.clear();
      return;
    }
    const auto before = begin - layers.cells.begin(), count = end - begin;
    layers.first += static_cast<int>(before);
    layers.cells = {begin, end};
    const auto planes = layers.elements.begin() + before;
    layers.elements = {planes, planes + count + 1};
  }

  const HealedPart& part_;
  double dropped_fill_;
  VoxelBox reach_;
  Survey result_;
  std::vector<std::uint8_t> traced_;  // (polygons)
};

}  // namespace

Survey survey_layers(const HealedPart& part, double dropped_fill) {
  return Surveyor(part, dropped_fill).run();
}

std::vector<std::size_t> cut_layers(const PartLayers& layers, std::size_t pieces) {
  const std::size_t n = layers.cells.size();
  std::vector<std::size_t> before(n + 1, 0),
      full(n + 1, 0);  // cells, and layers with cells, before each layer
  for (std::size_t l = 0; l < n; ++l) {
    before[l + 1] = before[l] + layers.cells[l];
    full[l + 1] = full[l] + (layers.cells[l] > 0);
  }
  if (full[n] < pieces) return {};
  std::vector<std::size_t> begin(1, 0);
  for (std::size_t r = 1; r < pieces; ++r) {
    const double wanted =
        static_cast<double>(before[n]) * static_cast<double>(r) / static_cast<double>(pieces);
    const auto miss = [&](std::size_t l) { return std::abs(static_cast<double>(before[l]) - wanted); };
    std::size_t best = n;
    for (std::size_t l = begin.back() + 1; l < n; ++l)
      if (full[l] > full[begin.back()] && full[n] - full[l] >= pieces - r &&
          (best == n || miss(l) < miss(best)))
        best = l;
    begin.push_back(best);
  }
  begin.push_back(n);
  return begin;
}

}  // namespace flexel::voxelize
