// The barrier against corners that fold: derivatives by differences, nothing above its threshold, rest shapes
// of their own, the bound on the step, and bodies whose corners come near folding in time and at equilibrium.
#include "simulate/models/corner_barrier.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <random>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"
#include "simulate/effects/damping.h"
#include "simulate/models/prepared_cell.h"
#include "simulate/stepping/explicit_barrier.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::kCauchyGum;
using Matrix24 = Eigen::Matrix<double, 24, 24>;

constexpr double kFoldSpacing = 0.01;

CellKind gum_cell() {
  Lattice lattice;
  lattice.axes = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  lattice.spacing = kFoldSpacing * Vec3(1, 1.1, 0.9);
  return cell_kind(lattice, kCauchyGum);
}

// Corner 0 is pushed so far towards its opposite one that J_0 is `volume`, the others a little at random,
// and the whole is turned.
CellVectors pushed(const CellKind& kind, double volume, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-0.02 * kFoldSpacing, 0.02 * kFoldSpacing);
  CellVectors still;
  for (Vec3& u : still) u = Vec3(any(random), any(random), any(random));
  const Vec3 way = kFoldSpacing * kind.gradient[7].normalized();
  CellVectors u;
  double low = 0, high = 2;
  for (int i = 0; i < 80; ++i) {
    u = still;
    u[0] += 0.5 * (low + high) * way;
    (1 + volume_change(corner_gradient(kind, u, 0)) > volume ? low : high) = 0.5 * (low + high);
  }
  return u;
}

const CornerThresholds kPlain = fold_thresholds(CellKind{}, std::nullopt);

class FoldBarrier : public ::testing::TestWithParam<double> {};

TEST_P(FoldBarrier, ForcesAndTangentAreDerivatives) {
  const CellKind kind = gum_cell();
  for (unsigned seed = 0; seed < 5; ++seed) {
    const CellVectors u = pushed(kind, GetParam(), seed);
    CellVectors force;
    force.fill(Vec3::Zero());
    add_fold_forces(kind, kPlain, u, force);
    const auto tangent = fold_tangent(kind, kPlain, u, false);
    ASSERT_TRUE(tangent.has_value());
    const double step = 1e-6 * kFoldSpacing;
    double most_force = 0, most_stiffness = 0;
    for (const Vec3& f : force) most_force = std::max(most_force, f.norm());
    for (const Block& block : *tangent) most_stiffness = std::max(most_stiffness, block.norm());
    for (std::size_t b = 0; b < 8; ++b)
      for (int axis = 0; axis < 3; ++axis) {
        CellVectors more = u, less = u, up, down;
        more[b][axis] += step;
        less[b][axis] -= step;
        EXPECT_NEAR(force[b][axis],
                    (fold_energy(kind, kPlain, less) - fold_energy(kind, kPlain, more)) / (2 * step),
                    1e-5 * most_force);
        up.fill(Vec3::Zero());
        down.fill(Vec3::Zero());
        add_fold_forces(kind, kPlain, more, up);
        add_fold_forces(kind, kPlain, less, down);
        for (std::size_t a = 0; a < 8; ++a) {
          const Vec3 slope = (down[a] - up[a]) / (2 * step), column = (*tangent)[8 * a + b].col(axis);
          EXPECT_LT((slope - column).norm(), 1e-5 * most_stiffness) << a << " by " << b;
        }
      }
  }
}

// The bound on the step takes the cell's own tangent and the barrier's as if their worst modes were one.
TEST_P(FoldBarrier, ItsStiffnessIsWithinTheBound) {
  const CellKind kind = gum_cell();
  const CellVectors u = pushed(kind, GetParam(), 3);
  Matrix24 own, barrier, projected;
  const auto tangent = fold_tangent(kind, kPlain, u, false), positive = fold_tangent(kind, kPlain, u, true);
  const std::array<Block, 64> at_rest = blocks_at_rest(kind);
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < 8; ++b) {
      const auto row = 3 * static_cast<Eigen::Index>(a), column = 3 * static_cast<Eigen::Index>(b);
      own.block<3, 3>(row, column) = at_rest[8 * a + b];
      barrier.block<3, 3>(row, column) = (*tangent)[8 * a + b];
      projected.block<3, 3>(row, column) = (*positive)[8 * a + b];
    }
  const double ratio = eigenvalues_symmetric(barrier)[23] / eigenvalues_symmetric(own)[23];
  EXPECT_GE(fold_stiffening(kind, kPlain, u), ratio);
  EXPECT_LT(fold_stiffening(kind, kPlain, u), 10 * ratio);
  EXPECT_GE(eigenvalues_symmetric(projected)[0], -1e-12 * eigenvalues_symmetric(projected)[23]);
}

// Folded, deep in, in the logarithm, nearly out of it.
INSTANTIATE_TEST_SUITE_P(Corners, FoldBarrier, ::testing::Values(-0.05, 0.003, 0.02, 0.07));

TEST(FoldBarrier, BeginsSmoothlyAtItsThreshold) {
  const CellKind kind = gum_cell();
  const auto force = [&](double volume) {
    CellVectors f;
    f.fill(Vec3::Zero());
    add_fold_forces(kind, kPlain, pushed(kind, volume, 1), f);
    return f[0].norm();
  };
  EXPECT_EQ(force(0.1001), 0);
  EXPECT_EQ(fold_energy(kind, kPlain, pushed(kind, 0.1001, 1)), 0);
  EXPECT_FALSE(fold_tangent(kind, kPlain, pushed(kind, 0.1001, 1), false));
  // b' goes with the square of what is missing to the threshold
  EXPECT_NEAR(force(0.098) / force(0.099), 4, 0.1);
  EXPECT_GT(force(0.099), 0);
}

TEST(FoldBarrier, NoRigidMotionFeelsIt) {
  const CellKind kind = gum_cell();
  const Mat3 turn = Eigen::AngleAxisd(2.5, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  CellVectors u = pushed(kind, 0.04, 2), turned, f, g;
  for (std::size_t a = 0; a < 8; ++a) {
    Vec3 at = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 slope = 0.5 * (kind.gradient[std::size_t{1} << axis] - kind.gradient[0]);
      at += ((a >> axis & 1) ? 0.5 : -0.5) / slope.squaredNorm() * slope;
    }
    turned[a] = turn * (at + u[a]) - at + Vec3(1, 2, 3);
  }
  f.fill(Vec3::Zero());
  g.fill(Vec3::Zero());
  add_fold_forces(kind, kPlain, u, f);
  add_fold_forces(kind, kPlain, turned, g);
  Vec3 sum = Vec3::Zero();
  for (std::size_t a = 0; a < 8; ++a) {
    EXPECT_LT((g[a] - turn * f[a]).norm(), 1e-9 * f[0].norm());
    sum += f[a];
  }
  EXPECT_LT(sum.norm(), 1e-12 * f[0].norm());
}

// A cell whose rest shape is nearly flat at a corner rests there.
TEST(FoldBarrier, ARestShapeHasItsOwnThreshold) {
  const CellKind kind = gum_cell();
  const CellVectors u = pushed(kind, 0.03, 4);
  const Mat3 f = Mat3::Identity() + displacement_gradient(kind, u);
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(f.transpose() * f));
  const Mat3 root = eigen.operatorInverseSqrt();
  std::array<Vec3, 4> hourglass;
  for (int m = 0; m < 4; ++m) {
    Vec3 q = Vec3::Zero();
    for (int a = 0; a < 8; ++a) q += hourglass_sign(m, a) / 8 * u[static_cast<std::size_t>(a)];
    hourglass[static_cast<std::size_t>(m)] = f.inverse() * q;
  }
  const CornerThresholds own =
      fold_thresholds(kind, with_rest_shape(kind, root - Mat3::Identity(), f.determinant(), hourglass));
  EXPECT_NEAR(own[0], 0.1 * 0.03, 1e-9);
  EXPECT_GT(fold_energy(kind, kPlain, u), 0);
  EXPECT_EQ(fold_energy(kind, own, u), 0);
}

// Two layers of cells are pressed to a tenth: nothing folds, and what they were given comes back.
TEST(FoldBarrier, CrushedCellsKeepTheirCornersAndTheBooks) {
  Scene scene;
  scene.materials["gum"] = kCauchyGum;
  scene.material = "gum";
  scene.run.time = 0.06;
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("z0")));
  Tie press = make_move(select_by_name("z1"), Vec3(0.0004, 0.0002, -0.018));
  press.course = {{0, 0.03, 0.06}, {0, 1, 0}};
  scene.get<Supports>().ties.push_back(press);
  scene.get<Damping>().entries.push_back({5e-4, {}, ""});
  const testing::TimedCase made = testing::run_timed(testing::box_of({2, 2, 2}, kFoldSpacing), scene);
  testing::expect_books_close(made.result);
  for (std::size_t e = 0; e < made.body.element_count(); ++e)
    EXPECT_LT((made.body.position[e] - made.body.rest[e]).norm(), 1e-3 * kFoldSpacing);
}

TEST(ExplicitBarrier, WatchesWhatMayFoldOnly) {
  const Body body = testing::box_of({3, 3, 3}, kFoldSpacing);
  const Problem problem = testing::problem_of(body, kCauchyGum);
  ExplicitBarrier guard(problem);
  EXPECT_TRUE(guard.needs_step_recheck());  // it has not looked yet
  State state = testing::at_rest(body);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.displacement[e] = Vec3(0, 0, -0.3 * body.rest[e].z());
  guard.look(state, 1e-3);
  EXPECT_FALSE(guard.watches());
  EXPECT_FALSE(guard.needs_step_recheck());
  state.velocity[0] = Vec3(0, 0, 8);  // its corner is as good as flat after 1 ms
  guard.look(state, 1e-3);
  EXPECT_TRUE(guard.watches());
  std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
  guard.add_forces(state, forces);
  EXPECT_EQ(testing::largest(forces), 0);
  state.displacement[0].z() = 0.0068;
  guard.add_forces(state, forces);
  EXPECT_LT(forces[0].z(), 0);
  EXPECT_TRUE(guard.needs_step_recheck());
  EXPECT_GT(guard.energy(state), 0);
}

}  // namespace
}  // namespace flexel::simulate
