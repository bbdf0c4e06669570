// The tangent of one cell. The material's part is positive unless mu < lambda ln J; what can be negative
// besides is the geometric part, by the stresses.
#include "simulate/models/prepared_cell.h"
#include "base/math/eigenvalues.h"

namespace flexel::simulate {
namespace {

Mat3 positive_part(const Mat3& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(0.5 * (symmetric + symmetric.transpose())));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

Mat9 prepare_moduli(const CellKind& kind, const Mat3& gradient, bool project, const Mat3* stress) {
  Mat9 moduli = elasticity(kind, gradient);
  const auto add_geometric = [&](const Mat3& s, double factor) {  // delta_ik S_jl
    for (int i = 0; i < 3; ++i) moduli.block<3, 3>(3 * i, 3 * i) += factor * s;
  };
  if (stress) add_geometric(second_stress(kind, gradient), -1);
  if (project) moduli = positive_part(moduli);
  if (stress) add_geometric(project ? positive_part(*stress) : *stress, 1);
  return moduli;
}

PreparedCell prepare_cell(const CellKind& kind, const Mat3& gradient, bool project, const Mat3* stress) {
  PreparedCell cell;
  if (kind.law.name != LawName::neo_hooke) {
    cell.moduli = std::make_unique<Mat9>(prepare_moduli(kind, gradient, project, stress));
    return cell;
  }
  cell.tangent = cell_tangent(gradient);
  cell.coupling = kind.mu - kind.lambda * cell.tangent.log_volume;
  if (stress) {
    Mat3 added = (project ? positive_part(*stress) : *stress) - second_stress(kind, gradient);
    if (project && cell.coupling < 0) {
      // The material's part stays positive without its shear.
      added -= cell.coupling * cell.tangent.inverse_transpose.transpose() * cell.tangent.inverse_transpose;
      cell.coupling = 0;
    }
    cell.added_stress = std::make_unique<Mat3>(added);
  } else if (project) {
    cell.moduli = std::make_unique<Mat9>(projected_elasticity(kind, cell.tangent));
  }
  return cell;
}

}  // namespace flexel::simulate
