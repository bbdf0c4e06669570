// The cells of a body: every unbroken one resists by its part's model, simulate/models/cell_model.h or
// simulate/models/spring_model.h, with what keeps corners from folding (simulate/models/corner_barrier.h), from its own rest
// shape where it has one (simulate/models/rest_shape.h), scaled by its fill and what an edit made of its stiffness.
#pragma once
#include <optional>

#include "simulate/models/corner_barrier.h"
#include "simulate/models/rest_shape.h"
#include "simulate/models/spring_model.h"
#include "simulate/models/stiffness.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// Smallest J over the cells, and where.
struct SmallestJacobian {
  double value = 1;
  std::uint32_t cell = 0;
  std::uint32_t corner = 0;  // of the cell, where it is that of a corner
};

// The largest share of its length that a chain of Arruda and Boyce's law is drawn to, and where; 0: there are none.
struct DrawnChains {
  double share = 0;
  std::uint32_t cell = 0;
};

// How the tangent is taken.
struct TangentOptions {
  bool project = false;  // positive semi-definite, cell by cell
  // (cells) the stresses of the geometric stiffness, in place of those of the state; null: those of the state
  const std::vector<Mat3>* stress = nullptr;
};

class Cells {
 public:
  // Keeps references to the problem's body, its columns and to `stencil`.
  Cells(const Problem& problem, const Stencil& stencil);

  [[nodiscard]] const std::vector<std::uint8_t>& active() const { return active_; }
  [[nodiscard]] const CellKind& kind(std::uint32_t part) const { return kinds_[part]; }
  // From here on free strain acts in proportion to State::share, or whole.
  void grow_free_strain(bool grows) { grows_ = grows; }

  // Elastic energy [J]; infinity where a cell has J <= 0, or chains longer than they are.
  [[nodiscard]] double energy(const State& state) const;
  // Adds the forces of the cells on their elements [N].
  void add_forces(const State& state, std::vector<Vec3>& forces);
  // Sets (not adds) every value of `matrix`. With `tangent.project`, cells with an indefinite tangent get its
  // positive part.
  void set_stiffness(const State& state, const TangentOptions& tangent, BlockMatrix& matrix);
  // Second Piola-Kirchhoff stress [Pa] (cells) that the linear model at `state` predicts for `state` moved by
  // `step` [m].
  [[nodiscard]] std::vector<Mat3> predicted_stress(const State& state, const std::vector<Vec3>& step) const;
  [[nodiscard]] SmallestJacobian smallest_jacobian(const State& state) const;
  // Of the trilinear map at the corners of the cells.
  [[nodiscard]] SmallestJacobian smallest_corner_jacobian(const State& state) const;
  [[nodiscard]] DrawnChains drawn_chains(const State& state) const;

 private:
  // What keeps the corners of a cell that moves by `displacement` [m] from folding; 0 or nothing elsewhere.
  [[nodiscard]] bool may_fold(std::uint32_t cell, const CellVectors& displacement) const;
  [[nodiscard]] CornerThresholds thresholds(std::uint32_t cell, const State& state) const;
  [[nodiscard]] CellVectors corner_values(std::uint32_t cell, const std::vector<Vec3>& values) const;
  [[nodiscard]] std::optional<CellKind> own_kind(std::uint32_t cell, const State& state) const;
  // Calls visit(kind) with what the cell is: a CellKind or a SpringKind.
  template <class Visit>
  auto with_kind(std::uint32_t cell, const State& state, const Visit& visit) const;

  const Body& body_;
  const Stencil& stencil_;
  std::vector<std::uint8_t> active_;                // (cells) 1: resists
  std::vector<std::uint32_t> part_;                 // (cells)
  std::vector<CellKind> kinds_;                     // (parts)
  std::vector<std::optional<SpringKind>> springs_;  // (parts) of model springs
  RestShapes rest_shapes_;
  bool grows_ = false;                     // free strain, with the share of the load
  std::vector<double> share_;              // (cells) of the stiffness of a whole cell of its material
  std::vector<CellVectors> corner_force_;  // (cells) scratch: forces of a cell on its elements
};

// That chains are near their end, "; near ..."; empty where they are not.
[[nodiscard]] std::string said_of_chains(const DrawnChains& drawn, const Body& body);

// Cells that hold matter together: not broken, not stray.
[[nodiscard]] std::vector<std::uint8_t> sound_cells(const Problem& problem);
// Those of them that resist: not of a rigid part.
[[nodiscard]] std::vector<std::uint8_t> active_cells(const Problem& problem);

}  // namespace flexel::simulate
