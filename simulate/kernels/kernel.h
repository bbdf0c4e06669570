// The hot loop of timed runs, as plain data: what one chunk of cells needs, what it gives back, and a table
// of the compiled variants. simulate/kernels/chunk_layout.h builds the chunks, simulate/kernels/kernel_table.cpp is the loop.
//
// kernel_table.cpp is compiled once per instruction set. Its code and everything that it includes must therefore
// stay out of the other translation units' way: no templates or inline functions of the standard library or
// of Eigen, whose copies the linker would be free to take from the wrong one. Hence raw pointers and arrays
// here.
#pragma once
#include <cstddef>
#include <cstdint>

#include "simulate/laws/law.h"

namespace flexel::simulate::step {

constexpr std::size_t kLanes = 8;  // cells that are computed side by side, on every instruction set

// Eight cells of a chunk. Lanes without a cell have fill 0 and corners 0.
struct CellBlock {
  double fill[kLanes];    // times what an edit made of it; 0: absent or broken, resists nothing
  std::uint32_t corners;  // place in ChunkView::corners, where there are (8 x kLanes) of the block's
  // 1: (8), those of lane 0: lane l has each of them l further on, as neighbours along a row do
  std::uint32_t is_run;
};

// Connections of one direction of the lattice, eight side by side (simulate/kernels/connection_runs.h). The
// first eight lead from elements a ... a + 7 to b ... b + 7, the next ones from a + 8 ..., all numbers of the
// chunk + kLanes. cell[0] ...: lowest corners of the cells around, 4 around an edge, 2 around a diagonal
// across a face, 1 around one through a cell.
struct ConnectionRun {
  std::uint16_t a, b, cell[4];
  std::uint16_t blocks;    // of eight
  std::uint8_t direction;  // of CellConstants::connection
  std::uint8_t lanes;      // bit l: lane l counts; all of them where there are several blocks
};

// What all connections of one direction have in common, lattice frame.
struct ConnectionKind {
  double rest[3], rest_square, rest_length;  // m, m^2
  double stiffness;                          // N/m, a cell's share
  int cells;                                 // around one
};

// What all cells of a part have in common. Lattice frame: axis j is column j of `axes`.
struct CellConstants {
  double spacing[3];  // m
  double volume;      // m^3
  double mu, lambda;  // Pa
  // Of sums Q = 8 q and per volume, over 64 V [Pa/m^2]: c_m of the modes xy, yz, zx, xyz (simulate/models/cell_model.h)
  double hourglass[4];
  // Likewise K: of the components z, x, y of xy, yz, zx; of each axis j the components of its neighbours k and l
  // of modes jk and lj: kk, kl, ll
  double twisting[3][3], bending[3][3];
  double spring[3];  // N/m, a cell's share of a spring along an edge, across a face, through the centre
  ConnectionKind connection[13];  // half_neighbourhood (formats/lattice/body.h)
  double damping;                 // s; 0 in the variants without damping
  double yield, hardening;        // Pa, J2 yield stress and its isotropic, linear hardening
  double saturation, rate;        // Pa, 1: of Voce's (simulate/conditions/kernel_effects.h)
  double strength, elongation;    // Pa, plastic strain: what breaks a cell; infinity: nothing
                                  // (springs: elongation is the strain of a spring)
  double axes[9];                 // column-major rotation from the lattice to the world frame
  bool aligned;                   // axes is the identity
  Law law;                        // lattice frame
};

// What the cells of a block remember of their plastic flow and of the shape that is their rest; model
// `cells`, lattice frame.
struct PlasticBlock {
  double flow[6][kLanes];          // Cp^-1 - I, Cp = Fp^T Fp: xx, yy, zz, xy, yz, zx
  double strain[kLanes];           // equivalent plastic strain
  double hourglass[4][3][kLanes];  // m, plastic part of the hourglass displacements, drawn back by F
  double volume[kLanes];           // Jp - 1, Jp = det Fp: the rest shape's volume over the voxel's
};

// What they remember of their springs, a bit or a row each, a < b in the order (0, 1), (0, 2), ... (6, 7);
// model `springs`.
constexpr std::uint64_t kAllSprings = (std::uint64_t{1} << 28) - 1;
struct SpringBlock {
  std::uint64_t broken[kLanes];
};
struct SpringFlow {
  double flowed[28][kLanes];  // m, change of the rest length
  double strain[28][kLanes];  // sum of its absolute changes, over the rest length
};

// A set of cells that one thread computes at a time, and the elements at their corners. Elements that no
// other chunk touches are advanced with it; the forces on the others go to `shared_force`.
struct ChunkView {
  CellBlock* blocks;             // fracture sets the fill of cells that break to 0
  const std::uint16_t* corners;  // elements, numbered within the chunk
  PlasticBlock* plastic;         // (block_count); null in the variants without plasticity
  SpringBlock* springs;          // (block_count); null but with fracture of springs
  SpringFlow* spring_flow;       // (block_count); null but with plasticity of springs
  std::size_t block_count;
  const ConnectionRun* runs;  // in place of blocks where connections are computed one by one
  std::size_t run_count;
  const double* cell_fill;        // by element that is a cell's lowest corner, + kLanes; 0: no cell
  const std::uint32_t* elements;  // (count) numbers of the body, ascending
  std::size_t count;
  const std::uint16_t *owned, *shared;  // numbers within the chunk, ascending
  std::size_t owned_count, shared_count;
  double* shared_force;    // (shared_count x 3) N, world frame
  double* shared_damping;  // the same of the damping alone, with `book`
  const CellConstants* constants;
};

// The whole state in the body's order, world frame, (n x 3) row by row.
struct StateView {
  double* displacement;        // m
  double* velocity;            // m/s
  const double* outer;         // N, forces of the effects; null: none
  const double* inverse_mass;  // (n) 1/kg; 0: does not move by force
  double* damping_force;       // N, out: that of the damping alone on the owned elements, with `book`
};

// One advance: v += kick f / m, then u += drift v (the new one, or the old one for explicit Euler).
struct Advance {
  double kick, drift;  // s
  bool explicit_drift;
};

struct ChunkOutcome {
  // over the chunk's cells, at the state before the advance; NaN counts as -infinity
  double smallest_jacobian;
  // with fracture or plasticity, and of connections: elastic energy of the cells [J], as the forces took it;
  // what this step dissipated [J]; all of them `book`
  double elastic, plastic_work, released;
  std::uint64_t broken;  // cells that broke in this step
};

// Doubles of a column of scratch of a chunk with `count` elements: kLanes before them and as many behind.
[[nodiscard]] constexpr std::size_t scratch_stride(std::size_t count) {
  return (count + 3 * kLanes - 1) / kLanes * kLanes;
}
constexpr std::size_t kScratchColumns = 18;  // u, v, f, damping force, and the latter two of connections
constexpr std::size_t kScratchAlignment = 64;

using ChunkKernel = ChunkOutcome (*)(const ChunkView&, const StateView&, const Advance&, double* scratch);

// `book`: account for the power of the damping (simulate/time/energy_history.h).
enum class Damping { none, plain, book };

// What a variant of the kernel has in it.
struct Composition {
  Damping damping = Damping::none;
  bool plasticity = false, fracture = false;
};
constexpr std::size_t kVariants = 12;
[[nodiscard]] constexpr std::size_t variant_number(const Composition& c) {
  return static_cast<std::size_t>(c.damping) + 3 * (std::size_t{c.plasticity} + 2 * std::size_t{c.fracture});
}

struct KernelTable {
  const char* isa;
  ChunkKernel cells[kVariants];  // by variant_number
  ChunkKernel springs[kVariants];
};

// The table of an instruction set; that of this machine's best one.
[[nodiscard]] const KernelTable& kernels_portable();
[[nodiscard]] const KernelTable& kernels_avx2();
[[nodiscard]] const KernelTable& kernels_avx512();

}  // namespace flexel::simulate::step
