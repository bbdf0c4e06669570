// Rigid motions that a body is left with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
