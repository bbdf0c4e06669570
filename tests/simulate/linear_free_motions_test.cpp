// Rigid motions that a body is left with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <barrier>
#include <thread>

#include "tests/simulate/voxel_problem.h"

namespace flexel::simulate::test {
namespace {

struct Count {
  int translations = 0, rotations = 0;
};

Count count(const std::vector<FreeMotion>& motions, std::uint32_t part = 0) {
  Count result;
  for (const FreeMotion& motion : motions) {
    const bool moves = motion.translation.norm() > 0, turns = motion.rotation.norm() > 0;
    EXPECT_NE(moves, turns);
    EXPECT_NEAR(motion.translation.norm() + motion.rotation.norm(), 1, 1e-12);
    if (motion.part == part) (moves ? result.translations : result.rotations) += 1;
  }
  return result;
}

void pin(VoxelProblem& problem, const std::function<bool(const Index3&)>& where,
         const Mat3& stiffness = Mat3::Identity()) {
  for (std::size_t i = 0; i < problem.matrix.rows(); ++i) {
    if (where(problem.geometry.index[i])) {
      problem.matrix.values[diagonal_position(problem.matrix, i)] += 1e-3 * stiffness;
    }
  }
}

TEST(FreeMotions, AFreeBodyHasSix) {
  for (const Index3& size : {Index3{1, 1, 1}, Index3{30, 2, 1}, Index3{8, 8, 8}, Index3{60, 60, 1}}) {
    const VoxelProblem problem = assemble(carve(size), 1e-3);
    const std::vector<FreeMotion> motions = free_motions(problem.matrix, problem.geometry);
    const Count found = count(motions);
    EXPECT_EQ(found.translations, 3);
    EXPECT_EQ(found.rotations, 3);
    EXPECT_EQ(motions[0].translation, Vec3::UnitX());
    EXPECT_EQ(motions[5].rotation, Vec3::UnitZ());
  }
}

TEST(FreeMotions, AClampedBodyHasNone) {
  for (const double cells : {10., 5000.}) {
    const VoxelProblem problem = beam(cells);
    EXPECT_TRUE(free_motions(problem.matrix, problem.geometry).empty());
  }
}

TEST(FreeMotions, ABodyPinnedAtOneElementTurns) {
  VoxelProblem problem = assemble(carve({40, 6, 4}), 1e-3);
  pin(problem, [](const Index3& index) { return index == Index3{0, 0, 0}; });
  const Count found = count(free_motions(problem.matrix, problem.geometry));
  EXPECT_EQ(found.translations, 0);
  EXPECT_EQ(found.rotations, 3);
}

TEST(FreeMotions, AHingeTurnsAboutItsLine) {
  VoxelProblem problem = assemble(carve({40, 6, 4}), 1e-3);
  pin(problem, [](const Index3& index) { return index[0] == 0 && index[2] == 0; });
  const std::vector<FreeMotion> motions = free_motions(problem.matrix, problem.geometry);
  ASSERT_EQ(motions.size(), 1u);
  EXPECT_NEAR(std::abs(motions[0].rotation[1]), 1, 1e-6);
  EXPECT_EQ(motions[0].translation, Vec3::Zero());
}

TEST(FreeMotions, ASliderKeepsTheDirectionsAlongIt) {
  VoxelProblem problem = assemble(carve({10, 6, 4}), 1e-3);
  pin(
      problem, [](const Index3& index) { return index[2] == 0; }, Vec3(0, 0, 1).asDiagonal());
  const std::vector<FreeMotion> motions = free_motions(problem.matrix, problem.geometry);
  ASSERT_EQ(motions.size(), 3u);
  EXPECT_NEAR(motions[0].translation[0], 1, 1e-9);
  EXPECT_NEAR(motions[1].translation[1], 1, 1e-9);
  EXPECT_NEAR(std::abs(motions[2].rotation[2]), 1, 1e-6);
}

// Two that run the same, each with half of the rows, on threads.
class Pair {
 public:
  explicit Pair(const BlockMatrix& matrix)
      : matrix_(matrix), given_{std::vector<Vec3>(matrix.rows()), std::vector<Vec3>(matrix.rows())} {}

  std::vector<FreeMotion> motions(const NodeGeometry& geometry) {
    std::array<std::vector<FreeMotion>, 2> found;
    std::thread other([&] { found[1] = half(1, geometry); });
    found[0] = half(0, geometry);
    other.join();
    EXPECT_EQ(found[0].size(), found[1].size());
    for (std::size_t m = 0; m < found[0].size(); ++m) {
      EXPECT_EQ(found[0][m].translation, found[1][m].translation);
      EXPECT_EQ(found[0][m].rotation, found[1][m].rotation);
    }
    return found[0];
  }

 private:
  std::vector<FreeMotion> half(std::uint32_t which, const NodeGeometry& geometry) {
    MatrixElsewhere own{{{}}, {}, {}, {}};
    for (std::uint32_t i = which; i < matrix_.rows(); i += 2) own.groups[0].push_back(i);
    for (std::size_t i = 0; i < matrix_.rows(); ++i)
      own.diagonal.emplace_back(matrix_.values[diagonal_position(matrix_, i)].diagonal());
    own.multiply = [&, which](const std::vector<Vec3>& x, std::vector<Vec3>& y) {
      given_[which] = x;
      together_.arrive_and_wait();
      std::vector<Vec3> all(x.size());
      for (std::size_t i = 0; i < x.size(); ++i) all[i] = given_[i % 2][i];
      multiply(StoredMatrix(matrix_), all, y);
      together_.arrive_and_wait();
    };
    own.sum = [&, which](std::span<double> values) {
      sums_[which].assign(values.begin(), values.end());
      together_.arrive_and_wait();
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = sums_[0][i] + sums_[1][i];
      together_.arrive_and_wait();
    };
    return free_motions(own, geometry);
  }

  const BlockMatrix& matrix_;
  std::array<std::vector<Vec3>, 2> given_;
  std::array<std::vector<double>, 2> sums_;
  std::barrier<> together_{2};
};

TEST(FreeMotions, AreThoseOfRowsThatProcessesShareOut) {
  for (const bool hinged : {false, true}) {
    VoxelProblem problem = assemble(carve({40, 6, 4}), 1e-3);
    if (hinged) pin(problem, [](const Index3& index) { return index[0] == 0 && index[2] == 0; });
    const std::vector<FreeMotion> whole = free_motions(problem.matrix, problem.geometry);
    const std::vector<FreeMotion> shared = Pair(problem.matrix).motions(problem.geometry);
    EXPECT_EQ(whole.size(), hinged ? 1u : 6u);
    ASSERT_EQ(shared.size(), whole.size());
    for (std::size_t m = 0; m < whole.size(); ++m) {
      EXPECT_NEAR((shared[m].translation - whole[m].translation).norm(), 0, 1e-6);
      EXPECT_NEAR((shared[m].rotation.cross(whole[m].rotation)).norm(), 0, 1e-6);
    }
  }
}

TEST(FreeMotions, AreToldPartByPart) {
  std::vector<Voxel> voxels = carve({10, 3, 3});
  for (const Voxel& v : carve({10, 3, 3}))
    voxels.push_back({{v.at[0] + 4, v.at[1] + 8, v.at[2]}, 1, 1e-4, 1});
  VoxelProblem problem = assemble(voxels, 1e-3);
  clamp_low_faces(problem, 0, [](const Voxel& v) { return v.part == 0 && v.at[0] == 0; });
  pin(problem, [](const Index3& index) { return index[1] == 8 && index[0] == 4 && index[2] == 0; });
  const std::vector<FreeMotion> motions = free_motions(problem.matrix, problem.geometry);
  EXPECT_EQ(motions.size(), 3u);
  EXPECT_EQ(count(motions, 0).rotations, 0);
  EXPECT_EQ(count(motions, 1).rotations, 3);
}

TEST(FreeMotions, AnEliminatedElementIsNotFree) {
  VoxelProblem problem = assemble(carve({10, 3, 3}), 1e-3);
  const auto fixed = [&](std::size_t i) { return problem.geometry.index[i][0] == 0; };
  for (std::size_t i = 0; i < problem.matrix.rows(); ++i) {
    for (std::uint64_t q = problem.matrix.row_offsets[i]; q < problem.matrix.row_offsets[i + 1]; ++q) {
      const std::uint32_t j = problem.matrix.columns[q];
      if (fixed(i) || fixed(j)) problem.matrix.values[q] = Mat3::Identity() * (i == j);
    }
  }
  EXPECT_TRUE(free_motions(problem.matrix, problem.geometry).empty());
}

}  // namespace
}  // namespace flexel::simulate::test
