// What both models' loops share: the columns of a chunk's elements, and reading and adding at the corners of
// a block. Included by kernel_table.cpp alone.
#pragma once
#include "base/simd.h"
#include "simulate/kernels/kernel.h"

namespace flexel::simulate::step {
namespace {

using namespace simd;

struct Scratch {
  double* column[kScratchColumns];
  std::size_t stride;  // from a column to the next one
};

struct Corners {
  Lanes at[8][3];
};

enum Column {
  kDisplacement = 0,
  kVelocity = 3,
  kForce = 6,
  kDampingForce = 9,
  kReaction = 12,
  kDampingReaction = 15
};

FLEXEL_INLINE void read_corners(const ChunkView& chunk, const CellBlock& block, double* const* column,
                                Corners& corners) {
  const std::uint16_t* corner = chunk.corners + block.corners;
  if (block.is_run) {
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) corners.at[a][c] = load(column[c] + corner[a]);
  } else {
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) corners.at[a][c] = gather(column[c], corner + kLanes * a);
  }
}

FLEXEL_INLINE void add_to_corners(const ChunkView& chunk, const CellBlock& block, const Corners& corners,
                                  double* const* column) {
  const std::uint16_t* corner = chunk.corners + block.corners;
  if (block.is_run) {
    // Corner a + 1 of a cell is corner a of the next one: both are added in one go.
    constexpr LaneBits one_on = {0, 8, 9, 10, 11, 12, 13, 14};
    for (int a = 0; a < 8; a += 2)
      for (int c = 0; c < 3; ++c) {
        double* row = column[c] + corner[a];
        const Lanes& next = corners.at[a + 1][c];
        store(row, load(row) + (corners.at[a][c] + shuffle(Lanes{}, next, one_on)));
        row[8] += next[7];
      }
  } else {
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) scatter_add(column[c], corner + kLanes * a, corners.at[a][c]);
  }
}

// The yield stress [Pa] at the equivalent plastic strain, and its derivative.
struct FlowStress {
  Lanes stress, slope;
};

FLEXEL_INLINE FlowStress flow_stress(const CellConstants& k, const Lanes& plastic) {
  FlowStress flow{k.yield + k.hardening * plastic, Lanes{} + k.hardening};
  if (k.saturation > 0) {
    const Lanes left = exp_minus(k.rate * plastic);
    flow.stress += k.saturation * (1 - left);
    flow.slope += k.saturation * k.rate * left;
  }
  return flow;
}

// What the cells add up to while a chunk is computed.
struct Sums {
  Lanes smallest_jacobian = Lanes{} + __builtin_huge_val();
  Lanes elastic = {}, plastic_work = {}, released = {};  // J
  std::uint64_t broken = 0;
};

}  // namespace
}  // namespace flexel::simulate::step
