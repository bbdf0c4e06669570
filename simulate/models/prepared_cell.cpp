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

using CarriedModes = std::array<std::array<double, 8>, 3>;

CarriedModes carried_modes(const CellKind& kind, const HourglassTangent& tangent) {
  CarriedModes weight;
  for (std::size_t m = 0; m < 3; ++m)
    for (std::size_t b = 0; b < 8; ++b) weight[m][b] = carried_mode(kind, tangent.arm[m], m, b);
  return weight;
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

HourglassTangent hourglass_tangent(const CellKind& kind, const CellVectors& u, bool project) {
  const Mat3 gradient = displacement_gradient(kind, u);
  const HourglassForces forces = hourglass_forces(kind, gradient, hourglass_displacements(kind, u));
  HourglassTangent tangent{forces.inverse_transpose,
                           1 + volume_change(gradient),
                           forces.pull,
                           forces.arm,
                           forces.force,
                           forces.energy};
  if (project) tangent.force.fill(Vec3::Zero());
  if (project) tangent.energy = 0;
  return tangent;
}

void add_hourglass_row(const CellKind& kind, const HourglassTangent& tangent, double factor, std::size_t a,
                       std::size_t begin, std::size_t end, Block* out) {
  const CarriedModes weight = carried_modes(kind, tangent);
  std::array<Mat3, 3> row;
  for (int n = 0; n < 3; ++n) {
    Mat3 sum = Mat3::Zero();
    for (int m = 0; m < 3; ++m)
      sum += weight[static_cast<std::size_t>(m)][a] * kind.by_mode.block<3, 3>(3 * m, 3 * n);
    row[static_cast<std::size_t>(n)] =
        (factor * tangent.jacobian) * tangent.pull.transpose() * sum * tangent.pull;
  }
  const auto force_at = [&](std::size_t b) -> Vec3 {
    return weight[0][b] * tangent.force[0] + weight[1][b] * tangent.force[1] +
           weight[2][b] * tangent.force[2];
  };
  const Vec3 w_a = tangent.inverse_transpose * (0.25 * factor * kind.gradient[a]);
  // What w_b meets on its right, times the factor: r_a and the energy's share.
  const Vec3 with = 0.25 * (factor * force_at(a) + tangent.energy * w_a);
  for (std::size_t b = begin; b < end; ++b) {
    const Vec3 w_b = tangent.inverse_transpose * kind.gradient[b], r_b = force_at(b);
    for (std::size_t n = 0; n < 3; ++n) out[b] += weight[n][b] * row[n];
    out[b] += with * w_b.transpose() - w_b * with.transpose() + w_a * r_b.transpose() - r_b * w_a.transpose();
  }
}

// The terms with r_b and w_b of a row cancel where a = b.
void add_hourglass_diagonal(const CellKind& kind, const HourglassTangent& tangent, double factor,
                            Block* out) {
  const CarriedModes weight = carried_modes(kind, tangent);
  const Mat3 left = (factor * tangent.jacobian) * tangent.pull.transpose();
  for (std::size_t m = 0; m < 3; ++m)
    for (std::size_t n = m; n < 3; ++n) {
      const Mat3 half =
          left *
          kind.by_mode.block<3, 3>(3 * static_cast<Eigen::Index>(m), 3 * static_cast<Eigen::Index>(n)) *
          tangent.pull;
      const Mat3 both = m == n ? half : Mat3(half + half.transpose());
      for (std::size_t b = 0; b < 8; ++b) out[b] += (weight[m][b] * weight[n][b]) * both;
    }
}

std::array<Block, 64> blocks_at_rest(const CellKind& kind) {
  std::array<Block, 64> blocks;
  HourglassTangent rest;
  rest.pull = kind.to_lattice;
  rest.arm.fill(Vec3::Zero());
  rest.force.fill(Vec3::Zero());
  const bool neo_hooke = kind.law.name == LawName::neo_hooke;
  const Mat9 moduli = neo_hooke ? Mat9(Mat9::Zero()) : elasticity(kind, Mat3(Mat3::Zero()));
  for (std::size_t a = 0; a < 8; ++a) {
    for (std::size_t b = 0; b < 8; ++b)
      blocks[8 * a + b] = neo_hooke ? tangent_block(kind, {}, a, b) : projected_block(kind, moduli, a, b);
    add_hourglass_row(kind, rest, 1, a, 0, 8, &blocks[8 * a]);
  }
  return blocks;
}

PreparedCell prepare_cell(const CellKind& kind, const CellVectors& u, bool project, const Mat3* stress) {
  PreparedCell cell;
  const Mat3 gradient = displacement_gradient(kind, u);
  cell.hourglass = hourglass_tangent(kind, u, project);
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
