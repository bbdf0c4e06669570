// Model `quadratic`: what it has to reproduce exactly, closed forms, books, and what it refuses.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "base/math/dense.h"
#include "formats/lattice/cell_moments.h"
#include "formats/lattice/quadratic_field.h"
#include "simulate/laws/elasticity.h"
#include "simulate/quadratic/corotation.h"
#include "simulate/quadratic/quadratic_solve.h"
#include "tests/sanitized.h"
#include "tests/simulate/law_materials.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

constexpr double kYoung = 1e6;  // Pa

std::string material(double poisson) {
  return fmt::format(
      "material = \"gum\"\nmodel = \"quadratic\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = {}\n"
      "density = \"1000 kg/m3\"\n",
      poisson);
}

constexpr const char* kDrawn = R"(
[[fix]]
where = "x0"
axes = "x"
[[fix]]
where = { sphere = { centre = [0, 0, 0], radius = "1 mm" } }
[[fix]]
where = { sphere = { centre = [0, "20 mm", 0], radius = "1 mm" } }
axes = "z"
[[probe]]
name = "end"
where = "x1"
)";

std::string pull(const Vec3& force) {
  return fmt::format("[[load]]\nwhere = \"x1\"\nforce = [\"{} N\", \"{} N\", \"{} N\"]\n", force.x(),
                     force.y(), force.z());
}

SimulateResult run(Body& body, const std::string& scene, bool estimate = false, int threads = 0) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.estimate = estimate;
  options.threads = threads;
  return simulate(body, parse_scene(scene, "s.toml"), options, progress);
}

// 40 x 20 x 20 mm; or its upper layer of cells filled up to `share` only, moments and surface with it.
Body bar(double share = 1) {
  Body body = testing::box_body({.cells = {4, 2, 2}, .spacing = Vec3::Constant(0.01)});
  if (share == 1) return body;
  for (Vec3& vertex : body.surface.vertices)
    if (vertex.z() > 0.015) vertex.z() = 0.01 * (1 + share);
  // integrals of the Lagrange polynomials up to the cut, by Gauss's rule on [0, share]
  std::array<double, kMomentPoints> below{};
  for (std::size_t g = 0; g < kMomentPoints; ++g) {
    const auto value = lagrange_at(share * kGaussPoints[g]);
    for (std::size_t l = 0; l < kMomentPoints; ++l) below[l] += share * kGaussWeights[g] * value[l];
  }
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (body.lattice_index[body.cell_elements[c][0]][2] == 0) continue;
    body.fill[c] = share;
    body.moment_cells.push_back(c);
    for (std::size_t k = 0; k < kMoments; ++k)
      body.moments.push_back(kGaussWeights[k % 5] * kGaussWeights[k / 5 % 5] * below[k / 25]);
  }
  return body;
}

TEST(QuadraticShape, ReproducesQuadraticFieldsAndTheirGradients) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-0.3, 1.3);
  const auto field = [](const Vec3& p) {
    return 1 + p.x() - 2 * p.y() * p.z() + 3 * p.x() * p.x() * p.z() * p.z();
  };
  for (int round = 0; round < 20; ++round) {
    const Vec3 at(any(random), any(random), any(random));
    const QuadraticShape shape = quadratic_shape(at);
    double value = 0;
    Vec3 gradient = Vec3::Zero();
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      const double node = field(
          0.5 * Vec3(static_cast<double>(n % 3), static_cast<double>(n / 3 % 3), static_cast<double>(n / 9)));
      value += node * shape.value[n];
      gradient += node * shape.gradient[n];
    }
    EXPECT_NEAR(value, field(at), 1e-12);
    constexpr double step = 1e-6;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 away = step * Vec3::Unit(axis);
      EXPECT_NEAR(gradient[axis], (field(at + away) - field(at - away)) / (2 * step), 1e-7);
    }
  }
}

// An even stress is exact, in cells that the surface cuts too, however little matter they hold.
TEST(Quadratic, PatchTest) {
  for (const double share : {1.0, 0.6, 0.1, 0.02}) {
    Body body = bar(share);
    const double area = 0.02 * 0.01 * (1 + share), force = 2e-4;
    const SimulateResult result = run(body, material(0.3) + kDrawn + pull({force, 0, 0}));
    const double strain = force / area / kYoung;
    EXPECT_NEAR(result.probes[0].displacement.x() / (strain * 0.04), 1, 2e-6) << share;
    EXPECT_NEAR(result.elastic_energy / (0.5 * force * strain * 0.04), 1, 2e-6) << share;
    ASSERT_TRUE(result.stress);
    EXPECT_NEAR(result.stress->value / (force / area), 1, 1e-3) << share;  // 1e-6 beside a fill of .02
    EXPECT_LT(result.imbalance.norm(), 1e-7 * force);
    EXPECT_LT(result.moment_imbalance.norm(), 1e-6 * force * 0.02);
  }
}

// Stretched by its own weight a bar has a quadratic displacement, which the model holds: rho g L^2 / (2 E).
TEST(Quadratic, HangingBarIsExact) {
  for (const double share : {1.0, 0.4}) {
    Body body = bar(share);
    const SimulateResult result =
        run(body, material(0) +
                      "[[fix]]\nwhere = \"x0\"\n[gravity]\nacceleration = [\"10 m/s2\", 0, 0]\n"
                      "[[probe]]\nname = \"end\"\nwhere = \"x1\"\n");
    EXPECT_NEAR(result.probes[0].displacement.x() / (1000 * 10 * 0.04 * 0.04 / (2 * kYoung)), 1, 1e-5)
        << share;
    EXPECT_NEAR(result.mass, 1000 * 0.04 * 0.02 * 0.01 * (1 + share), 1e-9);
  }
}

// Spread over all elements a force is a weight: the same exact answer.
TEST(Quadratic, ALoadOnAllElementsIsAWeight) {
  for (const double share : {1.0, 0.4}) {
    Body body = bar(share);
    const double mass = 1000 * 0.04 * 0.02 * 0.01 * (1 + share);
    const SimulateResult result =
        run(body, material(0) + fmt::format("[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = {{ box = {{ min = "
                                            "[\"-1 m\", \"-1 m\", \"-1 m\"], "
                                            "max = [\"1 m\", \"1 m\", \"1 m\"] }} }}\nforce = [\"{} N\", 0, "
                                            "0]\n[[probe]]\nname = \"end\"\nwhere = "
                                            "\"x1\"\n",
                                            10 * mass));
    EXPECT_NEAR(result.probes[0].displacement.x() / (1000 * 10 * 0.04 * 0.04 / (2 * kYoung)), 1, 1e-5)
        << share;
    EXPECT_NEAR(result.reactions[0].force.x() / (-10 * mass), 1, 1e-7);
  }
}

// A remote force on the elements of the end bends the bar as it does on the face of the end, turning with it or not: forces
// whose resultant is the same do, a little away (Saint-Venant).
TEST(Quadratic, AForceOnElementsActsAtItsPoint) {
  for (const double share : {1.0, 0.4})
    for (const char* follower : {"false", "true"}) {
      double found[2];
      int i = 0;
      for (const char* where :
           {"\"x1\"",
            "{ box = { min = [\"39 mm\", \"-1 m\", \"-1 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] } }"}) {
        Body body = bar(share);
        const SimulateResult result = run(
            body,
            material(0.3) +
                fmt::format("[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = {}\nforce = [0, 0, \"1e-4 N\"]\n"
                            "at = [\"80 mm\", \"10 mm\", \"10 mm\"]\ntorque = [\"1e-6 N m\", 0, 0]\n"
                            "follower = {}\n[[probe]]\nname = \"middle\"\nat = [\"25 mm\", \"15 mm\", \"5 "
                            "mm\"]\n",
                            where, follower));
        found[i++] = result.probes[0].displacement.z();
        EXPECT_LT(result.moment_imbalance.norm(), 1e-6 * 1e-4 * 0.08) << where;
      }
      EXPECT_NEAR(found[1] / found[0], 1, 0.01) << share << follower;
    }
}

// 2 x .5 x .5, E = 1, nu = .3: 528.2 +- .2 (CalculiX C3D20R, n = 4, 6, 9, extrapolated).
TEST(Quadratic, CantileverOfOneAndTwoCells) {
  for (const auto& [cells, off] : {std::pair{1, 0.03}, {2, 0.01}}) {
    Body body =
        testing::box_body({.cells = {4 * cells, cells, cells}, .spacing = Vec3::Constant(0.5 / cells)});
    const std::string scene =
        material(0.3) + "[[fix]]\nwhere = \"x0\"\n[[probe]]\nname = \"end\"\nwhere = \"x1\"\n";
    const double force = 1e-3;
    const SimulateResult result = run(body, scene + pull({0, 0, force}));
    EXPECT_NEAR(result.probes[0].displacement.z() * kYoung / force / 528.2, 1, off) << cells;
    EXPECT_NEAR(result.elastic_energy / (0.5 * force * result.probes[0].displacement.z()), 1, 0.02);
    EXPECT_LT(result.imbalance.norm(), 1e-7 * force);
    EXPECT_LT(result.moment_imbalance.norm(), 1e-7 * force * 2);
    EXPECT_TRUE(QuadraticField::is_in(body));
  }
}

TEST(Quadratic, AMoveLeadsItsFace) {
  Body body = bar(0.5);
  const SimulateResult result = run(
      body,
      material(0.3) +
          "[[fix]]\nwhere = \"x0\"\n[[move]]\nwhere = \"x1\"\ndisplacement = [\"0.1 mm\", 0, \"-0.05 mm\"]\n"
          "[[probe]]\nname = \"end\"\nwhere = \"x1\"\n");
  EXPECT_LT((result.probes[0].displacement - Vec3(1e-4, 0, -5e-5)).norm(), 2e-6);
  EXPECT_LT((result.reactions[0].force + result.reactions[1].force).norm(),
            1e-6 * result.reactions[0].force.norm());
  EXPECT_GT(result.reactions[1].force.x(), 0);
}

TEST(Quadratic, OrthotropicBarDrawnAskew) {
  const double c = std::sqrt(0.75), s = 0.5;
  const std::string grain = fmt::format(R"(
material = "grain"
model = "quadratic"
[materials.grain]
law = "orthotropic"
young = ["2 MPa", "0.4 MPa", "0.2 MPa"]
poisson = [0.37, 0.42, 0.47]
shear = ["0.3 MPa", "0.28 MPa", "0.1 MPa"]
density = "500 kg/m3"
[parts.box]
axes = [[{0}, {1}, 0], [-{1}, {0}, 0]]
)",
                                        c, s);
  Body body = bar(0.3);
  const double force = 1e-5, area = 0.02 * 0.013;  // a large one bends the bar back
  const SimulateResult result = run(body, grain + kDrawn + pull({force, 0, 0}));
  Material material = testing::orthotropic_material();
  material.axes << c, -s, 0, s, c, 0, 0, 0, 1;
  const Mat6 compliance = inverse_6(moduli_at_rest(law_of(material)));
  EXPECT_NEAR(result.probes[0].displacement.x() / (force / area * compliance(0, 0) * 0.04), 1, 1e-5);
  EXPECT_NEAR(result.probes[0].displacement.y() /
                  (force / area * (compliance(3, 0) * 0.04 + compliance(1, 0) * 0.01)),
              1, 1e-5);
}

// What a corotational problem of a bar is made of.
struct Turned {
  explicit Turned(Body made)
      : body(std::move(made)),
        scene(parse_scene(material(0.3) + "[[fix]]\nwhere = \"x0\"\naxes = \"xy\"\n", "s.toml")),
        problem{body,
                materials_of_parts(scene, body),
                std::vector<std::uint8_t>(body.cell_count(), 0),
                models_of_parts(scene, body),
                {},
                {},
                {},
                {}},
        system(problem, scene),
        stiffness(system.stiffness(1)),
        cells(system, stiffness, 1) {}

  [[nodiscard]] double energy(const std::vector<Vec3>& u) const {
    double sum = 0;
    for (std::size_t c = 0; c < system.nodes().cells.size(); ++c) {
      const auto local = local_displacement(system.nodes(), c, u, cells.turns()[c]);
      CellColumns values = CellColumns::Zero(), forces;
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        values.block<3, 1>(static_cast<Eigen::Index>(3 * n), 0) = local[n];
      stiffness.cells().elastic_forces(c, values, forces);
      sum += 0.5 * values.col(0).dot(forces.col(0));
    }
    return sum;
  }

  Body body;
  Scene scene;
  Problem problem;
  QuadraticSystem system;
  QuadraticOperator stiffness;
  Corotation cells;
};

// A bar that is bent by `strain` and turned as a whole.
std::vector<Vec3> bent(const QuadraticNodes& nodes, double strain, const Mat3& turn, std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Vec3> u;
  for (const Vec3& rest : nodes.rest) {
    const Vec3 noise(any(random), any(random), any(random));
    const Vec3 local = rest + strain * 100 * Vec3(-rest.x() * rest.z(), 0, 0.5 * rest.x() * rest.x()) +
                       1e-3 * strain * 0.01 * noise;
    u.push_back(turn * local - rest);
  }
  return u;
}

TEST(Corotation, ForcesAreTheDerivativeOfTheEnergy) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  Turned bar_of_cells(bar(0.4));
  const QuadraticNodes& nodes = bar_of_cells.system.nodes();
  const Mat3 turn = Eigen::AngleAxisd(2.5, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  const std::vector<Vec3> u = bent(nodes, 0.05, turn, random);
  const double h = 1e-7;
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<Vec3> direction, left;
    // away from the face that is held, whose forces have no energy
    for (const Vec3& rest : nodes.rest)
      direction.push_back(rest.x() > 0.0101 ? Vec3(any(random), any(random), any(random))
                                            : Vec3(Vec3::Zero()));
    const auto along = [&](double step) {
      std::vector<Vec3> moved = u;
      for (std::size_t n = 0; n < u.size(); ++n) moved[n] += step * direction[n];
      EXPECT_TRUE(bar_of_cells.cells.residual(moved, 0, left));
      return bar_of_cells.energy(moved);
    };
    const double slope = (along(h) - along(-h)) / (2 * h);
    (void)along(0);
    double work = 0, size = 0;
    for (std::size_t n = 0; n < u.size(); ++n) {
      work -= left[n].dot(direction[n]);
      size += left[n].norm() * direction[n].norm();
    }
    EXPECT_NEAR(slope, work, 1e-6 * size);
  }
}

// But for terms of the order of the strain.
TEST(Corotation, TheTangentIsTheDerivativeOfTheForces) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const double strain : {1e-3, 1e-2}) {
    Turned bar_of_cells(bar(0.4));
    const QuadraticNodes& nodes = bar_of_cells.system.nodes();
    const Mat3 turn = Eigen::AngleAxisd(1.2, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
    const std::vector<Vec3> u = bent(nodes, strain, turn, random);
    std::vector<Vec3> direction, before, after, product(nodes.size());
    for (const Vec3& rest : nodes.rest)
      direction.push_back(Vec3(any(random), any(random), any(random)) + 100 * Vec3(0.3, 1, -2).cross(rest));
    const double h = 1e-8;
    const auto moved = [&](double step) {
      std::vector<Vec3> there = u;
      for (std::size_t n = 0; n < u.size(); ++n) there[n] += step * direction[n];
      return there;
    };
    ASSERT_TRUE(bar_of_cells.cells.residual(moved(-h), 1, before));
    ASSERT_TRUE(bar_of_cells.cells.residual(moved(h), 1, after));
    ASSERT_TRUE(bar_of_cells.cells.residual(u, 1, product));
    bar_of_cells.cells.set_tangent(true);
    bar_of_cells.stiffness.forces(direction[0].data(), product[0].data());
    double off = 0, size = 0;
    for (std::size_t n = 0; n < u.size(); ++n) {
      if (nodes.rest[n].x() < 0.0101) continue;  // the support is not where it is held
      const Vec3 slope = (before[n] - after[n]) / (2 * h);
      off += (slope - product[n]).squaredNorm();
      size += slope.squaredNorm();
    }
    EXPECT_LT(std::sqrt(off / size), 2 * strain) << strain;
  }
}

TEST(Corotation, ABarLedAroundKeepsItsShape) {
  Body body = bar(0.4);
  const Body rest = body;
  const SimulateResult result =
      run(body, material(0.3) +
                    "[[move]]\nwhere = \"x0\"\nrotation = { axis = [1, 2, 2], through = "
                    "[\"10 mm\", 0, 0], angle = \"160 deg\" }\n");
  const Mat3 turn =
      Eigen::AngleAxisd(160 * std::numbers::pi / 180, Vec3(1, 2, 2).normalized()).toRotationMatrix();
  const Vec3 through(0.01, 0, 0);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    EXPECT_LT((body.position[e] - through - turn * (rest.rest[e] - through)).norm(), 1e-6);
  EXPECT_LT(result.reactions[0].force.norm(), 1e-6 * kYoung * 4e-4);
  EXPECT_LT(result.stress->value, 1e-5 * kYoung);
}

// A slender cantilever under a force across that keeps its direction: the elastica, integrated by Runge and Kutta's
// method; shear and the end of the bar count for some tenths of a percent. The last one would move by 8 times its size at
// its first stiffness. Thin bars need few iterations too.
TEST(Quadratic, ElasticaOfOneCell) {
  struct Case {
    double load;  // F L^2 / EI
    Vec3 cell;
    int iterations;
  };
  const Case stocky{4, {0.01, 0.01, 0.01}, 20};
  for (const auto& [load, cell, iterations] : less_if_sanitized<std::vector<Case>>(
           {{1, {0.01, 0.01, 0.01}, 10}, stocky, {25, {0.01, 0.01, 0.001}, 130}}, {stocky},
           "one load of three")) {
    const double length = 40 * cell.x(), stiffness = kYoung * cell.y() * std::pow(cell.z(), 3) / 12;
    // theta'' = -load cos(theta), theta(0) = 0, theta'(1) = 0: the slope at the root by bisection
    const auto shoot = [&](double slope, Vec3& tip) {
      constexpr int kSteps = 2000;
      double theta = 0;
      tip.setZero();
      for (int i = 0; i < kSteps; ++i) {
        const double h = 1. / kSteps, middle = theta + 0.5 * h * slope,
                     bend = slope - 0.5 * h * load * std::cos(theta);
        tip += h * Vec3(std::cos(middle), 0, std::sin(middle));
        slope -= h * load * std::cos(middle);
        theta += h * bend;
      }
      return slope;
    };
    Vec3 tip;
    double low = 0, high = 10;
    for (int i = 0; i < 60; ++i) (shoot(0.5 * (low + high), tip) > 0 ? high : low) = 0.5 * (low + high);
    Body body = testing::box_body({.cells = {40, 1, 1}, .spacing = cell});
    const SimulateResult result =
        run(body, material(0) + "[[fix]]\nwhere = \"x0\"\n[[probe]]\nname = \"end\"\nwhere = \"x1\"\n" +
                      pull({0, 0, load * stiffness / (length * length)}));
    const Vec3 moved = result.probes[0].displacement / length + Vec3::UnitX();
    EXPECT_LE(result.newton_iterations, iterations) << load;
    EXPECT_LT((moved - tip).norm(), 0.005) << load << ": " << moved.transpose() << ", " << tip.transpose();
    EXPECT_LT(result.imbalance.norm(), 1e-6 * load * stiffness / (length * length));
  }
}

// Pressed and twisted, it buckles. Foretold stresses stop short of the end, where the true ones arrive.
TEST(Quadratic, ABarThatIsTwistedAsItBucklesIsFollowedToTheEnd) {
  if (sanitized()) GTEST_SKIP() << "the iterations are those of ElasticaOfOneCell, but many";
  constexpr double kShorter = 2e-3;  // m
  Body body = testing::box_body({.cells = {10, 1, 1}, .spacing = {0.01, 0.01, 0.002}});
  const SimulateResult result = run(body, material(0) + R"([[fix]]
where = "x0"
[[move]]
where = "x1"
displacement = ["-2 mm", "0 mm", "0 mm"]
rotation = { axis = [1, 0, 0], through = ["100 mm", "5 mm", "1 mm"], angle = "75 deg" }
)");
  const double straight = 0.5 * kYoung * 0.01 * 0.002 * kShorter * kShorter / 0.1;
  EXPECT_LT(result.elastic_energy, 0.9 * straight);
  ASSERT_EQ(result.reactions.size(), 2U);
  EXPECT_LT(result.imbalance.norm(), 1e-5 * result.reactions[0].force.norm());
  EXPECT_GT(result.smallest_jacobian, 0);
}

TEST(Quadratic, SameBitsForAnyNumberOfThreads) {
  const std::string scene = material(0.45) + "[[fix]]\nwhere = \"x0\"\n" + pull({0, 0, 1e-3});
  Body one = bar(0.4), many = bar(0.4);
  (void)run(one, scene, true, 1);
  (void)run(many, scene, true, 7);
  EXPECT_EQ(one.position, many.position);
  EXPECT_EQ(one.cell_columns.at(kQuadraticColumn).values, many.cell_columns.at(kQuadraticColumn).values);
}

// Two supports on the same nodes: each node's force is told once.
TEST(Quadratic, SupportsOfTheSameNodesShareTheirForce) {
  const std::string at_end =
      "[[fix]]\nwhere = { box = { min = [\"-1 mm\", \"-1 mm\", \"-1 mm\"], max = [\"1 mm\", \"21 mm\", \"21 "
      "mm\"] } }\n";
  Body body = bar();
  const double force = 1e-3;
  const SimulateResult result = run(body, material(0.3) + at_end + at_end + pull({force, 0, 0}));
  EXPECT_LT(result.imbalance.norm(), 1e-7 * force);
  EXPECT_NEAR(result.reactions[0].force.x() / force, -1, 1e-6);
  EXPECT_LT(result.reactions[1].force.norm(), 1e-9 * force);
}

std::string refusal(Body body, const std::string& scene) {
  try {
    (void)run(body, scene);
  } catch (const InputError& error) {
    return error.what();
  } catch (const DivergedError& error) {
    return std::string("diverged: ") + error.what();
  }
  return "accepted";
}

TEST(Quadratic, WhatItDoesNotHaveIsRefusedByName) {
  const std::string held = material(0.3) + "[[fix]]\nwhere = \"x0\"\n" + pull({0, 0, 1e-3});
  EXPECT_EQ(refusal(bar(), held), "accepted");
  EXPECT_THAT(refusal(bar(), held + "[run]\ntime = \"1 ms\"\n"), HasSubstr("it has no [run] time"));
  EXPECT_THAT(refusal(bar(), held + "[contact]\n"), HasSubstr("it has no contact"));
  EXPECT_THAT(refusal(bar(), material(0.3) + pull({1, 0, 0})), HasSubstr("add a [[fix]]"));
  EXPECT_THAT(refusal(bar(), material(0.3) + "[[fix]]\nwhere = \"x0\"\naxes = \"x\"\n" + pull({1e-3, 0, 0})),
              HasSubstr("is free to"));
  EXPECT_THAT(refusal(bar(), held + "[gravity]\nmutual = true\n"), HasSubstr("acts in timed runs only"));
  Body edited = bar();
  edited.cell_columns["stiffness_change"] = {1, std::vector<double>(edited.cell_count(), 1)};
  EXPECT_THAT(refusal(edited, held),
              HasSubstr("what an earlier run left in the body (\"stiffness_change\")"));
  Body cut = bar(0.5);
  cut.moment_cells.clear();
  cut.moments.clear();
  EXPECT_THAT(refusal(cut, held), HasSubstr("voxelize with --moments"));
  EXPECT_THAT(refusal(bar(), material(0.3) + "[[fix]]\nwhere = \"x0\"\n" + pull({0, 0, 40})),
              HasSubstr("use model \"cells\""));
  EXPECT_THAT(refusal(bar(), material(0.3) + "[[fix]]\nwhere = \"x0\"\n" + pull({200, 0, 0})),
              HasSubstr("matter is strained by"));
  EXPECT_THAT(
      refusal(bar(), material(0.3) +
                         "[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = { half_space = { point = [0, 0, 0], "
                         "normal = [-1, 0, 0] } }\npressure = \"1 Pa\"\n"),
      HasSubstr("a pressure needs a face, group or side"));
  EXPECT_THAT(refusal(bar(), "material = \"steel\"\nmodel = \"quadratc\"\n[[fix]]\nwhere = \"x0\"\n"),
              HasSubstr("did you mean \"quadratic\"?"));
}

}  // namespace
}  // namespace flexel::simulate
