// Cuts triangles into the voxels they pass through.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "base/math/vec.h"

namespace flexel::voxelize {

// What bounds a side of a clipped polygon: one of the triangle's three edges or one of the voxel's six
// planes. Bits of Record::sides.
enum Side : std::uint16_t {
  kTriangleEdge0 = 1,
  kTriangleEdges = 7,
  kXLow = 8,
  kXHigh = 16,
  kYLow = 32,
  kYHigh = 64,
  kZLow = 128,
  kZHigh = 256,
};
constexpr int kFirstPlaneBit = 3;

// One triangle inside one voxel (i, j, k), k being that of the slab.
struct Record {
  double volume = 0;  // its share of the voxel's fill; see clip.cpp
  std::int32_t i = 0, j = 0;
  std::uint32_t triangle = 0;
  std::uint16_t sides = 0;  // bits of Side: where the clipped polygon is bounded
  // Change of winding number along seven edges of the voxel, two bits each; see winding_change
  std::uint16_t windings = 0;
};

// The edges of a voxel that form a tree from its lowest corner (i, j, k) to the other seven.
enum VoxelEdge : int {
  kAlongX,
  kAlongYAtXLow,
  kAlongYAtXHigh,
  kAlongZ00,
  kAlongZ10,
  kAlongZ01,
  kAlongZ11,
  kVoxelEdges
};

// Change of the winding number along `edge` in its positive direction where the record's triangle crosses it:
// -1, 0, 1.
[[nodiscard]] inline int winding_change(const Record& record, int edge) {
  return static_cast<int>((record.windings >> (2 * edge)) & 3u) -
         ((record.windings >> (2 * edge)) & 2u ? 4 : 0);
}

// A convex polygon in lattice coordinates; side[v] bounds it between corner v and v + 1.
struct Polygon {
  static constexpr int kCapacity = 32;
  int count = 0;
  std::array<std::array<double, 3>, kCapacity> corner;
  std::array<std::uint16_t, kCapacity> side;
  void add(const std::array<double, 3>& point, std::uint16_t bit) {
    if (count == kCapacity) return;
    corner[count] = point;
    side[count++] = bit;
  }
};

using TrianglePoints = std::array<const Vec3*, 3>;  // lattice coordinates

// Appends one record for each voxel of slab k (k <= z < k + 1) that the triangle passes through.
void clip_to_slab(const TrianglePoints& points, std::uint32_t triangle, int k, std::vector<Record>& records);

// Of a slab the voxels i_begin <= i < i_end of rows j_begin <= j < j_begin + left.size().
struct SlabWindow {
  int i_begin = 0, i_end = 0, j_begin = 0;
  std::vector<int>
      left;  // (rows) change of the winding number along the row's lattice line up to x = i_begin
};
// Likewise, for those voxels alone; what the triangle does to the lattice lines before them is added to `window.left`.
void clip_to_window(const TrianglePoints& points, std::uint32_t triangle, int k, SlabWindow& window,
                    std::vector<Record>& records);

// The part of the triangle inside voxel (i, j, k).
[[nodiscard]] Polygon clip_to_voxel(const TrianglePoints& points, int i, int j, int k);

// Largest whole number not above x, for |x| < 2^31.
[[nodiscard]] inline int floor_int(double x) {
  const int n = static_cast<int>(x);
  return n - (x < n);
}

}  // namespace flexel::voxelize
