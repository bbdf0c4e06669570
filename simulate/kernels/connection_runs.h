// The connections of a chunk's cells, each one once, in runs of eight side by side for the hot loop
// (simulate/kernels/kernel_connections.h).
//
// A run takes one direction of the lattice and leads from elements a, a + 1, ... to b, b + 1, ..., numbers of
// the chunk. Its connections' stiffness is not stored: it is the sum of what the cells around them add, by
// their fills, and those lie in one array under the numbers of the cells' lowest corners, where the cells
// around a run are runs too. Where the lattice is cut off nothing needs to be told apart: no cell begins
// there, and the fill under such a number is 0. So a solid takes a few bytes an element, and an irregular
// body more runs, shorter ones.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "simulate/kernels/kernel.h"

namespace flexel::simulate {

struct ConnectionRuns {
  std::vector<step::ConnectionRun> runs;
  std::vector<double> fill;  // by element of the chunk, the lowest corner of the cell, + kLanes; 0: none
};

// Cells by their corners, numbers of a chunk's `count` elements (65527 at most), and their fills. No two may
// have the same lowest corner.
[[nodiscard]] ConnectionRuns connection_runs(std::span<const std::array<std::uint16_t, 8>> cells,
                                             std::span<const double> fill, std::size_t count);

}  // namespace flexel::simulate
