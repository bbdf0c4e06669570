// Model `cells`, one cell: invariance, patch test, and every derivative against differences on random input.
#include "simulate/models/cell_model.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"
#include "simulate/laws/elasticity.h"
#include "simulate/models/prepared_cell.h"
#include "simulate/models/stability.h"
#include "tests/simulate/stepped.h"

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

// Of its own at rest, and of one that flowed.
std::array<CellKind, 2> kinds_of(double poisson) {
  const CellKind kind = cell_kind(turned_lattice(), rubbery(poisson));
  Mat3 change;
  change << -0.1, 0.03, 0.02, 0.03, 0.15, -0.05, 0.02, -0.05, 0.05;
  std::array<Vec3, 4> flowed;
  for (int m = 0; m < 4; ++m) flowed[static_cast<std::size_t>(m)] = Vec3(0.004, -0.002 * m, 0.003);
  return {kind, with_rest_shape(kind, change, 1.1, flowed)};
}

TEST(CellModel, ForcesAreTheEnergysDerivative) {
  Random random;
  for (const CellKind& kind : kinds_of(0.3))
    for (int round = 0; round < 20; ++round) {
      const CellVectors u = random.displacement(0.015);
      const CellVectors forces = cell_forces(kind, u);
      for (std::size_t a = 0; a < 8; ++a)
        for (int axis = 0; axis < 3; ++axis) {
          CellVectors up = u, down = u;
          up[a][axis] += 1e-6;
          down[a][axis] -= 1e-6;
          const double difference = (cell_energy(kind, up) - cell_energy(kind, down)) / 2e-6;
          EXPECT_NEAR(-forces[a][axis], difference, 1e-5 * (std::abs(difference) + 100));
        }
    }
}

std::array<Block, 64> tangent_of(const CellKind& kind, const CellVectors& u) {
  const CellTangent tangent = cell_tangent(displacement_gradient(kind, u));
  const HourglassTangent hourglass = hourglass_tangent(kind, u, false);
  std::array<Block, 64> blocks;
  for (std::size_t a = 0; a < 8; ++a) {
    for (std::size_t b = 0; b < 8; ++b) blocks[8 * a + b] = tangent_block(kind, tangent, a, b);
    add_hourglass_row(kind, hourglass, 1, a, 0, 8, &blocks[8 * a]);
  }
  return blocks;
}

TEST(CellModel, StiffnessIsTheForcesDerivativeAndSymmetric) {
  Random random;
  for (const CellKind& kind : kinds_of(0.3))
    for (int round = 0; round < 10; ++round) {
      const CellVectors u = random.displacement(0.015);
      const std::array<Block, 64> blocks = tangent_of(kind, u);
      for (std::size_t b = 0; b < 8; ++b)
        for (int axis = 0; axis < 3; ++axis) {
          CellVectors up = u, down = u;
          up[b][axis] += 1e-6;
          down[b][axis] -= 1e-6;
          const CellVectors high = cell_forces(kind, up), low = cell_forces(kind, down);
          for (std::size_t a = 0; a < 8; ++a) {
            const Vec3 difference = -(high[a] - low[a]) / 2e-6;
            const Block& block = blocks[8 * a + b];
            EXPECT_LT((block.col(axis) - difference).norm(), 1e-5 * (difference.norm() + 1e4));
            EXPECT_LT((block.transpose() - blocks[8 * b + a]).norm(), 1e-9 * (block.norm() + 1));
          }
        }
    }
}

TEST(CellModel, BlocksAtRestAreTheTangentThere) {
  const CellKind kind = kinds_of(0.3)[0];
  CellVectors rest;
  rest.fill(Vec3::Zero());
  const std::array<Block, 64> at_rest = blocks_at_rest(kind), tangent = tangent_of(kind, rest);
  for (std::size_t k = 0; k < 64; ++k) EXPECT_LT((at_rest[k] - tangent[k]).norm(), 1e-12 * tangent[0].norm());
}

// Strains curvature x_k of the three axes.
CellVectors bent(const Vec3& spacing, const Vec3& curvature, int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  CellVectors u;
  for (int a = 0; a < 8; ++a) {
    const Vec3 x = spacing.cwiseProduct(Vec3((a & 1) - 0.5, (a >> 1 & 1) - 0.5, (a >> 2) - 0.5));
    Vec3& to = u[static_cast<std::size_t>(a)];
    to[i] = curvature[i] * x[i] * x[k];
    to[j] = curvature[j] * x[j] * x[k];
    to[k] = 0.5 * (curvature[k] * x[k] * x[k] - curvature[i] * x[i] * x[i] - curvature[j] * x[j] * x[j]);
  }
  return u;
}

Material wood() {
  Material material{"w", 0, 0, 430, ""};
  material.law = LawName::orthotropic;
  material.youngs = Vec3(11e9, 0.9e9, 0.5e9);
  material.poissons = Vec3(0.37, 0.42, 0.47);
  material.shears = Vec3(0.75e9, 0.06e9, 0.7e9);  // of yz, zx, xy where no key says otherwise
  return material;
}

// Bending about any axis without stress beside it, plates and wood as well: the matter's energy, whatever the spacing.
TEST(CellModel, PureBendingHasTheMattersEnergy) {
  Lattice lattice;
  for (const Vec3& h : {Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.3, 0.04)})
    for (const Material& material : {rubbery(0), rubbery(0.3), rubbery(0.49), rubbery(-0.5), wood()}) {
      lattice.spacing = h;
      const CellKind kind = cell_kind(lattice, material);
      const Mat6 compliance = moduli_at_rest(kind.law).inverse();
      for (int k = 0; k < 3; ++k)
        for (const Vec3& pull : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0), Vec3(1, -2, 0)}) {
          Vec3 stress = Vec3::Zero();  // Pa/m
          stress[(k + 1) % 3] = pull[0];
          stress[(k + 2) % 3] = pull[1];
          const Vec3 curvature = compliance.topLeftCorner<3, 3>() * stress;
          const double size = 1e-9 / curvature.norm();
          const double expected = 0.5 * size * size * stress.dot(curvature) * kind.volume * h[k] * h[k] / 12;
          EXPECT_NEAR(cell_energy(kind, bent(h, size * curvature, k)) / expected, 1, 1e-6)
              << h << " " << material.poisson << " along " << k;
        }
    }
}

// A twisted bar, whose section stays plane, and a twisted plate.
TEST(CellModel, PureTwistingHasTheMattersEnergy) {
  Lattice lattice;
  for (const Vec3& h : {Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.3, 0.04)})
    for (const Material& material : {rubbery(0.3), rubbery(0.49), wood()}) {
      lattice.spacing = h;
      const CellKind kind = cell_kind(lattice, material);
      const Mat6 moduli = moduli_at_rest(kind.law);
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const auto shear = [&](int axis) { return moduli(3 + axis, 3 + axis); };  // of axis and the next
        CellVectors bar, plate;
        for (int a = 0; a < 8; ++a) {
          const Vec3 x = h.cwiseProduct(Vec3((a & 1) - 0.5, (a >> 1 & 1) - 0.5, (a >> 2) - 0.5));
          Vec3 &of_bar = bar[static_cast<std::size_t>(a)], &of_plate = plate[static_cast<std::size_t>(a)];
          of_bar[i] = 0;
          of_bar[j] = -1e-9 * x[i] * x[k];
          of_bar[k] = 1e-9 * x[i] * x[j];
          of_plate[i] = -1e-9 * x[j] * x[k];
          of_plate[j] = -1e-9 * x[i] * x[k];
          of_plate[k] = 1e-9 * x[i] * x[j];
        }
        const double scale = 0.5e-18 * kind.volume / 12;
        const double of_bar = scale * (shear(i) * h[k] * h[k] + shear(k) * h[j] * h[j]);
        EXPECT_NEAR(cell_energy(kind, bar) / of_bar, 1, 1e-6) << h << " along " << i;
        EXPECT_NEAR(cell_energy(kind, plate) / (scale * 4 * shear(i) * h[k] * h[k]), 1, 1e-6);
      }
    }
}

// Turned by any rotation, and mirrored or permuted like the cube: the same energy.
TEST(CellModel, EnergyIsThatOfTheShapeAlone) {
  Random random;
  for (const CellKind& kind : kinds_of(0.45)) {
    const CellVectors u = random.displacement(0.02);
    const Mat3 rotation = Eigen::AngleAxisd(2.3, Vec3(1, -2, 3).normalized()).toRotationMatrix();
    const auto x = corners(turned_lattice());
    CellVectors turned;
    for (std::size_t a = 0; a < 8; ++a) turned[a] = rotation * (x[a] + u[a]) - x[a];
    EXPECT_NEAR(cell_energy(kind, turned) / cell_energy(kind, u), 1, 1e-11);
  }
  Lattice lattice;
  lattice.spacing.setConstant(0.1);
  const CellKind cube = cell_kind(lattice, rubbery(0.3));
  const CellVectors u = random.displacement(0.02);
  for (int form = 0; form < 48; ++form) {
    std::array<int, 3> axis{0, 1, 2};
    for (int step = 0; step < form % 6; ++step) std::next_permutation(axis.begin(), axis.end());
    CellVectors moved;
    for (std::size_t a = 0; a < 8; ++a) {
      std::size_t to = 0;
      Vec3 value;
      for (int c = 0; c < 3; ++c) {
        const bool mirrored = form / 6 >> c & 1;
        const bool high = (a >> axis[static_cast<std::size_t>(c)] & 1) != mirrored;
        to |= std::size_t{high} << c;
        value[c] = (mirrored ? -1 : 1) * u[a][axis[static_cast<std::size_t>(c)]];
      }
      moved[to] = value;
    }
    EXPECT_NEAR(cell_energy(cube, moved) / cell_energy(cube, u), 1, 1e-12) << form;
  }
}

// Squeezed to a third or drawn out to three times, no hourglass mode is softer than c_m.
TEST(CellModel, NoStretchMakesHourglassModesUnstable) {
  for (const double poisson : {-0.5, 0.0, 0.3, 0.49}) {
    Lattice lattice;
    lattice.spacing = Vec3(0.1, 0.1, 0.06);
    const CellKind kind = cell_kind(lattice, rubbery(poisson));
    EXPECT_GT(*std::min_element(kind.hourglass.begin(), kind.hourglass.end()), 0);
    for (const Vec3& stretch : {Vec3(1, 1, 0.34), Vec3(0.5, 0.5, 0.5), Vec3(3, 1, 1), Vec3(2, 2, 0.4)}) {
      const CellVectors u =
          affine_displacements(lattice, Mat3(stretch.asDiagonal()) - Mat3::Identity(), Vec3::Zero());
      const Mat3 pull = hourglass_tangent(kind, u, false).pull;
      Mat9 spread = Mat9::Zero(), free = Mat9::Zero();
      for (int m = 0; m < 3; ++m) {
        spread.block<3, 3>(3 * m, 3 * m) = pull;
        free.diagonal().segment<3>(3 * m).setConstant(kind.hourglass[static_cast<std::size_t>(m)]);
      }
      const Mat9 added = spread.transpose() * kind.by_mode * spread;
      const double least = Eigen::SelfAdjointEigenSolver<Mat9>(free + added).eigenvalues()[0];
      EXPECT_GT(least, (1 - 1e-10) * free.diagonal().minCoeff()) << poisson << " " << stretch;
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

double largest(const std::array<Block, 64>& blocks) {
  Eigen::Matrix<double, 24, 24> whole;
  for (Eigen::Index a = 0; a < 8; ++a)
    for (Eigen::Index b = 0; b < 8; ++b)
      whole.block<3, 3>(3 * a, 3 * b) = blocks[static_cast<std::size_t>(8 * a + b)];
  return eigenvalues_symmetric(whole)[23];
}

// The bound on the step: of cells squeezed and bent at random by half a spacing and more, as far as none folds.
TEST(CellModel, StiffnessIsWithinTheBoundOfTheStep) {
  Random random;
  int seen = 0;
  for (const Vec3& h : {Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.1, 0.04)})
    for (const Material& material : {rubbery(0), rubbery(0.3), rubbery(0.49)}) {
      testing::BoxOptions options;
      options.cells = {1, 1, 1};
      options.spacing = h;
      const Body body = testing::box_body(options);
      const CellKind kind = cell_kind(body.parts[0].lattice, material);
      const double at_rest = largest(blocks_at_rest(kind));
      for (int round = 0; round < 60; ++round) {
        std::vector<Vec3> displacement;
        const double squeeze = 0.5 * (round % 5) / 4;
        for (const Vec3& x : body.rest)
          displacement.push_back(Vec3(0, 0, -squeeze * x.z()) +
                                 h.minCoeff() * 0.3 * random.displacement(1)[0]);
        CellVectors u;
        for (std::size_t a = 0; a < 8; ++a) u[a] = displacement[body.cell_elements[0][a]];
        if (!(volume_change(displacement_gradient(kind, u)) > -0.9)) continue;
        const Problem problem = testing::problem_of(body, material);
        ++seen;
        EXPECT_LE(largest(tangent_of(kind, u)),
                  (1 + 1e-9) * at_rest * stiffening(problem, cells_of_parts(problem), displacement, {{0}})[0])
            << material.poisson << ", round " << round;
      }
    }
  EXPECT_GT(seen, 200);
}

// Likewise of cells that were bent, renormalised, and led back to the lattice's shape.
TEST(CellModel, StiffnessIsWithinTheBoundOfTheStepBesideABentRestShape) {
  for (const double poisson : {0.0, 0.3}) {
    testing::BoxOptions options;
    options.cells = {1, 1, 1};
    options.spacing.setConstant(0.1);
    Body body = testing::box_body(options);
    const Problem problem = testing::problem_of(body, rubbery(poisson));
    const CellKind kind = cell_kind(body.parts[0].lattice, rubbery(poisson));
    const std::vector<Vec3> back(8, Vec3::Zero());
    CellVectors rest;
    rest.fill(Vec3::Zero());
    for (int form = 0; form < 512; ++form) {  // signs of the nine components
      std::array<Vec3, 4> q;
      q.fill(Vec3::Zero());
      for (int i = 0; i < 9; ++i) q[static_cast<std::size_t>(i / 3)][i % 3] = form >> i & 1 ? 0.015 : -0.015;
      std::vector<double> column;
      for (const Vec3& each : q) column.insert(column.end(), each.begin(), each.end());
      body.cell_columns["plastic_hourglass"] = {12, column};
      const CellKind bent = with_rest_shape(kind, Mat3::Zero(), 1, q);
      EXPECT_LE(largest(tangent_of(bent, rest)),
                (1 + 1e-9) * largest(blocks_at_rest(kind)) *
                    stiffening(problem, cells_of_parts(problem), back, {{0}})[0])
          << poisson << ", form " << form;
    }
  }
}

}  // namespace
}  // namespace flexel::simulate
