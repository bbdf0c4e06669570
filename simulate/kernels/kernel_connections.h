// Model `springs` where nothing flows or breaks: every connection once, eight side by side, its stiffness the
// sum of what the cells around it add (simulate/kernels/connection_runs.h); kernel_table.cpp has the formulas. A cell
// by itself would compute 28 springs, an edge of the lattice four times. Included by kernel_table.cpp alone.
//
// What a connection does to its second element is added up in columns of its own (kReaction), so that neither
// sum reads what was just written to an address beside its own: such a load waits until the store is done.
//
// Springs that flow or break remember, cell by cell, what they did (simulate/kernels/kernel_springs.h): 28
// values a cell, in the columns of the body file too. They are computed cell by cell for that.
#pragma once
#include "simulate/kernels/kernel_state.h"

namespace flexel::simulate::step {
namespace {

// Three columns under the numbers of the runs, from one of them on. One pointer and a distance: the loop over
// a run has more columns than the machine has registers.
struct Columns3 {
  double* x;
  std::size_t stride;
  FLEXEL_INLINE double* at(int c) const { return x + static_cast<std::size_t>(c) * stride; }
};

FLEXEL_INLINE Columns3 columns_of(const Scratch& scratch, Column first, std::size_t number) {
  return {scratch.column[first] - kLanes + number, scratch.stride};
}

FLEXEL_INLINE void add(const Columns3& to_a, const Columns3& to_b, std::size_t i, const Lanes& pull,
                       const Lanes* d) {
  for (int c = 0; c < 3; ++c) {
    const Lanes force = pull * d[c];
    store(to_a.at(c) + i, load(to_a.at(c) + i) + force);
    store(to_b.at(c) + i, load(to_b.at(c) + i) - force);
  }
}

// Adds the forces of a run. cells: around a connection.
template <int cells, bool some_lanes, Damping damping>
FLEXEL_INLINE void add_run(const ChunkView& chunk, const ConnectionRun& run, const Scratch& scratch,
                           Sums& sums) {
  const ConnectionKind kind = chunk.constants->connection[run.direction];
  const double tau = chunk.constants->damping;
  constexpr LaneBits bit = {1, 2, 4, 8, 16, 32, 64, 128};
  const Columns3 u_a = columns_of(scratch, kDisplacement, run.a),
                 u_b = columns_of(scratch, kDisplacement, run.b);
  const Columns3 v_a = columns_of(scratch, kVelocity, run.a), v_b = columns_of(scratch, kVelocity, run.b);
  const Columns3 force_a = columns_of(scratch, kForce, run.a),
                 force_b = columns_of(scratch, kReaction, run.b);
  const double* fills[cells];
  for (int n = 0; n < cells; ++n) fills[n] = chunk.cell_fill + run.cell[n];
  for (std::size_t i = 0; i < kLanes * run.blocks; i += kLanes) {
    Lanes fill = load(fills[0] + i);
    for (int n = 1; n < cells; ++n) fill += load(fills[n] + i);
    if constexpr (some_lanes) fill = (bit & run.lanes) != 0 ? fill : Lanes{};
    const LaneMask is_there = fill > 0;  // lanes without a connection may have any length, also none
    const Lanes stiffness = kind.stiffness * fill;
    Lanes d[3], off = {};
    for (int c = 0; c < 3; ++c) {
      const Lanes moved = load(u_b.at(c) + i) - load(u_a.at(c) + i);
      d[c] = kind.rest[c] + moved;
      off += moved * (kind.rest[c] + d[c]);
    }
    const Lanes square = kind.rest_square + off;
    const Lanes length = square_root(square);
    const Lanes both = square + kind.rest_length * length;  // length (length + rest length)
    Lanes pull;                                             // force on a along d, over |d|
    if constexpr (damping == Damping::none) {
      pull = stiffness * off / both;
    } else {
      Lanes along = {};
      for (int c = 0; c < 3; ++c) along += (load(v_b.at(c) + i) - load(v_a.at(c) + i)) * d[c];
      const Lanes inverse = 1 / (both * square);
      const Lanes viscous = stiffness * (tau * along * (both * inverse));
      pull = stiffness * (off * (square * inverse)) + viscous;
      if constexpr (damping == Damping::book) {
        const Lanes stretch = off / (length + kind.rest_length);
        sums.elastic += is_there ? 0.5 * stiffness * stretch * stretch : Lanes{};
        add(columns_of(scratch, kDampingForce, run.a), columns_of(scratch, kDampingReaction, run.b), i,
            is_there ? viscous : Lanes{}, d);
      }
    }
    add(force_a, force_b, i, is_there ? pull : Lanes{}, d);
  }
}

template <bool some_lanes, Damping damping>
FLEXEL_INLINE void add_run(const ChunkView& chunk, const ConnectionRun& run, const Scratch& scratch,
                           Sums& sums) {
  switch (chunk.constants->connection[run.direction].cells) {
    case 4:
      add_run<4, some_lanes, damping>(chunk, run, scratch, sums);
      break;
    case 2:
      add_run<2, some_lanes, damping>(chunk, run, scratch, sums);
      break;
    default:
      add_run<1, some_lanes, damping>(chunk, run, scratch, sums);
  }
}

struct ConnectionsModel {
  static constexpr bool by_connection = true;

  template <Damping damping>
  FLEXEL_INLINE static void add_forces(const ChunkView& chunk, const Scratch& scratch, Sums& sums) {
    constexpr bool velocities = damping != Damping::none, book = damping == Damping::book;
    const std::size_t end = (chunk.count + kLanes - 1) / kLanes * kLanes;
    for (std::size_t c = 0; c < kScratchColumns; ++c) {
      double* column = scratch.column[c] - kLanes;
      // what lies before and behind the elements is read, but for nothing; it has to be finite
      if (c < kVelocity || (velocities && c < kForce)) {
        __builtin_memset(column, 0, kLanes * sizeof(double));
        __builtin_memset(scratch.column[c] + chunk.count, 0, kLanes * sizeof(double));
      } else if (c < kDampingForce || (c >= kReaction && c < kDampingReaction) || book) {
        __builtin_memset(column, 0, (end + 2 * kLanes) * sizeof(double));
      }
    }
    for (std::size_t r = 0; r < chunk.run_count; ++r) {
      const ConnectionRun& run = chunk.runs[r];
      if (run.lanes == 0xff) {
        add_run<false, damping>(chunk, run, scratch, sums);
      } else {
        add_run<true, damping>(chunk, run, scratch, sums);
      }
    }
    Lanes told = Lanes{} + 1;
    for (std::size_t l = 0; l < end; l += kLanes)
      for (int c = 0; c < (book ? 6 : 3); ++c) {
        double* force = scratch.column[kForce + c] + l;
        const Lanes sum = load(force) + load(scratch.column[kReaction + c] + l);
        store(force, sum);
        told += 0 * sum;
      }
    // A length that is not a number makes the forces so.
    sums.smallest_jacobian = told;
  }
};

}  // namespace
}  // namespace flexel::simulate::step
