// The tangent of one cell of model `cells`, prepared for its blocks (simulate/models/cell_model.h).
#pragma once
#include <memory>

#include "simulate/models/corner_barrier.h"

namespace flexel::simulate {

// d2U/du du of the hourglass energy by K. With the weights v_ma = w_ma - gamma_a . arm_m / 4, w_a = F^-T gamma_a
// and r_a = sum_m v_ma force_m,
//     K_ab = J pull^T [sum_mn v_ma v_nb K_mn] pull + 1/4 (w_a r_b^T - r_b w_a^T + r_a w_b^T - w_b r_a^T)
//            + U / 16 (w_a w_b^T - w_b w_a^T).
// The first term is positive.
struct HourglassTangent {
  Mat3 inverse_transpose = Mat3::Identity();  // F^-T
  double jacobian = 1;
  Mat3 pull;
  std::array<Vec3, 3> arm, force;  // m, N; forces and energy 0 where the tangent is projected
  double energy = 0;               // J
};
[[nodiscard]] HourglassTangent hourglass_tangent(const CellKind& kind, const CellVectors& displacement,
                                                 bool project);
// out[b] += factor K_ab for b from `begin` to `end`.
void add_hourglass_row(const CellKind& kind, const HourglassTangent& tangent, double factor, std::size_t a,
                       std::size_t begin, std::size_t end, Block* out);
// out[b] += factor K_bb for all eight.
void add_hourglass_diagonal(const CellKind& kind, const HourglassTangent& tangent, double factor, Block* out);

// Row by row, of any law at rest.
[[nodiscard]] std::array<Block, 64> blocks_at_rest(const CellKind& kind);

// What the rows need of a cell: its tangent, or where that is projected or of another law than neo-Hooke's the
// moduli.
struct PreparedCell {
  CellTangent tangent;
  HourglassTangent hourglass;
  double coupling = 0;                 // mu - lambda ln J [Pa]
  std::unique_ptr<Mat9> moduli;        // in place of all others but `folding`; always of laws but neo-Hooke's
  std::unique_ptr<Mat3> added_stress;  // to that of the state in the geometric stiffness [Pa]
  std::unique_ptr<FoldTangent> folding;
};

// Of a cell whose elements moved by `displacement` [m]. `stress`: that of the geometric stiffness in place of the state's,
// second Piola-Kirchhoff [Pa]; null: the state's. `project`: to the positive part.
[[nodiscard]] PreparedCell prepare_cell(const CellKind& kind, const CellVectors& displacement, bool project,
                                        const Mat3* stress);

// The same of its mean as moduli, of any law.
[[nodiscard]] Mat9 prepare_moduli(const CellKind& kind, const Mat3& gradient, bool project,
                                  const Mat3* stress);

}  // namespace flexel::simulate
