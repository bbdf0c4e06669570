// Two pieces meet through a face when a corner of the face belongs to both, or when one triangle that crosses
// the face bounds both. That is exact: each connected patch of matter on the face either has a triangle on
// its rim or covers the whole face.
#include "voxelize/classify/voxels.h"

#include <algorithm>

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

}  // namespace

void number_pieces(Voxels& voxels) {
  voxels.first_piece.assign(1, 0);
  for (const Slab& slab : voxels.slabs)
    voxels.first_piece.push_back(voxels.first_piece.back() + slab.pieces.size());
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
