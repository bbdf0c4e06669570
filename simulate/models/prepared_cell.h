// The tangent of one cell of model `cells`, prepared for its blocks (simulate/models/cell_model.h).
#pragma once
#include <memory>

#include "simulate/models/corner_barrier.h"

namespace flexel::simulate {

// What the rows need of a cell: its tangent, or where that is projected or of another law than neo-Hooke's the
// moduli.
struct PreparedCell {
  CellTangent tangent;
  double coupling = 0;                 // mu - lambda ln J [Pa]
  std::unique_ptr<Mat9> moduli;        // in place of all others but `folding`; always of laws but neo-Hooke's
  std::unique_ptr<Mat3> added_stress;  // to that of the state in the geometric stiffness [Pa]
  std::unique_ptr<FoldTangent> folding;
};

// Of a cell with displacement gradient H. `stress`: that of the geometric stiffness in place of the state's,
// second Piola-Kirchhoff [Pa]; null: the state's. `project`: to the positive part.
[[nodiscard]] PreparedCell prepare_cell(const CellKind& kind, const Mat3& gradient, bool project,
                                        const Mat3* stress);

// The same as moduli, of any law.
[[nodiscard]] Mat9 prepare_moduli(const CellKind& kind, const Mat3& gradient, bool project,
                                  const Mat3* stress);

}  // namespace flexel::simulate
