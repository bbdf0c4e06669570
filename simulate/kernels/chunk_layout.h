// How a body is cut up for stepping: chunks of cells in blocks of eight, or of the connections that they make
// in runs of eight (simulate/kernels/kernel.h), and which elements each chunk owns or shares with others.
// Depends on the body only, never on the number of threads, so that every sum has a fixed order.
//
// Cells are gathered tile by tile (up to 32 x 8 x 8 voxels, a row of a tile contiguous) until a chunk holds
// about kChunkCells; the small tiles of thin walls share a chunk. The state itself stays in the body's order.
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/conditions/kernel_effects.h"
#include "simulate/kernels/kernel.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// What edits made of the damping, strength and yield stress of a cell.
struct CellFactors {
  double damping = 1, strength = 1, yield = 1;
  auto operator<=>(const CellFactors&) const = default;
};

struct StepLayout {
  static constexpr std::size_t kChunkCells = 2048;

  struct Chunk {
    std::uint32_t part = 0, kind = 0;
    std::size_t block_begin = 0, block_end = 0;      // of `blocks`
    std::size_t corner_begin = 0;                    // of `corners`
    std::size_t run_begin = 0, run_end = 0;          // of `runs`
    std::size_t fill_begin = 0;                      // of `cell_fill`
    std::size_t element_begin = 0, element_end = 0;  // of `elements`
    std::size_t owned_begin = 0, owned_end = 0;      // of `owned`
    std::size_t shared_begin = 0, shared_end = 0;    // of `shared`, and the slots of the forces on them
  };

  std::vector<Chunk> chunks;
  std::vector<step::CellBlock> blocks;
  std::vector<std::uint16_t> corners;  // by chunk and block, numbers within the chunk
  // (blocks) cells of the lanes, kNoCell: none; empty where cells remember nothing (KernelEffects::remembers)
  std::vector<std::array<std::uint32_t, step::kLanes>> block_cells;
  // Parts of model `springs` in which nothing flows or breaks have no blocks, but runs.
  std::vector<step::ConnectionRun> runs;
  std::vector<double> cell_fill;
  std::vector<std::uint32_t> elements;       // by chunk, ascending
  std::vector<std::uint16_t> owned, shared;  // by chunk, numbers within it
  // (kinds) cells of a part with one damping time and one strength: as many a part as edits made different
  std::vector<step::CellConstants> constants;
  std::vector<std::uint32_t> kind_part;
  std::vector<CellFactors> kind_factors;

  // Elements of several chunks, ascending, and the slots of their forces (compressed rows, ascending).
  std::vector<std::uint32_t> shared_elements;
  std::vector<std::uint32_t> slot_offsets, slots;
  std::vector<std::uint32_t> lone_elements;  // that no active cell contains, ascending

  std::size_t largest_chunk = 0;  // elements

  static constexpr std::uint32_t kNoCell = 0xffffffff;
  [[nodiscard]] std::size_t bytes() const;
};

// Whether the connections of a part are computed one by one, instead of its cells.
[[nodiscard]] bool steps_by_connection(const Problem& problem, const KernelEffects& plan, std::size_t part);

// Of the cells that resist (simulate/models/cells.h).
[[nodiscard]] StepLayout step_layout(const Problem& problem, const KernelEffects& plan);

}  // namespace flexel::simulate
