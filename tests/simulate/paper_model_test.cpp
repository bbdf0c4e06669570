// Model `paper`: derivatives, symmetry, momentum, rigid motions, and the errors of the accuracy study for the
// paper's cantilever.
#include "simulate/models/paper_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <random>

#include "base/error.h"
#include "base/math/eigenvalues.h"
#include "simulate/effects/gravity.h"
#include "tests/sanitized.h"
#include "tests/simulate/derivatives.h"
#include "tests/simulate/printed.h"
#include "tests/simulate/study_beam.h"

namespace flexel::simulate {
namespace {

using testing::centre_body;
using testing::CentreOptions;
using testing::half_space;
using ::testing::HasSubstr;
using testing::held_beam;
using testing::kStudyYoung;
using testing::simulate_quietly;

constexpr double kPaperSpacing = 0.1;

CentreOptions notched_box() {
  CentreOptions options;
  options.voxels = {3, 4, 3};
  options.spacing = kPaperSpacing;
  options.axes =
      (Eigen::AngleAxisd(0.5, Vec3::UnitX()) * Eigen::AngleAxisd(0.4, Vec3::UnitY())).toRotationMatrix();
  // A notch, so that not every element has every neighbour.
  options.inside = [](int i, int j, int k) { return !(i == 2 && j == 3 && k > 0); };
  return options;
}

Problem paper_setting(const Body& body, HookeConstant hooke) {
  return {body, {{"gum", kStudyYoung, 0.25, 580, ""}}, {}, {Model::paper}, {hooke}, {}};
}

State random_displaced_state(std::size_t elements, double size) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-size, size);
  State state;
  for (std::size_t e = 0; e < elements; ++e)
    state.displacement.emplace_back(uniform(engine), uniform(engine), uniform(engine));
  return state;
}

class PaperModelOf : public ::testing::TestWithParam<HookeConstant> {};
INSTANTIATE_TEST_SUITE_P(Hooke, PaperModelOf,
                         ::testing::Values(HookeConstant::paper, HookeConstant::ganovelli));

TEST_P(PaperModelOf, ForcesAndStiffnessAreTheDerivatives) {
  const Body body = centre_body(notched_box());
  const Problem problem = paper_setting(body, GetParam());
  Mechanics mechanics(problem, {});
  testing::expect_derivatives(mechanics, random_displaced_state(body.element_count(), 0.2 * kPaperSpacing),
                              kStudyYoung, kPaperSpacing, 5);
}

TEST_P(PaperModelOf, TangentIsSymmetricAndProjectedOneSemiDefinite) {
  const Body body = centre_body(notched_box());
  Mechanics mechanics(paper_setting(body, GetParam()), {});
  State state = random_displaced_state(body.element_count(), 0.1 * kPaperSpacing);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.displacement[e] -= 0.3 * body.rest[e];  // compressed: the tangent itself is indefinite
  const auto size = static_cast<Eigen::Index>(3 * body.element_count());
  const auto dense = [&](bool project) {
    mechanics.assemble(state, {project, nullptr});
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    const BlockMatrix& blocks = mechanics.stiffness();
    for (std::size_t row = 0; row < blocks.rows(); ++row)
      for (std::uint64_t q = blocks.row_offsets[row]; q < blocks.row_offsets[row + 1]; ++q)
        matrix.block<3, 3>(static_cast<Eigen::Index>(3 * row),
                           static_cast<Eigen::Index>(3 * blocks.columns[q])) = blocks.values[q];
    return matrix;
  };
  for (const bool project : {false, true}) {
    const Eigen::MatrixXd matrix = dense(project);
    EXPECT_LT((matrix - matrix.transpose()).norm(), 1e-12 * matrix.norm());
    const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvalues()[0];
    if (project)
      EXPECT_GT(least, -1e-9 * matrix.norm());
    else
      EXPECT_LT(least, -1e-3 * matrix.norm() / static_cast<double>(size));
  }
}

TEST_P(PaperModelOf, KeepsMomentumAndAngularMomentum) {
  const Body body = centre_body(notched_box());
  Mechanics mechanics(paper_setting(body, GetParam()), {});
  const State state = random_displaced_state(body.element_count(), 0.2 * kPaperSpacing);
  const std::vector<Vec3> forces = mechanics.forces(state).total;
  Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
  double size = 0;
  for (std::size_t e = 0; e < forces.size(); ++e) {
    sum += forces[e];
    torque += (body.rest[e] + state.displacement[e]).cross(forces[e]);
    size += forces[e].norm();
  }
  EXPECT_GT(size, 0.01 * kStudyYoung * kPaperSpacing * kPaperSpacing);
  EXPECT_LT(sum.norm(), 1e-13 * size);
  EXPECT_LT(torque.norm(), 1e-13 * size);
}

TEST_P(PaperModelOf, RigidMotionHasNoForce) {
  const Body body = centre_body(notched_box());
  Mechanics mechanics(paper_setting(body, GetParam()), {});
  const Mat3 turn = Eigen::AngleAxisd(2.1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  State state;
  for (const Vec3& x : body.rest) state.displacement.push_back(turn * x + Vec3(3, -1, 2) - x);
  for (const Vec3& force : mechanics.forces(state).total)
    EXPECT_LT(force.norm(), 1e-12 * kStudyYoung * kPaperSpacing * kPaperSpacing);
  EXPECT_LT(mechanics.energy(state), 1e-20 * kStudyYoung);
}

// Uniform stretch along an axis of the lattice, held across: C11 of the homogenised lattice, inside.
TEST_P(PaperModelOf, InsideItHasTheModuliOfTheStudy) {
  CentreOptions options;
  options.voxels = {5, 5, 5};
  options.spacing = kPaperSpacing;
  const Body body = centre_body(options);
  Mechanics mechanics(paper_setting(body, GetParam()), {});
  const double strain = 1e-6;
  State state;
  for (const Vec3& x : body.rest) state.displacement.push_back(Vec3(strain * x.x(), 0, 0));
  mechanics.assemble(state);
  // Force on the middle element by everything at smaller x: the traction on its voxel's face.
  const std::uint32_t middle = 2 + 5 * (2 + 5 * 2);
  double pull = 0;
  const ConnectionRows& rows = mechanics.paper().rows();
  const Connections connections = make_connections(paper_setting(body, GetParam()));
  for (const ConnectionRows::Entry& entry : rows.of(middle)) {
    const ConnectionKind& kind = connections.parts[0].kinds[entry.kind];
    const Vec3 way = entry.sign * kind.rest;
    if (way.x() > 0.5 * kPaperSpacing)
      pull += kind.stiffness * strain * way.x() * way.x() / kind.length * way.x() / kind.length;
  }
  const double c11 = GetParam() == HookeConstant::paper ? 1 + 2 * std::sqrt(2.0) + 4 / std::sqrt(3.0)
                                                        : 1 + 2.0 / 6 + 4.0 / 36;
  EXPECT_NEAR(pull / (strain * kPaperSpacing * kPaperSpacing), c11 * kStudyYoung, 1e-9 * kStudyYoung);
  EXPECT_NEAR(mechanics.forces(state).total[middle].norm() / pull, 0, 1e-6);
  EXPECT_NEAR(axial_stiffness(GetParam()), GetParam() == HookeConstant::paper ? 3.326 : 1.355, 1e-3);
}

TEST(PaperModel, EnergyRefusesMatterTurnedInsideOut) {
  const Body body = centre_body(notched_box());
  PaperModel model(paper_setting(body, HookeConstant::paper));
  State state;
  for (const Vec3& x : body.rest) state.displacement.push_back(Vec3(-2 * x.x(), 0, 0));
  EXPECT_EQ(model.energy(state), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(model.smallest_volume(state).value, -1, 1e-12);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.displacement[e] = Vec3(-0.5 * body.rest[e].x(), 0, 0);
  EXPECT_NEAR(model.smallest_volume(state).value, 0.5, 1e-12);
}

// "centres, k = E l (paper)" and "centres, Ganovelli": percent, by elements over the thickness.
TEST(PaperModel, CantileverHasTheErrorsOfTheStudy) {
  const int finest = less_if_sanitized(12, 6, "up to 6 elements over the thickness");
  for (const auto& [n, percent] :
       {std::pair{2, -13.0}, {3, -44.0}, {4, -54.0}, {6, -61.0}, {8, -65.0}, {12, -67.0}}) {
    if (n > finest) break;
    EXPECT_NEAR(testing::paper_error(n, "paper"), percent, 1) << n;
  }
  for (const auto& [n, percent] :
       {std::pair{2, 30.0}, {3, 3.0}, {4, -6.0}, {6, -13.0}, {8, -16.0}, {12, -18.0}}) {
    if (n > finest) break;
    EXPECT_NEAR(testing::paper_error(n, "ganovelli"), percent, 1) << n;
  }
}

TEST(PaperModel, SameBitsForAnyNumberOfThreads) {
  Scene scene = held_beam("paper");
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), Vec3(0, 20, 500)));
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  Body one = testing::centre_beam(6), two = testing::centre_beam(6);
  (void)simulate_quietly(one, scene, 1);
  (void)simulate_quietly(two, scene, 2);
  for (std::size_t e = 0; e < one.element_count(); ++e) ASSERT_EQ(one.position[e], two.position[e]);
}

TEST(PaperModel, LargeDeflectionBalancesTheLoad) {
  Body body = testing::centre_beam(4);
  Scene scene = held_beam("paper");
  const Vec3 force(100, -50, 3000);
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), force));
  const SimulateResult result = simulate_quietly(body, scene);
  EXPECT_GT(result.largest_displacement, 0.2);
  EXPECT_LE(result.relative_residual, 1e-8);
  EXPECT_LT((result.loads[0].force - force).norm(), 1e-12 * force.norm());
  EXPECT_LT((result.reactions[0].force + force).norm(), 1e-6 * force.norm());
  EXPECT_GT(result.smallest_jacobian, 0.5);
  EXPECT_FALSE(result.smallest_corner_jacobian.has_value());
}

}  // namespace
}  // namespace flexel::simulate
