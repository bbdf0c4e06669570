// Model `springs`: derivatives, and the errors of notes on accuracy for the paper's cantilever.
#include "simulate/models/spring_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "base/error.h"
#include "tests/sanitized.h"
#include "tests/simulate/study_beam.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;
using testing::kStudyPoisson;
using testing::kStudyYoung;

Lattice turned_cubes() {
  Lattice lattice;
  lattice.axes =
      (Eigen::AngleAxisd(0.5, Vec3::UnitX()) * Eigen::AngleAxisd(0.4, Vec3::UnitY())).toRotationMatrix();
  lattice.spacing = Vec3::Constant(0.1);
  return lattice;
}

CellVectors random_displacement(double size) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-size, size);
  CellVectors u;
  for (Vec3& each : u) each = Vec3(uniform(engine), uniform(engine), uniform(engine));
  return u;
}

TEST(SpringModel, ForcesAndStiffnessAreTheDerivatives) {
  const SpringKind kind = spring_kind(turned_cubes(), {"m", kStudyYoung, kStudyPoisson, 580, ""});
  const CellVectors u = random_displacement(0.02);
  const CellVectors forces = cell_forces(kind, u);
  const double step = 1e-6;
  for (std::size_t a = 0; a < 8; ++a)
    for (int axis = 0; axis < 3; ++axis) {
      CellVectors more = u, less = u;
      more[a][axis] += step;
      less[a][axis] -= step;
      EXPECT_NEAR(forces[a][axis], -(cell_energy(kind, more) - cell_energy(kind, less)) / (2 * step),
                  1e-6 * kStudyYoung * 0.01);
      const Vec3 slope = -(cell_forces(kind, more)[a] - cell_forces(kind, less)[a]) / (2 * step);
      Vec3 column = Vec3::Zero();
      for (const Spring& spring : kind.springs)
        if (spring.a == a || spring.b == a) column += spring_block(spring, u, false).col(axis);
      EXPECT_LT((slope - column).norm(), 1e-6 * column.norm());
    }
}

// Uniform strains give the energy of the isotropic material with Poisson's ratio 1/4, in every direction.
TEST(SpringModel, UniformStrainHasTheIsotropicEnergy) {
  const Lattice lattice = turned_cubes();
  const Material material{"m", kStudyYoung, kStudyPoisson, 580, ""};
  const SpringKind kind = spring_kind(lattice, material);
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 20; ++round) {
    Mat3 strain;
    for (int i = 0; i < 9; ++i) strain(i / 3, i % 3) = 1e-6 * uniform(engine);
    strain = (0.5 * (strain + strain.transpose())).eval();
    CellVectors u;
    for (int a = 0; a < 8; ++a)
      u[static_cast<std::size_t>(a)] = strain * lattice.to_world(Vec3(a & 1, a >> 1 & 1, a >> 2));
    const double density = 0.5 * lame_lambda(material) * strain.trace() * strain.trace() +
                           shear_modulus(material) * strain.squaredNorm();
    EXPECT_NEAR(cell_energy(kind, u) / (1e-3 * density), 1, 1e-4);
  }
}

// "corners, isotropic t = .1": percent, by cells over the thickness.
TEST(SpringModel, CantileverHasTheErrorsOfTheStudy) {
  const int finest = less_if_sanitized(12, 6, "up to 6 elements over the thickness");
  for (const auto& [n, percent] :
       {std::pair{2, -23.0}, {3, -12.0}, {4, -7.4}, {6, -3.6}, {8, -2.1}, {12, -1.0}}) {
    if (n > finest) break;
    EXPECT_NEAR(testing::springs_error(n), percent, 1) << n;
  }
}

TEST(SpringModel, NeedsCubicCells) {
  testing::BoxOptions options;
  options.spacing = Vec3(1, 1, 1.1);
  Body body = testing::box_body(options);
  try {
    (void)testing::simulate_quietly(body, testing::held_beam("springs"));
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cubic"));
    EXPECT_THAT(error.what(), HasSubstr("--align none"));
  }
}

TEST(SpringModel, LargeDeflectionConverges) {
  Body body = testing::corner_beam(4);
  Scene scene = testing::held_beam("springs");
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), Vec3(0, 0, 1500)));
  const SimulateResult result = testing::simulate_quietly(body, scene);
  EXPECT_GT(result.largest_displacement, 0.3);
  EXPECT_LE(result.relative_residual, 1e-8);
}

}  // namespace
}  // namespace flexel::simulate
