// The paper's beam (Jansson and Vergeest, section 5): 2 x 0.7 x 0.5 m, E = 12.1e5 Pa, clamped at x = 0, a
// transverse force spread over the end at x = 2.
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/conditions/constraints.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "tests/sanitized.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::simulate_quietly;

constexpr double kForce = 1e-3;  // N: the linear regime

Body beam(int n) {
  testing::BoxOptions options;
  options.cells = {4 * n, static_cast<int>(std::lround(1.4 * n)), n};
  options.spacing = Vec3(2.0 / options.cells[0], 0.7 / options.cells[1], 0.5 / options.cells[2]);
  return box_body(options);
}

Scene cantilever(double poisson, const Vec3& force) {
  Scene scene;
  scene.materials["gum"] = {"gum", 12.1e5, poisson, 580, "test"};
  scene.material = "gum";
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("xmin")));
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), force));
  Probe tip;
  tip.name = "tip";
  tip.where = select_by_name("xmax");
  scene.probes.push_back(tip);
  return scene;
}

// Mean displacement of the end along the load, per newton: CalculiX 2.20, C3D20R, extrapolated from n = 2, 4,
// 8 (tests/simulate/reference/beam_ccx.py makes and prints it).
struct Reference {
  double poisson;
  int axis;
  double compliance;  // m/N
};
constexpr Reference kReferences[] = {
    {0.25, 1, 1.66322e-4}, {0.25, 2, 3.11722e-4}, {0.3, 1, 1.65964e-4}, {0.3, 2, 3.10193e-4}};

double tip_compliance(int n, const Reference& reference) {
  Body body = beam(n);
  const SimulateResult result =
      simulate_quietly(body, cantilever(reference.poisson, kForce * Vec3::Unit(reference.axis)));
  return result.probes[0].displacement[reference.axis] / kForce;
}

TEST(Beam, TipWithinOnePercentAtFourCells) {
  for (const Reference& reference : kReferences)
    EXPECT_NEAR(tip_compliance(4, reference) / reference.compliance, 1, 0.01)
        << "nu " << reference.poisson << ", axis " << reference.axis;
}

// Bending is exact; what is left is the clamped end, whose stress is singular along its edges: 7 times less from 2 to 8 cells.
TEST(Beam, ConvergesToTheReference) {
  for (const Reference& reference : kReferences) {
    const double coarse = std::abs(tip_compliance(2, reference) / reference.compliance - 1);
    const double fine = std::abs(tip_compliance(8, reference) / reference.compliance - 1);
    EXPECT_LT(coarse, 0.04);
    EXPECT_LT(fine, 0.003);
    EXPECT_LT(fine, coarse / 5);
  }
}

TEST(Beam, SmallLoadTakesTwoNewtonIterations) {
  Body body = beam(8);
  const SimulateResult result = simulate_quietly(body, cantilever(0.3, kForce * Vec3::UnitZ()));
  EXPECT_LE(result.newton_iterations, 2);
  EXPECT_LE(result.relative_residual, 1e-8);
  EXPECT_EQ(result.unknowns, 3 * body.element_count());  // a fix is stiff ties: it prescribes nothing
}

TEST(Beam, WhatIsPrescribedIsNoUnknown) {
  Constraints constraints;
  EXPECT_EQ(count_unknowns(constraints, 3), 9u);
  constraints.mask = {0, 0b111, 0b010};
  EXPECT_EQ(count_unknowns(constraints, 3), 5u);
}

TEST(Beam, ReactionsBalanceTheLoad) {
  Body body = beam(4);
  const Vec3 force(1, -2, 30);
  const SimulateResult result = simulate_quietly(body, cantilever(0.3, force));
  ASSERT_EQ(result.reactions.size(), 1u);
  EXPECT_LT((result.reactions[0].force + force).norm(), 1e-7 * force.norm());
  EXPECT_LT((result.loads[0].force - force).norm(), 1e-12 * force.norm());
}

TEST(Beam, SameBitsForAnyNumberOfThreads) {
  Body one = beam(8), two = beam(8);
  const Scene scene = cantilever(0.3, Vec3(0, 20, 50));
  (void)simulate_quietly(one, scene, 1);
  (void)simulate_quietly(two, scene, 2);
  for (std::size_t e = 0; e < one.element_count(); ++e) ASSERT_EQ(one.position[e], two.position[e]);
}

// Large deflection of a slender cantilever under a dead end load against the inextensible elastica (Bisshopp
// and Drucker 1945): at F L^2 / (E I) = 1 the tip drops 0.30172 L and draws in 0.05643 L.
TEST(Beam, LargeDeflectionFollowsTheElastica) {
  const int across = less_if_sanitized(4, 2, "two cells through the thickness");
  testing::BoxOptions options;
  options.cells = {50 * across, across, across};
  options.spacing = Vec3::Constant(0.04 / across);
  Body body = box_body(options);
  const double inertia = std::pow(0.04, 4) / 12, length = 2;
  const SimulateResult result =
      simulate_quietly(body, cantilever(0.0, Vec3(0, 0, -12.1e5 * inertia / (length * length))));
  EXPECT_NEAR(-result.probes[0].displacement.z() / length, 0.30172, 0.003);
  EXPECT_NEAR(-result.probes[0].displacement.x() / length, 0.05643, 0.001);
  EXPECT_LT(result.imbalance.norm(), 1e-6 * result.loads[0].force.norm());
}

// A plate held at two edges that bends by more than ten times its thickness: the membrane stresses of a
// linear answer, which are not there in equilibrium, must not be in the way.
TEST(Beam, PlateBendsFarPastItsThicknessInFewIterations) {
  testing::BoxOptions options;
  options.cells = {40, 40, 1};
  options.spacing = Vec3(0.01, 0.01, 0.004);
  Body body = box_body(options);
  Scene scene = cantilever(0.3, Vec3(0, 0, -0.03));
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("box/y0")));
  const SimulateResult result = simulate_quietly(body, scene);
  EXPECT_GT(result.largest_displacement, 10 * 0.004);
  EXPECT_EQ(result.load_steps, 1);
  EXPECT_LE(result.newton_iterations, 12);
  EXPECT_LE(result.relative_residual, 1e-8);
}

}  // namespace
}  // namespace flexel::simulate
