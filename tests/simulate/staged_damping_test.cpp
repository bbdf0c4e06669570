// Damping in stages: the stages' polynomial, the impulses that they add up to, and the bound on the damping's rates.
#include "simulate/stepping/staged_damping.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "base/error.h"
#include "base/math/dense.h"
#include "simulate/models/stability.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::forces_in_step;
using testing::shaken;

const Material kGel{"gel", 2e4, 0.3, 1000, "test"};

TEST(StagedDamping, StagesPassTheStepStably) {
  for (const double largest : {0.1, 1.0, 3.7, 8.0, 8.1, 30.0, 1000.0, 1e5}) {
    const std::vector<double> shares = damping_stages(largest);
    double sum = 0;
    for (const double share : shares) sum += share;
    EXPECT_NEAR(sum, 1, 1e-11);
    EXPECT_LT(static_cast<double>(shares.size()), 1.2 + std::sqrt(std::max(largest, 1.0) / 0.85));
    constexpr int kSamples = 4000;
    for (int i = 1; i <= kSamples; ++i) {
      const double z = largest * i / kSamples;
      double p = 1, amplified = 1;
      for (const double share : shares) {
        p *= 1 - share * z;
        amplified = std::max(amplified, std::abs(p));
      }
      ASSERT_LE(std::abs(p), 1) << largest << " " << z;
      ASSERT_GE(2 * z * (1 + p) / (1 - p), StagedDamping::kLeast) << largest << " " << z;
      ASSERT_LT(amplified, std::max(2.0, static_cast<double>(shares.size() * shares.size())));
      if (z < 0.5) {
        ASSERT_NEAR(p, std::exp(-z), 0.31 * z * z);
      }
    }
  }
}

TEST(StagedDamping, RefusesWhatTakesTooManyStages) {
  try {
    (void)damping_stages(1e9);
    FAIL() << "passed";
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("more than 2000 stages"));
  }
  EXPECT_THROW((void)damping_stages(std::nan("")), DivergedError);
}

// A body at rest, one side of which is led away: what acts on each element is what its velocity changes by, the led
// ones as if they were free, and soon all of it moves along.
TEST(StagedDamping, FollowsWhatIsLed) {
  const Body body = box_body({{8, 4, 4}, Vec3::Constant(0.01)});
  for (const Model model : {Model::cells, Model::springs}) {
    const Problem problem = testing::problem_of(body, kGel, model);
    const double dt = 1e-4, tau = 1, rate = 1.1 * tau * cell_frequencies(problem)[0];
    Stepper stepper(problem, {{tau}}, true);
    Constraints led;
    led.mask.assign(body.element_count(), 0);
    led.motion.assign(body.element_count(), {0, 0, 0});
    led.motions.push_back({Vec3(1e-3, 0, 2e-3)});
    led.courses.push_back({{0, 1e-2}, {0, 1}});
    for (std::size_t e = 0; e < body.element_count(); ++e)
      if (body.lattice_index[e][0] == 0) led.mask[e] = 7;
    State state = shaken(body, 0, 10);
    for (Vec3& v : state.velocity) v.setZero();
    PrescribedMotion held(led, body, state);
    StagedDamping damping(stepper, held, true);
    const std::vector<Vec3> outer(body.element_count(), Vec3(0, 1e-5, 0));
    for (int i = 1; i <= 80; ++i) {
      const std::vector<Vec3> before = state.velocity;
      const std::vector<Vec3> elastic = forces_in_step(
          problem,
          [&] {
            State still = state;
            for (Vec3& v : still.velocity) v.setZero();
            return still;
          }(),
          0);
      (void)damping.advance(state, outer, {dt, dt, false}, i * dt, rate);
      double largest = 0;
      for (const Vec3& each : damping.damping_force()) largest = std::max(largest, each.norm());
      for (std::size_t e = 0; e < body.element_count(); ++e) {
        const Vec3 change = stepper.mass()[e] / dt * (state.velocity[e] - before[e]);
        ASSERT_LT((change - elastic[e] - outer[e] - damping.damping_force()[e]).norm(), 1e-9 * largest);
      }
      held.impose(state, stepper.mass(), {dt, dt, false});
    }
    for (const Vec3& v : state.velocity) ASSERT_LT((v - Vec3(0.1, 0, 0.2)).norm(), 0.01);
  }
}

// The eigenvalues of M^-1 D of a cell, deformed and turned at random, are within the bound; at rest it is met.
TEST(StagedDamping, RatesAreBounded) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> one(-1, 1);
  Material rubber = kGel, auxetic = kGel;
  rubber.poisson = 0.4998;
  auxetic.poisson = -0.6;
  for (const auto& [model, gel] : {std::pair(Model::cells, kGel), std::pair(Model::cells, rubber),
                                   std::pair(Model::cells, auxetic), std::pair(Model::springs, kGel)})
    for (const Vec3& spacing : {Vec3(0.01, 0.01, 0.01), Vec3(0.01, 0.013, 0.008)})
      for (const double strain : {0.0, 0.05, 0.2, 0.6}) {
        if (model == Model::springs && spacing.x() != spacing.y()) continue;
        const Body body = box_body({{1, 1, 1}, spacing});
        const Problem problem = testing::problem_of(body, gel, model);
        for (int trial = 0; trial < 20; ++trial) {
          State state = shaken(body, 0, 0);
          Mat3 shape = Mat3::Identity();
          for (int i = 0; i < 9; ++i) shape(i / 3, i % 3) += strain * one(random);
          if (shape.determinant() < 0.1) continue;
          for (std::size_t e = 0; e < 8; ++e) {
            state.displacement[e] = shape * body.rest[e] - body.rest[e];
            for (int c = 0; c < 3; ++c) state.displacement[e][c] += 0.3 * strain * spacing[c] * one(random);
            state.velocity[e].setZero();
          }
          const double tau = 1e-3, mass = gel.density * spacing.prod() / 8;
          const std::vector<Vec3> still = forces_in_step(problem, state, tau);
          Eigen::Matrix<double, 24, 24> rates;
          for (Eigen::Index i = 0; i < 24; ++i) {
            State moving = state;
            moving.velocity[static_cast<std::size_t>(i / 3)][i % 3] = 1;
            const std::vector<Vec3> forces = forces_in_step(problem, moving, tau);
            for (Eigen::Index j = 0; j < 24; ++j)
              rates(j, i) =
                  -(forces[static_cast<std::size_t>(j / 3)] - still[static_cast<std::size_t>(j / 3)])[j % 3] /
                  mass;
          }
          ASSERT_LT((rates - rates.transpose()).norm(), 1e-9 * rates.norm());
          const double largest = eigenvalues_symmetric(rates)[23];
          const double bound = tau * cell_frequencies(problem)[0] *
                               damping_growth(problem, cells_of_parts(problem), state.displacement)[0];
          ASSERT_LE(largest, bound * (1 + 1e-9)) << strain;
          if (strain == 0) {
            ASSERT_NEAR(largest, bound, 1e-9 * bound);
          }
        }
      }
}

}  // namespace
}  // namespace flexel::simulate
