// Rest shapes: free of force where they were taken, forces and stiffness as derivatives of the energy, the
// hot loop against the cells of equilibrium, and parts that were renormalised against parts made that way.
#include "simulate/models/set_rest_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "base/error.h"
#include "simulate/scene/scene.h"
#include "simulate/thermal/free_strain.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/derivatives.h"
#include "tests/simulate/printed.h"
#include "tests/simulate/scene_case.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

using testing::at_rest;
using testing::box_body;
using testing::BoxOptions;
using testing::forces_of;
using ::testing::HasSubstr;
using testing::kGumYoung;
using testing::random_displacements;

constexpr double kRestSpacing = 0.1;

Mat3 turned_axes() {
  return (Eigen::AngleAxisd(0.5, Vec3::UnitX()) * Eigen::AngleAxisd(0.4, Vec3::UnitY())).toRotationMatrix();
}

class RestShapeOf : public ::testing::TestWithParam<Model> {
 protected:
  [[nodiscard]] static Body part() {
    if (GetParam() == Model::paper) {
      testing::CentreOptions options;
      options.voxels = {4, 3, 3};
      options.spacing = kRestSpacing;
      options.axes = turned_axes();
      return testing::centre_body(options);
    }
    BoxOptions options;
    options.cells = {3, 2, 2};
    options.spacing = Vec3::Constant(kRestSpacing);
    options.axes = turned_axes();
    return box_body(options);
  }
  [[nodiscard]] static Problem problem_of(const Body& body) {
    return {body, {{"gum", kGumYoung, 0.25, 1000, ""}}, {}, {GetParam()}, {HookeConstant::paper}, {}};
  }
  // Turned by 2 rad, stretched, and every element off by a tenth of a cell.
  [[nodiscard]] static std::vector<Vec3> deformed(const Body& body, unsigned seed) {
    const Mat3 turn = Eigen::AngleAxisd(2, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
    const Mat3 f = turn * Vec3(1.3, 0.9, 1.1).asDiagonal();
    std::vector<Vec3> u = random_displacements(body, 0.1 * kRestSpacing, seed);
    for (std::size_t e = 0; e < u.size(); ++e) u[e] += f * body.rest[e] - body.rest[e];
    return u;
  }
  [[nodiscard]] static Body renormalised(const std::vector<Vec3>& at) {
    Body body = part();
    renormalise_all(body, problem_of(body), at);
    return body;
  }
  static constexpr double kForce = kGumYoung * kRestSpacing * kRestSpacing;
};
INSTANTIATE_TEST_SUITE_P(Models, RestShapeOf, ::testing::Values(Model::cells, Model::springs, Model::paper));

TEST_P(RestShapeOf, IsFreeOfForceAndEnergy) {
  const std::vector<Vec3> at = deformed(part(), 3);
  const Body body = renormalised(at);
  Mechanics mechanics(problem_of(body), {});
  EXPECT_LT(mechanics.energy({at}), 1e-24 * kForce * kRestSpacing);
  for (const Vec3& force : mechanics.forces({at}).total) EXPECT_LT(force.norm(), 1e-13 * kForce);
  State rest{std::vector<Vec3>(body.element_count(), Vec3::Zero())};
  EXPECT_GT(mechanics.energy(rest), 1e-3 * kForce * kRestSpacing)
      << "the lattice's shape is none of rest now";
}

TEST_P(RestShapeOf, ForcesAndStiffnessAreTheDerivatives) {
  const Body body = renormalised(deformed(part(), 3));
  const Problem problem = problem_of(body);
  Mechanics mechanics(problem, {});
  testing::expect_derivatives(mechanics, {deformed(body, 8)}, kGumYoung, kRestSpacing, 7);
}

TEST_P(RestShapeOf, HotLoopAgreesWithEquilibrium) {
  if (GetParam() == Model::paper) return;  // has no loop of its own
  const Body body = renormalised(deformed(part(), 3));
  const Problem problem = problem_of(body);
  State state = at_rest(body);
  state.displacement = deformed(body, 8);
  Mechanics mechanics(problem, {});
  const std::vector<Vec3> expected = mechanics.forces(state).total;
  KernelEffects plan{{0}};
  plan.rest_shapes = true;
  Stepper stepper(problem, plan, false);
  stepper.read_memory(body.cell_columns);
  const std::vector<Vec3> forces = forces_of(stepper, state);
  double largest = 0;
  for (const Vec3& force : expected) largest = std::max(largest, force.norm());
  EXPECT_GT(largest, 1e-2 * kForce);
  for (std::size_t e = 0; e < forces.size(); ++e)
    EXPECT_LT((forces[e] - expected[e]).norm(), 1e-11 * largest);
  EXPECT_NEAR(*stepper.elastic_energy(state), mechanics.energy(state), 1e-12 * mechanics.energy(state));
  Columns columns = body.cell_columns;
  stepper.write_memory(body.cell_count(), columns);
  for (const auto& [name, column] : body.cell_columns)
    EXPECT_EQ(columns.at(name).values, column.values) << name << ": nothing flows";
}

TEST_P(RestShapeOf, InsideOutIsRefused) {
  Body body = part();
  std::vector<Vec3> u(body.element_count());
  for (std::size_t e = 0; e < u.size(); ++e) u[e] = -2 * body.rest[e];
  try {
    renormalise_all(body, problem_of(body), u);
    FAIL() << "accepted";
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("turned inside out"));
  }
}

// Stretched by half and renormalised: as stiff as one whose cells were made half longer, but for the
// hourglass stiffness, which stays the lattice's: an error of second order.
TEST(RestShape, StretchedBarIsTheLongerOne) {
  const Scene scene = parse_scene(
      "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 kg/m3\"\n"
      "[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = \"x1\"\nforce = [\"0 N\", \"0 N\", \"-1 mN\"]\n",
      "bar.toml");
  Progress progress("test", Progress::Mode::quiet);
  const auto deflection = [&](Body body, int end) {
    const std::vector<Vec3> before = body.position;
    (void)simulate(body, scene, {}, progress);
    double sum = 0;
    int count = 0;
    for (std::size_t e = 0; e < body.element_count(); ++e)
      if (body.lattice_index[e][0] == end) {
        sum += (body.position[e] - before[e]).z();
        ++count;
      }
    return sum / count;
  };
  std::vector<double> error;
  for (const int n : {3, 6}) {
    BoxOptions options;
    options.cells = {3 * n, n, n};
    const double h = 4e-2 / n;
    options.spacing = Vec3(1.5 * h, h, h);
    const double made = deflection(box_body(options), 3 * n);
    options.spacing = Vec3::Constant(h);
    Body body = box_body(options);
    const double plain = deflection(body, 3 * n);
    std::vector<Vec3> u(body.element_count());
    for (std::size_t e = 0; e < u.size(); ++e) {
      u[e] = Vec3(0.5 * body.rest[e].x(), 0, 0);
      body.position[e] += u[e];
    }
    renormalise_all(body, {body, {{"gum", 1e6, 0.3, 1000, ""}}, {}}, u);
    const double stretched = deflection(body, 3 * n);
    error.push_back(std::abs(stretched / made - 1));
    EXPECT_GT(stretched / plain, 2.5) << "of 1.5^3 in bending, 1.5 in shear";
  }
  EXPECT_LT(error[0], 0.06);
  EXPECT_LT(error[1], error[0] / 3);
}

// Bent up by a move, renormalised at equilibrium, and led sideways from there: up stays up.
TEST(RestShape, FrozenBarIsLedFromItsShape) {
  BoxOptions options;
  options.cells = {12, 2, 2};
  options.spacing = Vec3::Constant(1e-2);
  Body body = box_body(options);
  Progress progress("test", Progress::Mode::quiet);
  const std::string head = "material = \"rubber\"\n[[fix]]\nwhere = \"x0\"\n";
  const SimulateResult up = simulate(body,
                                     parse_scene(head + "[[move]]\nwhere = \"x1\"\ndisplacement = [\"free\", "
                                                        "\"0 mm\", \"40 mm\"]\n[run]\nrenormalise = "
                                                        "true\n",
                                                 "up.toml"),
                                     {}, progress);
  EXPECT_GT(up.elastic_energy, 1e-6);
  const std::vector<Vec3> frozen = body.position;
  const SimulateResult still = simulate(
      body,
      parse_scene(head + "[[load]]\nwhere = \"x1\"\nforce = [\"0 N\", \"1 nN\", \"0 N\"]\n", "still.toml"),
      {}, progress);
  EXPECT_LT(still.elastic_energy, 1e-9 * up.elastic_energy);
  for (std::size_t e = 0; e < frozen.size(); ++e) EXPECT_LT((body.position[e] - frozen[e]).norm(), 1e-7);
  const SimulateResult back = simulate(
      body,
      parse_scene(head + "[[move]]\nwhere = \"x1\"\ndisplacement = [\"0 mm\", \"20 mm\", \"0 mm\"]\n",
                  "side.toml"),
      {}, progress);
  double y = 0, z = 0;
  int count = 0;
  for (std::size_t e = 0; e < frozen.size(); ++e)
    if (body.lattice_index[e][0] == 12) {
      y += body.position[e].y() - frozen[e].y();
      z += body.position[e].z() - frozen[e].z();
      ++count;
    }
  EXPECT_NEAR(y / count, 20e-3, 0.2e-3);
  EXPECT_NEAR(z / count, 0, 0.2e-3);
  EXPECT_GT(back.elastic_energy, 0);
}

// An even free strain of a free body: at a share of the load it is at rest where that share of it has moved it.
TEST(GrowingFreeStrain, IsFreeOfForceAtItsShare) {
  BoxOptions options;
  options.cells = {3, 2, 2};
  options.spacing = Vec3::Constant(kRestSpacing);
  options.axes = turned_axes();
  Body body = box_body(options);
  const Mat3& axes = body.parts[0].lattice.axes;
  // G - I: xx, yy, zz, xy, yz, zx; the same all over a cell
  const double strain[18] = {0.2, -0.1, 0.05, 0.04, -0.03, 0.02};
  Column& column = body.cell_columns[kFreeStrainColumn];
  column.components = 18;
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    column.values.insert(column.values.end(), std::begin(strain), std::end(strain));
  Mat3 change;
  change << strain[0], strain[3], strain[5], strain[3], strain[1], strain[4], strain[5], strain[4], strain[2];
  change = axes * change * axes.transpose();
  Mechanics mechanics(
      {body, {{"gum", kGumYoung, 0.25, 1000, ""}}, {}, {Model::cells}, {HookeConstant::paper}, {}}, {});
  ASSERT_TRUE(mechanics.has_free_strain());
  const double scale = kGumYoung * kRestSpacing * kRestSpacing;
  for (const bool grows : {true, false})
    for (const double share : {0.0, 0.4, 1.0}) {
      mechanics.grow_free_strain(grows);
      State state{std::vector<Vec3>(body.element_count()), share};
      const Mat3 free = (Mat3::Identity() + (grows ? share : 1) * change).inverse() - Mat3::Identity();
      for (std::size_t e = 0; e < body.element_count(); ++e) state.displacement[e] = free * body.rest[e];
      EXPECT_LT(mechanics.energy(state), 1e-24 * scale * kRestSpacing) << grows << share;
      for (const Vec3& force : mechanics.forces(state).total) EXPECT_LT(force.norm(), 1e-12 * scale);
      state.displacement = random_displacements(body, 0.05 * kRestSpacing, 5);
      testing::expect_derivatives(mechanics, state, kGumYoung, kRestSpacing, 7);
    }
}

}  // namespace
}  // namespace flexel::simulate
