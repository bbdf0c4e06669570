// Model `cells` over a body: every unbroken cell resists by simulate/cell_model.h, scaled by its fill.
#pragma once
#include "simulate/cell_model.h"
#include "simulate/state.h"
#include "simulate/stiffness.h"

namespace flexel {

// Smallest J over the cells, and where.
struct SmallestJacobian {
  double value = 1;
  std::uint32_t cell = 0;
};

class Cells {
 public:
  // Keeps references to the setting's body and to `stencil`.
  Cells(const Setting& setting, const Stencil& stencil);

  [[nodiscard]] const std::vector<std::uint8_t>& active() const { return active_; }
  [[nodiscard]] const CellKind& kind(std::uint32_t part) const { return kinds_[part]; }

  // Elastic energy [J]; infinity where a cell has J <= 0.
  [[nodiscard]] double energy(const State& state) const;
  // Adds the forces of the cells on their elements [N].
  void add_forces(const State& state, std::vector<Vec3>& forces);
  // Sets (not adds) every value of `matrix`. With `project`, cells with an indefinite material tangent get
  // its positive part.
  void set_stiffness(const State& state, bool project, BlockMatrix& matrix);
  [[nodiscard]] SmallestJacobian smallest_jacobian(const State& state) const;

 private:
  [[nodiscard]] CellVectors displacement_of(std::uint32_t cell, const State& state) const;

  const Body& body_;
  const Stencil& stencil_;
  std::vector<std::uint8_t> active_;       // (cells) 1: resists
  std::vector<std::uint32_t> part_;        // (cells)
  std::vector<CellKind> kinds_;            // (parts)
  std::vector<CellVectors> corner_force_;  // (cells) scratch: forces of a cell on its elements
};

// Cells that resist: not broken, not stray.
[[nodiscard]] std::vector<std::uint8_t> active_cells(const Setting& setting);

}  // namespace flexel
