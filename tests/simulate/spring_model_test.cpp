// Model `springs`: derivatives, and the errors of notes on accuracy for the paper's cantilever.
#include "simulate/spring_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "formats/error.h"
#include "simulate/scene.h"
#include "simulate/simulate.h"
#include "tests/simulate/box_body.h"

namespace flexel {
namespace {

using ::testing::HasSubstr;

constexpr double kYoung = 12.1e5, kPoisson = 0.25;

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
  const SpringKind kind = spring_kind(turned_cubes(), {"m", kYoung, kPoisson, 580, ""});
  const CellVectors u = random_displacement(0.02);
  const CellVectors forces = cell_forces(kind, u);
  const double step = 1e-6;
  for (std::size_t a = 0; a < 8; ++a)
    for (int axis = 0; axis < 3; ++axis) {
      CellVectors more = u, less = u;
      more[a][axis] += step;
      less[a][axis] -= step;
      EXPECT_NEAR(forces[a][axis], -(cell_energy(kind, more) - cell_energy(kind, less)) / (2 * step),
                  1e-6 * kYoung * 0.01);
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
  const Material material{"m", kYoung, kPoisson, 580, ""};
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

Body cubic_beam(int n) {
  testing::BoxOptions options;
  options.cells = {4 * n, static_cast<int>(std::lround(1.4 * n)), n};
  options.spacing = Vec3::Constant(0.5 / n);
  return testing::box_body(options);
}

Scene bent_springs() {
  Scene scene;
  scene.materials["gum"] = {"gum", kYoung, kPoisson, 580, "test"};
  scene.material = "gum";
  scene.parts["box"].model = "springs";
  Selection start;
  start.kind = Selection::Kind::half_space;
  start.point = Vec3(1e-6, 0, 0);
  start.normal = -Vec3::UnitX();
  scene.get<Ties>().ties.push_back(make_fix(start));
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), Vec3(0, 0, 1e-3)));
  Probe tip;
  tip.where = select_by_name("xmax");
  scene.probes.push_back(tip);
  return scene;
}

// Deflection of the cantilever 2 x `width` x 0.5 m per newton [m/N]: Timoshenko's beam, times what C3D20R
// runs of CalculiX, extrapolated, differ from it (between two widths linearly).
double reference(double width) {
  const double widths[] = {.5, .66666667, .6875, .7, .70833333, .75};
  const double ratios[] = {.98949, .98669, .98632, .98610, .98595, .98522};
  double ratio = ratios[5];
  for (int i = 4; i >= 0; --i)
    if (width <= widths[i + 1] + 1e-9)
      ratio = ratios[i] + (ratios[i + 1] - ratios[i]) * (width - widths[i]) / (widths[i + 1] - widths[i]);
  const double inertia = width * std::pow(0.5, 3) / 12, shear = kYoung / 2 / (1 + kPoisson);
  const double factor = 10 * (1 + kPoisson) / (12 + 11 * kPoisson);
  return ratio * (8 / (3 * kYoung * inertia) + 2 / (factor * shear * width * 0.5));
}

SimulateResult run(Body& body, const Scene& scene) {
  Progress progress("test", Progress::Mode::quiet);
  return simulate(body, scene, {}, progress);
}

// "corners, isotropic t = .1": percent, by cells over the thickness.
TEST(SpringModel, CantileverHasTheErrorsOfTheStudy) {
  for (const auto& [n, percent] :
       {std::pair{2, -23.0}, {3, -12.0}, {4, -7.4}, {6, -3.6}, {8, -2.1}, {12, -1.0}}) {
    Body body = cubic_beam(n);
    const double compliance = run(body, bent_springs()).probes[0].displacement.z() / 1e-3;
    EXPECT_NEAR(100 * (compliance / reference(static_cast<double>(std::lround(1.4 * n)) * 0.5 / n) - 1),
                percent, 1)
        << n;
  }
}

TEST(SpringModel, NeedsCubicCells) {
  testing::BoxOptions options;
  options.spacing = Vec3(1, 1, 1.1);
  Body body = testing::box_body(options);
  try {
    (void)run(body, bent_springs());
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cubic"));
    EXPECT_THAT(error.what(), HasSubstr("--align none"));
  }
}

TEST(SpringModel, LargeDeflectionConverges) {
  Body body = cubic_beam(4);
  Scene scene = bent_springs();
  scene.get<Loads>().loads[0].force = Vec3(0, 0, 1500);
  const SimulateResult result = run(body, scene);
  EXPECT_GT(result.probes[0].displacement.z(), 0.3);
  EXPECT_LE(result.relative_residual, 1e-8);
}

}  // namespace
}  // namespace flexel
