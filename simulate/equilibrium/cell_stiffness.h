// The tangent stiffness of a body all of whose matter is of model `cells`, without storing it: products cell
// by cell, eight side by side (simulate/kernels/kernel_product.h), and rows of blocks made when the hierarchy
// asks for them. What effects add (ties, bonds) is stored in a small matrix beside it.
//
// Memory: 0, 216 or 808 bytes a cell (at rest; deformed; projected moduli) beside the pattern, where the
// blocks of a stored matrix take 1,944 an element.
#pragma once
#include "simulate/conditions/constraints.h"
#include "simulate/effects/effect.h"
#include "simulate/kernels/chunk_layout.h"
#include "simulate/kernels/kernel_product.h"
#include "simulate/linear/operator.h"
#include "simulate/models/cells.h"
#include "simulate/models/paper_model.h"

namespace flexel::simulate {

class CellStiffness final : public LinearOperator {
 public:
  // Whether every cell is of model `cells` at the lattice's rest shape.
  [[nodiscard]] static bool fits(const Problem& problem, const PaperModel& paper);

  // Keeps references to the problem's body and to `pattern`, whose matrix needs no values.
  CellStiffness(const Problem& problem, const StiffnessPattern& pattern,
                const std::vector<ActiveEffect>& effects);

  // What the cells make of a state, by the kernels of timed runs: J, only where it is asked for; the smallest J of a
  // cell, not above 0 where a corner is folded too. Forces [N] are added to `forces`, unless that is null.
  struct Evaluation {
    double energy = 0, smallest = 1;
  };
  [[nodiscard]] Evaluation evaluate(const State& state, bool energy, std::vector<Vec3>* forces);

  // Takes up the cells' tangents at `state`, nothing added and nothing eliminated.
  void linearise(const State& state, const TangentOptions& tangent);
  // kg/s^2 (elements), that resist every motion of the elements; empty: none. Stays until it is given again.
  // From then on the diagonal of the cells is kept from one stiffness of effects to the next.
  void set_inertia(std::vector<double> inertia) {
    inertia_ = std::move(inertia);
    keeps_diagonal_ = true;
  }
  // What effects add to has changed.
  void renew_pattern_of(const std::vector<ActiveEffect>& effects);
  // What effects add: rows and columns of the elements that they pull at, and of their neighbours. Zero after
  // linearise().
  [[nodiscard]] BlockMatrix& added() {
    adding_.reset();
    return added_;
  }
  // As eliminate() of simulate/conditions/constraints.h does.
  void eliminate_prescribed(const Constraints& constraints);

  [[nodiscard]] std::span<const std::uint64_t> row_offsets() const override {
    return pattern_.matrix.row_offsets;
  }
  [[nodiscard]] std::span<const std::uint32_t> columns() const override { return pattern_.matrix.columns; }
  void multiply(const double* x, double* y) const override;
  [[nodiscard]] const Block* blocks(std::size_t begin, std::size_t end,
                                    std::vector<Block>& room) const override;
  [[nodiscard]] std::vector<Block> diagonal() const override;

 private:
  // What the cells of a part have in common, lattice frame but for `at_rest`.
  struct PartKind {
    CellKind kind;
    CellKind turned;  // the same in the world's frame
    Mat3 axes;
    std::array<Block, 64> at_rest;  // blocks (a, b) of a whole cell at rest, world frame [N/m]
  };

  // A cell near folding (simulate/models/corner_barrier.h): blocks of its barrier, its share taken in.
  struct Folding {
    std::uint32_t cell = 0;
    FoldTangent blocks;
  };

  void find_folding(const State& state, bool project);
  [[nodiscard]] const FoldTangent* folding_of(std::uint32_t cell) const;
  void prepare_lane(std::uint32_t cell, const State& state, const TangentOptions& tangent, double* to) const;
  // The blocks of `added_` that are not zero: less than half, where a face lies on a plane of the lattice.
  struct Adding {
    std::vector<std::uint32_t> rows;     // those with some
    std::vector<std::uint64_t> offsets;  // (rows + 1)
    std::vector<std::uint32_t> columns;
    std::vector<Block> values;
  };

  void prepare_kernels();
  void add_corners(const State& state, Evaluation& made, std::vector<Vec3>* forces) const;
  [[nodiscard]] Evaluation run_kernels(bool energy);
  void products_of_cells(const double* x, double* y) const;
  [[nodiscard]] Adding adding() const;
  // Blocks (a, b) of a cell for b in [begin, end), a its corner at the element, into out[b]; deformed ones in
  // the lattice's frame.
  void cell_blocks(const Incidence& at, std::size_t begin, std::size_t end, Block* out) const;
  // The columns of a cell that is not at rest, kLanes apart.
  [[nodiscard]] const double* tangent_of(std::uint32_t cell) const;
  void mean_blocks(const CellKind& kind, const double* from, double share, std::size_t a, std::size_t begin,
                   std::size_t end, Block* out) const;
  void deformed_diagonal(std::uint32_t cell, std::array<Block, 8>& out) const;
  void set_deformed_diagonals(std::vector<Block>& diagonal) const;
  [[nodiscard]] Block diagonal_of_cells(std::size_t element) const;
  [[nodiscard]] std::vector<Block> diagonals_of_cells() const;
  void add_others(std::size_t element, Block& own) const;
  void turn(std::size_t element, Block* block, std::size_t count) const;
  void add_effects(std::size_t element, Block* row) const;
  void eliminate_row(std::size_t element, Block* row) const;

  const Body& body_;
  const StiffnessPattern& pattern_;
  StepLayout layout_;
  const step::ProductTable* kernels_;
  std::vector<PartKind> kinds_;       // (parts)
  std::vector<std::uint8_t> active_;  // (cells) 1: resists
  std::vector<std::uint32_t> part_;   // (cells)
  std::vector<double> share_;         // (cells) of the stiffness of a whole cell of its material
  std::vector<std::uint32_t> place_;  // (cells) block x kLanes + lane
  bool by_moduli_ = false;            // a part has another law than neo-Hooke's
  step::TangentForm form_ = step::TangentForm::at_rest;
  std::vector<double> tangents_;  // by block: columns of kLanes
  std::vector<Folding> folding_;  // ascending
  bool keeps_diagonal_ = false;
  mutable std::vector<Block> cells_diagonal_;  // (elements) of the cells alone; empty: to be made
  struct Work {
    const step::KernelTable* kernels = nullptr;
    std::vector<double> ones;                     // (elements)
    std::vector<Vec3> places, pulls;              // (elements) m, N
    std::vector<double> damping, shared_damping;  // N, of the books, which come with the energy
  } work_;                                        // of evaluate()
  std::vector<double> inertia_;                   // (elements) or empty
  BlockMatrix added_;
  mutable std::optional<Adding> adding_;               // made by the first product
  std::vector<std::uint8_t> mask_;                     // (elements) prescribed components; empty: none
  std::vector<std::uint32_t> held_;                    // elements with some
  std::vector<Vec3> held_diagonal_;                    // (held) diagonal entries that stay [N/m]
  mutable std::vector<double> shared_force_, masked_;  // work of a product
};

}  // namespace flexel::simulate
