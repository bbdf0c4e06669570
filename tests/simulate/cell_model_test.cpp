// Model `cells`, one cell: invariance, patch test, and every derivative against differences on random input.
#include "simulate/models/cell_model.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <random>

#include "base/math/eigenvalues.h"

namespace flexel::simulate {
namespace {

Material rubbery(double poisson) {
  return {"m", 12.1e5, poisson, 580, ""};
}

Lattice turned_lattice() {
  Lattice lattice;
  lattice.axes =
      (Eigen::AngleAxisd(0.5, Vec3::UnitX()) * Eigen::AngleAxisd(0.4, Vec3::UnitY())).toRotationMatrix();
  lattice.spacing = Vec3(0.1, 0.115, 0.093);
  return lattice;
}

std::array<Vec3, 8> corners(const Lattice& lattice) {
  std::array<Vec3, 8> x;
  for (int a = 0; a < 8; ++a) x[a] = lattice.to_world(Vec3(a & 1, a >> 1 & 1, a >> 2));
  return x;
}

class Random {
 public:
  double operator()() { return uniform_(engine_); }
  CellVectors displacement(double size) {
    CellVectors u;
    for (Vec3& each : u) each = size * Vec3((*this)(), (*this)(), (*this)());
    return u;
  }

 private:
  std::mt19937 engine_{7};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

CellVectors affine_displacements(const Lattice& lattice, const Mat3& gradient, const Vec3& shift) {
  CellVectors u;
  const auto x = corners(lattice);
  for (int a = 0; a < 8; ++a) u[a] = gradient * x[a] + shift;
  return u;
}

TEST(CellModel, RigidRotationHasNoEnergyAndNoForce) {
  const Lattice lattice = turned_lattice();
  const CellKind kind = cell_kind(lattice, rubbery(0.3));
  const Mat3 rotation = Eigen::AngleAxisd(2.1, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const CellVectors u = affine_displacements(lattice, rotation - Mat3::Identity(), Vec3(3, -2, 1));
  const double stiff = 12.1e5 * kind.volume;
  EXPECT_LT(cell_energy(kind, u), 1e-25 * stiff);
  for (const Vec3& force : cell_forces(kind, u)) EXPECT_LT(force.norm(), 1e-12 * 12.1e5 * 0.01);
}

TEST(CellModel, SmallStrainKeepsItsDigits) {
  const Lattice lattice = turned_lattice();
  const CellKind kind = cell_kind(lattice, rubbery(0.3));
  Random random;
  const CellVectors shape = random.displacement(1);
  const auto scaled = [&](double size) {
    CellVectors u = shape;
    for (Vec3& each : u) each *= size;
    return cell_energy(kind, u) / (size * size);
  };
  // Quadratic in the strain: the same ratio at 1e-7 and at 1e-12 of the shape, but for terms of relative size
  // 1e-6.
  EXPECT_NEAR(scaled(1e-12) / scaled(1e-8), 1, 1e-6);
}

TEST(CellModel, UniaxialStressGivesYoungAndPoisson) {
  for (const double poisson : {-0.3, 0.0, 0.25, 0.3, 0.45}) {
    const Material material = rubbery(poisson);
    const CellKind kind = cell_kind(turned_lattice(), material);
    const double strain = 1e-8;
    Mat3 h = Mat3::Zero();
    h.diagonal() = Vec3(strain, -poisson * strain, -poisson * strain);
    const Mat3 p = stress(kind, h);
    EXPECT_NEAR(p(0, 0) / (material.young * strain), 1, 1e-6) << poisson;
    EXPECT_LT(std::abs(p(1, 1)) / p(0, 0), 1e-6) << poisson;
  }
}

TEST(CellModel, AffineFieldHasTheContinuumsEnergyAtAnySpacing) {
  for (const Vec3& spacing : {Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.115, 0.09)}) {
    Lattice lattice = turned_lattice();
    lattice.spacing = spacing;
    const CellKind kind = cell_kind(lattice, rubbery(0.3));
    Mat3 h;
    h << 0.2, 0.1, -0.05, 0.03, -0.1, 0.2, 0.0, 0.15, 0.1;
    const CellVectors u = affine_displacements(lattice, h, Vec3(1, 2, 3));
    EXPECT_LT((displacement_gradient(kind, u) - h).norm(), 1e-13);
    const Mat3 f = Mat3::Identity() + h;
    const double log_j = std::log(f.determinant());
    const double expected =
        kind.mu / 2 * ((f.transpose() * f).trace() - 3 - 2 * log_j) + kind.lambda / 2 * log_j * log_j;
    EXPECT_NEAR(cell_energy(kind, u) / (kind.volume * expected), 1, 1e-12);
  }
}

TEST(CellModel, ForcesAreTheEnergysDerivative) {
  const CellKind kind = cell_kind(turned_lattice(), rubbery(0.3));
  Random random;
  for (int round = 0; round < 20; ++round) {
    const CellVectors u = random.displacement(0.015);
    const CellVectors forces = cell_forces(kind, u);
    for (int a = 0; a < 8; ++a)
      for (int axis = 0; axis < 3; ++axis) {
        CellVectors up = u, down = u;
        up[a][axis] += 1e-6;
        down[a][axis] -= 1e-6;
        const double difference = (cell_energy(kind, up) - cell_energy(kind, down)) / 2e-6;
        EXPECT_NEAR(-forces[a][axis], difference, 1e-5 * (std::abs(difference) + 100));
      }
  }
}

TEST(CellModel, NoNetForceAndTorque) {
  const Lattice lattice = turned_lattice();
  const CellKind kind = cell_kind(lattice, rubbery(0.4));
  Random random;
  const CellVectors u = random.displacement(0.02);
  const CellVectors forces = cell_forces(kind, u);
  const auto x = corners(lattice);
  Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
  double scale = 0;
  for (int a = 0; a < 8; ++a) {
    sum += forces[a];
    torque += (x[a] + u[a]).cross(forces[a]);
    scale += forces[a].norm();
  }
  EXPECT_LT(sum.norm(), 1e-12 * scale);
  EXPECT_LT(torque.norm(), 1e-12 * scale);
}

TEST(CellModel, StiffnessIsTheForcesDerivativeAndSymmetric) {
  const CellKind kind = cell_kind(turned_lattice(), rubbery(0.3));
  Random random;
  for (int round = 0; round < 10; ++round) {
    const CellVectors u = random.displacement(0.015);
    const CellTangent tangent = cell_tangent(displacement_gradient(kind, u));
    for (std::size_t b = 0; b < 8; ++b)
      for (int axis = 0; axis < 3; ++axis) {
        CellVectors up = u, down = u;
        up[b][axis] += 1e-6;
        down[b][axis] -= 1e-6;
        const CellVectors high = cell_forces(kind, up), low = cell_forces(kind, down);
        for (std::size_t a = 0; a < 8; ++a) {
          const Vec3 difference = -(high[a] - low[a]) / 2e-6;
          const Block block = tangent_block(kind, tangent, a, b);
          EXPECT_LT((block.col(axis) - difference).norm(), 1e-5 * (difference.norm() + 1e4));
          EXPECT_LT((block.transpose() - tangent_block(kind, tangent, b, a)).norm(),
                    1e-9 * (block.norm() + 1));
        }
      }
  }
}

TEST(CellModel, ProjectedModuliArePositiveAndElseTheSame) {
  const CellKind kind = cell_kind(turned_lattice(), rubbery(0.45));
  Mat3 gentle = Mat3::Zero(), crushed = Mat3::Zero();
  gentle.diagonal().setConstant(0.01);  // under tension every modulus is positive
  crushed.diagonal() = Vec3(1.5, 1.5, 1.5);
  const CellTangent calm = cell_tangent(gentle), wild = cell_tangent(crushed);
  EXPECT_LT((projected_elasticity(kind, calm) - elasticity(kind, calm)).norm(),
            1e-10 * elasticity(kind, calm).norm());
  Eigen::SelfAdjointEigenSolver<Mat9> before(elasticity(kind, wild)), after(projected_elasticity(kind, wild));
  EXPECT_LT(before.eigenvalues().minCoeff(), -1e-3 * before.eigenvalues().maxCoeff());
  EXPECT_GT(after.eigenvalues().minCoeff(), -1e-12 * after.eigenvalues().maxCoeff());
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < 8; ++b)
      EXPECT_LT(
          (projected_block(kind, elasticity(kind, calm), a, b) - tangent_block(kind, calm, a, b)).norm(),
          1e-9 * tangent_block(kind, calm, a, a).norm());
}

TEST(CellModel, SecondStressTurnsWithNothingAndGivesTheFirst) {
  Random random;
  const Lattice lattice = turned_lattice();
  const CellKind kind = cell_kind(lattice, rubbery(0.3));
  const Mat3 h = displacement_gradient(kind, random.displacement(0.015));
  const Mat3 f = Mat3::Identity() + h;
  EXPECT_LT((f * second_stress(kind, h) - stress(kind, h)).norm(), 1e-12 * stress(kind, h).norm());
  const Mat3 rotation = Eigen::AngleAxisd(1.3, Vec3(1, -2, 3).normalized()).toRotationMatrix();
  const Mat3 turned = second_stress(kind, rotation * f - Mat3::Identity());
  EXPECT_LT((turned - second_stress(kind, h)).norm(), 1e-12 * turned.norm());
}

// The prediction is exact to first order in the change: its error falls with the square.
TEST(CellModel, PredictedStressIsTheLinearModel) {
  Random random;
  const CellKind kind = cell_kind(turned_lattice(), rubbery(0.3));
  const Mat3 h = displacement_gradient(kind, random.displacement(0.015));
  const Mat3 change = displacement_gradient(kind, random.displacement(0.015));
  const auto error = [&](double step) {
    return (predicted_stress(kind, h, step * change) - second_stress(kind, h + step * change)).norm();
  };
  EXPECT_NEAR(error(1e-3) / error(5e-4), 4, 0.05);
}

TEST(CellModel, CornerGradientIsThatOfAnAffineFieldAndSeesAFold) {
  const Lattice lattice = turned_lattice();
  const CellKind kind = cell_kind(lattice, rubbery(0.3));
  Mat3 h;
  h << 0.2, 0.1, -0.05, 0.03, -0.1, 0.2, 0.0, 0.15, 0.1;
  CellVectors u = affine_displacements(lattice, h, Vec3(1, 2, 3));
  for (std::uint32_t a = 0; a < 8; ++a) EXPECT_LT((corner_gradient(kind, u, a) - h).norm(), 1e-13);
  u.fill(Vec3::Zero());
  const auto x = corners(lattice);
  u[0] = 1.2 * (x[7] - x[0]);  // beyond the plane of its three neighbours, and beyond the opposite corner
  EXPECT_LT(1 + volume_change(corner_gradient(kind, u, 0)), 0);
  EXPECT_GT(1 + volume_change(displacement_gradient(kind, u)), 0);
}

TEST(CellModel, InvertedCellHasInfiniteEnergy) {
  const Lattice lattice = turned_lattice();
  const CellKind kind = cell_kind(lattice, rubbery(0.3));
  Mat3 mirror = Mat3::Zero();
  mirror(0, 0) = -2;
  EXPECT_TRUE(std::isinf(cell_energy(kind, affine_displacements(lattice, mirror, Vec3::Zero()))));
}

}  // namespace
}  // namespace flexel::simulate
