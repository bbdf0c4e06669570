// Two pieces meet through a face when a corner of the face belongs to both, or when one triangle that crosses
// the face bounds both. That is exact: each connected patch of matter on the face either has a triangle on
// its rim or covers the whole face.
#include "voxelize/classify/voxels.h"

#include <algorithm>
#include <limits>

namespace flexel::voxelize {
namespace {

// Corners of a voxel on its high face along each axis; shifting right by 2^axis gives their numbers in the
// neighbour.
constexpr std::uint8_t kHighCorners[3] = {0b10101010, 0b11001100, 0b11110000};

std::span<const SplitTrace> traces_of(const Slab& slab, std::uint32_t piece) {
  const auto [first, last] =
      std::equal_range(slab.split_traces.begin(), slab.split_traces.end(), SplitTrace{.piece = piece},
                       [](const SplitTrace& a, const SplitTrace& b) { return a.piece < b.piece; });
  return {first, last};
}

// One triangle bounds both pieces and crosses the face between them.
bool share_triangle(const Slab& in_a, std::uint32_t a, const Slab& in_b, std::uint32_t b, int axis) {
  const auto of_a = traces_of(in_a, a), of_b = traces_of(in_b, b);
  for (auto p = of_a.begin(), q = of_b.begin(); p != of_a.end() && q != of_b.end();) {
    if (p->triangle < q->triangle)
      ++p;
    else if (q->triangle < p->triangle)
      ++q;
    else {
      if (p->faces >> (2 * axis + 1) & q->faces >> (2 * axis) & 1) return true;
      ++p;
      ++q;
    }
  }
  return false;
}

// Samples of a piece on its high face along each axis, and how far they move to lie on the neighbour's low
// face.
constexpr std::uint64_t kHighSamples[3] = {0x8888888888888888u, 0xf000f000f000f000u, 0xffff000000000000u};
constexpr int kSampleShift[3] = {3, 12, 48};

constexpr std::uint32_t kLeftOut = std::numeric_limits<std::uint32_t>::max();

// What of a slab lies in a box; `number` (pieces): theirs in what is kept, or kLeftOut.
Slab rows_in_box(const Slab& slab, const Index3& lower, const Index3& upper,
                 std::vector<std::uint32_t>& number) {
  Slab kept;
  number.assign(slab.pieces.size(), kLeftOut);
  const int begin = std::max(slab.j_begin, lower[1]), end = std::min(slab.j_begin + slab.rows(), upper[1]);
  if (begin >= end) return kept;
  kept.j_begin = begin;
  kept.row_begin.push_back(0);
  for (int j = begin; j < end; ++j) {
    for (std::uint32_t p = slab.row_begin[j - slab.j_begin]; p < slab.row_begin[j - slab.j_begin + 1]; ++p) {
      if (slab.pieces[p].i < lower[0] || slab.pieces[p].i >= upper[0]) continue;
      number[p] = static_cast<std::uint32_t>(kept.pieces.size());
      kept.pieces.push_back(slab.pieces[p]);
      if (!slab.samples.empty()) kept.samples.push_back(slab.samples[p]);
    }
    kept.row_begin.push_back(static_cast<std::uint32_t>(kept.pieces.size()));
  }
  return kept;
}

Slab slab_in_box(const Slab& slab, const Index3& lower, const Index3& upper) {
  std::vector<std::uint32_t> number;
  Slab kept = rows_in_box(slab, lower, upper, number);
  for (const Trace& each : slab.traces)
    if (number[each.piece] != kLeftOut) kept.traces.push_back({each.polygon, number[each.piece]});
  for (const SplitTrace& each : slab.split_traces)
    if (number[each.piece] != kLeftOut)
      kept.split_traces.push_back({number[each.piece], each.triangle, each.faces});
  for (std::size_t m = 0; m < slab.moment_pieces.size(); ++m)
    if (number[slab.moment_pieces[m]] != kLeftOut) {
      kept.moment_pieces.push_back(number[slab.moment_pieces[m]]);
      kept.moments.push_back(slab.moments[m]);
    }
  return kept;
}

}  // namespace

void number_pieces(Voxels& voxels) {
  voxels.first_piece.assign(1, 0);
  for (const Slab& slab : voxels.slabs)
    voxels.first_piece.push_back(voxels.first_piece.back() + slab.pieces.size());
}

void keep_box(Voxels& voxels, const Index3& lower, const Index3& upper) {
  const int begin = std::max(voxels.k_begin, lower[2]),
            end = std::min(voxels.k_begin + static_cast<int>(voxels.slabs.size()), upper[2]);
  std::vector<Slab> kept;
  for (int k = begin; k < end; ++k)
    kept.push_back(slab_in_box(voxels.slabs[k - voxels.k_begin], lower, upper));
  voxels.k_begin = begin;
  voxels.slabs = std::move(kept);
  number_pieces(voxels);
}

bool meet(const Slab& in_a, std::uint32_t a, const Slab& in_b, std::uint32_t b, int axis) {
  if (!in_a.samples.empty())
    return (in_a.samples[a] & kHighSamples[axis]) >> kSampleShift[axis] & in_b.samples[b];
  const Piece &p = in_a.pieces[a], &q = in_b.pieces[b];
  if ((p.corners & kHighCorners[axis]) >> (1 << axis) & q.corners) return true;
  if (!(p.faces >> (2 * axis + 1) & q.faces >> (2 * axis) & 1)) return false;
  if (p.flags & q.flags & kOneOfSeveral) return share_triangle(in_a, a, in_b, b, axis);
  return true;
}

}  // namespace flexel::voxelize
