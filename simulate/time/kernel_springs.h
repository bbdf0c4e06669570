// Model `springs`, eight cells at a time; kernel.cpp has the formulas. Included by kernel.cpp alone.
#pragma once
#include "simulate/time/kernel_state.h"

namespace flexel::step {
namespace {

struct SpringsModel {
  template <Composition has>
  FLEXEL_INLINE static void add_block(const ChunkView& chunk, std::size_t number, const Advance&,
                                      const Scratch& scratch, Sums& sums) {
    constexpr Damping damping = has.damping;
    const CellBlock& block = chunk.blocks[number];
    const CellConstants& k = *chunk.constants;
    const Lanes fill = load(block.fill);
    Corners u, v, force = {}, damped = {};
    read_corners(block, scratch.column + kDisplacement, u);
    if constexpr (damping != Damping::none) read_corners(block, scratch.column + kVelocity, v);
#pragma GCC unroll 8
    for (int a = 0; a < 8; ++a)
#pragma GCC unroll 8
      for (int b = a + 1; b < 8; ++b) {
        const int kind = __builtin_popcount(static_cast<unsigned>(a ^ b)) - 1;
        Lanes d[3], off = {}, square = {};
        double rest_square = 0;
        for (int c = 0; c < 3; ++c) {
          const double rest = (((b >> c) & 1) - ((a >> c) & 1)) * k.spacing[c];
          const Lanes moved = u.at[b][c] - u.at[a][c];
          d[c] = rest + moved;
          off += moved * (2 * rest + moved);  // d^2 - l^2
          square += d[c] * d[c];
          rest_square += rest * rest;
        }
        const double rest_length = __builtin_sqrt(rest_square);
        const Lanes length = square_root(square);
        const Lanes both = length * (length + rest_length);
        const Lanes stiffness = k.spring[kind] * fill;
        Lanes pull;  // force on a along d, over |d|
        if constexpr (damping == Damping::none) {
          pull = stiffness * off / both;
        } else {
          Lanes along = {};
          for (int c = 0; c < 3; ++c) along += (v.at[b][c] - v.at[a][c]) * d[c];
          const Lanes inverse = 1 / (both * square);
          const Lanes viscous = stiffness * (k.damping * along * (both * inverse));
          pull = stiffness * (off * (square * inverse)) + viscous;
          if constexpr (damping == Damping::book)
            for (int c = 0; c < 3; ++c) {
              damped.at[a][c] += viscous * d[c];
              damped.at[b][c] -= viscous * d[c];
            }
        }
        for (int c = 0; c < 3; ++c) {
          force.at[a][c] += pull * d[c];
          force.at[b][c] -= pull * d[c];
        }
      }
    // A length that is not a number makes the forces so; the first one tells.
    const Lanes told = fill > 0 ? 1 + 0 * force.at[0][0] : Lanes{} + __builtin_huge_val();
    sums.smallest_jacobian = told >= sums.smallest_jacobian ? sums.smallest_jacobian : told;
    if constexpr (damping == Damping::book) add_to_corners(block, damped, scratch.column + kDampingForce);
    add_to_corners(block, force, scratch.column + kForce);
  }
};

}  // namespace
}  // namespace flexel::step
