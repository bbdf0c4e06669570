// Conjugate gradients, block Jacobi and multigrid: exactness, symmetry, repeatability, iteration counts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <random>

#include "base/parallel.h"
#include "simulate/linear/direct.h"
#include "tests/sanitized.h"
#include "tests/simulate/voxel_problem.h"

namespace flexel::simulate::test {
namespace {

using Vector = std::vector<Vec3>;

Vector random_vector(std::size_t n, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  Vector v(n);
  for (Vec3& entry : v) entry = Vec3(normal(generator), normal(generator), normal(generator));
  return v;
}

double dot(const Vector& a, const Vector& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

Eigen::SparseMatrix<double> to_eigen(const BlockMatrix& matrix) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (std::uint64_t q = matrix.row_offsets[i]; q < matrix.row_offsets[i + 1]; ++q) {
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c)
          entries.emplace_back(3 * i + r, 3 * matrix.columns[q] + c, matrix.values[q](r, c));
      }
    }
  }
  const auto n = static_cast<Eigen::Index>(3 * matrix.rows());
  Eigen::SparseMatrix<double> sparse(n, n);
  sparse.setFromTriplets(entries.begin(), entries.end());
  return sparse;
}

Eigen::Map<const Eigen::VectorXd> flat(const Vector& v) {
  return {v.front().data(), static_cast<Eigen::Index>(3 * v.size())};
}

LinearResult solve(const VoxelProblem& problem, Vector& x, double tolerance = 1e-6, int most = 200) {
  const auto multigrid = aggregation_multigrid(problem.matrix, problem.geometry);
  return conjugate_gradients(problem.matrix, problem.load, x, *multigrid, tolerance, most);
}

int iterations(const VoxelProblem& problem) {
  Vector x;
  const LinearResult result = solve(problem, x);
  EXPECT_TRUE(result.converged) << result.relative_residual;
  EXPECT_LE(result.relative_residual, 1e-6);
  return result.iterations;
}

// A problem with everything that is awkward at once: slivers, contrast of 1e5, two parts, a thin wall.
VoxelProblem awkward() {
  std::vector<Voxel> voxels =
      carve({24, 8, 8}, [](const Vec3& x) { return x[2] < 1 || x[1] < 2 || x[0] < 8; });
  for (Voxel& v : voxels) {
    if (v.at[0] == 23) v.fill = 1. / 64;
    if ((v.at[0] / 4 + v.at[1] / 4) % 2 == 1) v.modulus = 1e-5;
  }
  for (const Voxel& v : carve({12, 3, 3})) voxels.push_back({{v.at[0], v.at[1] + 4, v.at[2] + 3}, 1, 1, 1});
  return clamp_and_push(assemble(voxels, 1e-3), 0);
}

TEST(Multiply, AgreesWithEigen) {
  const VoxelProblem problem = awkward();
  const Vector x = random_vector(problem.matrix.rows(), 1);
  Vector y;
  multiply(problem.matrix, x, y);
  const Eigen::VectorXd expected = to_eigen(problem.matrix) * flat(x);
  EXPECT_LE((flat(y) - expected).norm(), 1e-13 * expected.norm());
}

TEST(VoxelProblem, RigidMotionsCostNothing) {
  const VoxelProblem problem = assemble(carve({3, 2, 2}), .5);
  Vector turn(problem.matrix.rows()), force;
  for (std::size_t i = 0; i < turn.size(); ++i)
    turn[i] = Vec3(1, 2, 3) + Vec3(.3, -.2, .7).cross(problem.geometry.position[i]);
  multiply(problem.matrix, turn, force);
  EXPECT_LE(std::sqrt(dot(force, force)), 1e-13 * std::sqrt(dot(turn, turn)));
}

// A^-1 b by factorisation, refined until its own rounding is gone: residuals in long double.
Eigen::VectorXd refined_solution(const VoxelProblem& problem) {
  const Eigen::SparseMatrix<double> matrix = to_eigen(problem.matrix);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> direct(matrix);
  const Eigen::SparseMatrix<long double> exact = matrix.cast<long double>();
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
  const Long load = flat(problem.load).cast<long double>();
  Long x = Long::Zero(load.size());
  for (int round = 0; round < 4; ++round)
    x += direct.solve(Long(load - exact * x).cast<double>().eval()).cast<long double>();
  return x.cast<double>();
}

TEST(ConjugateGradients, AgreesWithADirectSolution) {
  // Double precision cannot do better than its epsilon times the condition number: a contrast of 1e5 on top
  // of slivers leaves 2e-10.
  for (const auto& [problem, tolerance] :
       {std::pair{beam(3000), 1e-10}, {plate(2000), 1e-10}, {awkward(), 1e-9}}) {
    Vector x;
    const LinearResult result = solve(problem, x, 1e-13);
    ASSERT_TRUE(result.converged) << result.iterations << " " << result.relative_residual;
    const Eigen::VectorXd expected = refined_solution(problem);
    EXPECT_LE((flat(x) - expected).norm(), tolerance * expected.norm());
  }
}

TEST(ConjugateGradients, BlockJacobiReachesTheSameSolution) {
  const VoxelProblem problem = beam(2000);
  Vector x, y;
  ASSERT_TRUE(solve(problem, x, 1e-9).converged);
  const auto jacobi = block_jacobi(problem.matrix);
  ASSERT_TRUE(conjugate_gradients(problem.matrix, problem.load, y, *jacobi, 1e-9, 2000).converged);
  EXPECT_LE((flat(x) - flat(y)).norm(), 1e-6 * flat(x).norm());
}

TEST(ConjugateGradients, NoLoadNeedsNoIteration) {
  VoxelProblem problem = beam(100);
  problem.load.assign(problem.load.size(), Vec3::Zero());
  Vector x(3, Vec3::Ones());
  const LinearResult result = solve(problem, x);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 0);
  EXPECT_EQ(dot(x, x), 0);
  EXPECT_EQ(x.size(), problem.load.size());
}

TEST(ConjugateGradients, TellsNegativeCurvature) {
  for (const double cells : {200., 4000.}) {
    VoxelProblem problem = beam(cells);
    for (std::size_t i = 0; i < problem.matrix.rows(); ++i) {
      problem.matrix.values[diagonal_position(problem.matrix, i)] -= 2e-5 * Mat3::Identity();
    }
    Vector x;
    const LinearResult result = solve(problem, x);
    EXPECT_FALSE(result.converged);
    EXPECT_TRUE(result.indefinite);
    EXPECT_TRUE(flat(x).allFinite());
    EXPECT_GT(dot(x, problem.load), 0) << "a step that ascends along the load";
  }
}

TEST(ConjugateGradients, ProgressMayInterrupt) {
  const VoxelProblem problem = beam(3000);
  const auto multigrid = aggregation_multigrid(problem.matrix, problem.geometry);
  Vector x;
  int calls = 0;
  const auto stop = [&](int, double) {
    if (++calls == 3) throw std::runtime_error("stop");
  };
  EXPECT_THROW((void)conjugate_gradients(problem.matrix, problem.load, x, *multigrid, 1e-12, 100, stop),
               std::runtime_error);
  EXPECT_EQ(calls, 3);
}

TEST(ConjugateGradients, HopelessEndsWithWhatWasReached) {
  const VoxelProblem problem = beam(3000);
  const auto multigrid = aggregation_multigrid(problem.matrix, problem.geometry);
  Vector x;
  const auto third = [](int iteration, double) { return iteration == 3; };
  const LinearResult result =
      conjugate_gradients(StoredMatrix(problem.matrix), problem.load, x, *multigrid, 1e-12, 100, {}, third);
  EXPECT_EQ(result.iterations, 3);
  EXPECT_FALSE(result.converged);
  EXPECT_FALSE(result.indefinite);
  EXPECT_LT(result.relative_residual, 1);
}

TEST(Multigrid, IsExactOnSmallSystems) {
  for (const double cells : {1., 30., 400.}) EXPECT_LE(iterations(beam(cells)), 2);
  EXPECT_LE(iterations(plate(300)), 2);
}

TEST(Preconditioner, IsSymmetricAndPositiveDefinite) {
  for (const VoxelProblem& problem : {beam(300), beam(6000), plate(3000), awkward(), spring(5000)}) {
    for (const auto& preconditioner :
         {block_jacobi(problem.matrix), aggregation_multigrid(problem.matrix, problem.geometry)}) {
      for (unsigned seed = 0; seed < 5; ++seed) {
        const Vector a = random_vector(problem.matrix.rows(), 2 * seed),
                     b = random_vector(problem.matrix.rows(), 2 * seed + 1);
        Vector ma, mb;
        preconditioner->apply(a, ma);
        preconditioner->apply(b, mb);
        const double aa = dot(a, ma), bb = dot(b, mb);
        EXPECT_GT(aa, 0);
        EXPECT_GT(bb, 0);
        EXPECT_NEAR(dot(a, mb), dot(b, ma), 1e-9 * std::sqrt(aa * bb));
      }
    }
  }
}

TEST(Multigrid, StaysPositiveDefiniteForAnIndefiniteMatrix) {
  VoxelProblem problem = beam(4000);
  for (std::size_t i = 0; i < problem.matrix.rows(); ++i) {
    problem.matrix.values[diagonal_position(problem.matrix, i)] -= 2e-5 * Mat3::Identity();
  }
  const auto multigrid = aggregation_multigrid(problem.matrix, problem.geometry);
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Vector a = random_vector(problem.matrix.rows(), seed);
    Vector ma;
    multigrid->apply(a, ma);
    EXPECT_GT(dot(a, ma), 0);
  }
}

TEST(Multigrid, SameBitsForAnyThreadCount) {
  const VoxelProblem problem = awkward();
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    Vector x;
    EXPECT_TRUE(solve(problem, x).converged);
    return x;
  };
  const Vector one = run(1);
  for (const int threads : {2, 5}) {
    const Vector other = run(threads);
    for (std::size_t i = 0; i < one.size(); ++i) ASSERT_EQ(one[i], other[i]) << i;
  }
}

TEST(Multigrid, SolidPartsNeedUnder20Iterations) {
  EXPECT_LT(iterations(beam(1500)), 20);
  EXPECT_LT(iterations(beam(30000)), 20);
}

TEST(Multigrid, ThinPartsNeedUnder40Iterations) {
  const double share = less_if_sanitized(1.0, 0.2, "a fifth of the cells");
  EXPECT_LT(iterations(plate(1000)), 40);
  EXPECT_LT(iterations(plate(share * 20000)), 40);
  EXPECT_LT(iterations(plate(share * 10000, 2)), 40);
  EXPECT_LT(iterations(i_beam(share * 20000)), 40);
  EXPECT_LT(iterations(spring(share * 15000)), 40);
  EXPECT_LT(iterations(tube(share * 10000)), 40);
}

TEST(Multigrid, SliversCostNoIterations) {
  std::vector<Voxel> whole = carve({40, 12, 12}), sliver = whole;
  for (Voxel& v : sliver) {
    if (v.at[1] == 11 || v.at[2] == 0) v.fill = 1. / 64;
  }
  const int reference = iterations(clamp_and_push(assemble(whole), 0));
  EXPECT_LE(iterations(clamp_and_push(assemble(sliver), 0)), reference + 5);
}

TEST(Multigrid, PartsThatAreNotCoupledDoNotSlowEachOther) {
  std::vector<Voxel> voxels = carve({40, 10, 10});
  const int alone = iterations(clamp_and_push(assemble(voxels), 0));
  const std::size_t n = voxels.size();
  for (std::size_t v = 0; v < n; ++v)
    voxels.push_back({{voxels[v].at[0], voxels[v].at[1] + 10, voxels[v].at[2]}, 1, 1e-3, 1});
  EXPECT_LE(iterations(clamp_and_push(assemble(voxels), 0)), alone + 3);
}

TEST(Multigrid, EliminatedElementsAreIdentityRows) {
  VoxelProblem problem = assemble(carve({40, 10, 10}), 1e-3);
  BlockMatrix& matrix = problem.matrix;
  const auto fixed = [&](std::size_t i) { return problem.geometry.index[i][0] == 0; };
  push(problem, Vec3(.1, .3, 1), [](const Index3& index) { return index[0] == 40; });
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (std::uint64_t q = matrix.row_offsets[i]; q < matrix.row_offsets[i + 1]; ++q) {
      if (fixed(i) || fixed(matrix.columns[q]))
        matrix.values[q] = Mat3::Identity() * (matrix.columns[q] == i);
    }
  }
  EXPECT_LT(iterations(problem), 20);
}

TEST(Multigrid, RefreshEqualsANewHierarchy) {
  VoxelProblem problem = plate(3000, 2);
  const auto refreshed = aggregation_multigrid(problem.matrix, problem.geometry);
  for (Block& value : problem.matrix.values) value *= 3;
  refreshed->refresh();
  const auto anew = aggregation_multigrid(problem.matrix, problem.geometry);
  const Vector b = random_vector(problem.matrix.rows(), 7);
  Vector x, y;
  refreshed->apply(b, x);
  anew->apply(b, y);
  for (std::size_t i = 0; i < x.size(); ++i) ASSERT_EQ(x[i], y[i]);
}

TEST(Multigrid, AnElementWithoutStiffnessDoesNoHarm) {
  VoxelProblem problem = beam(3000);
  BlockMatrix& matrix = problem.matrix;
  const std::size_t loose = matrix.rows() / 2;
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (std::uint64_t q = matrix.row_offsets[i]; q < matrix.row_offsets[i + 1]; ++q) {
      if (i == loose || matrix.columns[q] == loose) matrix.values[q].setZero();
    }
  }
  EXPECT_LT(iterations(problem), 25);
}

// Each of n blocks is coupled with all others: its column has as many as are left.
TEST(FactorOperations, OfAFullMatrixAndOfADiagonalOne) {
  constexpr std::uint32_t kRows = 12;
  BlockMatrix full, diagonal;
  full.row_offsets = diagonal.row_offsets = {0};
  double squares = 0;
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kRows; ++column) full.columns.push_back(column);
    diagonal.columns.push_back(row);
    full.row_offsets.push_back(full.columns.size());
    diagonal.row_offsets.push_back(diagonal.columns.size());
    squares += row * row;
  }
  full.values.assign(full.columns.size(), Block::Identity());
  diagonal.values.assign(kRows, Block::Identity());
  EXPECT_TRUE(factor_takes_at_most(StoredMatrix(full), 13.5 * squares));
  EXPECT_FALSE(factor_takes_at_most(StoredMatrix(full), 13.5 * squares - 1));
  EXPECT_TRUE(factor_takes_at_most(StoredMatrix(diagonal), 0));
}

}  // namespace
}  // namespace flexel::simulate::test
