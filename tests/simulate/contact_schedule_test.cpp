// Pairs that sleep and how softly they begin: contacts that have gone through a motion are those that a checkpoint
// brings back, which look at every pair.
#include <gtest/gtest.h>

#include <random>

#include "simulate/effects/gravity.h"
#include "tests/sanitized.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;

// Blocks that come at each other and at a plane.
Body three_blocks() {
  Body body = block("a", {2, 2, 2});
  append(body, block("b", {2, 1, 2}, kSide * Vec3(0.3, 0.2, 2.4), turn(0.3, Vec3(1, 1, 0))));
  append(body, block("c", {1, 2, 2}, kSide * Vec3(2.5, -0.4, 0.2), turn(0.2, Vec3(0, 0, 1))));
  return body;
}

ContactSettings all_of_contact(const Body& body) {
  ContactSettings settings = all_parts(body);
  settings.friction = 0.4;
  settings.damping = 1e-4;
  settings.planes.push_back(plane_at(-0.3 * kSide, Vec3(0.1, 0, 1).normalized()));
  return settings;
}

// Forces of both kinds at `state`.
std::vector<Vec3> forces_of(Contacts& contacts, const State& state) {
  std::vector<Vec3> forces(state.displacement.size(), Vec3::Zero());
  contacts.add_forces(state, forces);
  contacts.add_dissipative_forces(state, forces);
  return forces;
}

// Parts are led from state to state: thrown about by forces that push them together, turned, squeezed to nearly
// nothing now and then and drawn out again. At every fifth state contacts are made anew from what was remembered:
// they evaluate all pairs, and nothing else may come of it.
TEST(ContactSchedule, WhatGoesOnFromACheckpointHasTheSameBits) {
  const Body body = three_blocks();
  const Problem problem = problem_of(body);
  for (const unsigned seed :
       less_if_sanitized<std::vector<unsigned>>({1, 2, 3}, {1}, "one motion of three")) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> one(-1, 1);
    const auto vector = [&] { return Vec3(one(random), one(random), one(random)); };
    Contacts contacts(all_of_contact(body), problem);
    State state = starting_at_rest(body);
    std::vector<Vec3> centre(3, Vec3::Zero());
    std::vector<Mat3> gradient(3, Mat3::Identity()), rate(3, Mat3::Zero());
    std::vector<Vec3> shift(3, Vec3::Zero()), speed(3, Vec3::Zero());
    for (std::size_t p = 0; p < 3; ++p) {
      const Part& part = body.parts[p];
      for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
        centre[p] += body.rest[e] / (part.element_end - part.element_begin);
    }
    constexpr double kStep = 1e-3;
    std::size_t touched = 0;
    for (int step = 0; step < 400; ++step) {
      for (std::size_t p = 0; p < 3; ++p) {
        if (step % 40 == 0) {  // a new motion, from nearly none to a tenth of a cell a step
          const double fast = std::pow(10, -2 + 1.9 * std::abs(one(random))) * kSide;
          speed[p] = (0.1 * fast * vector() - 0.02 * shift[p]) / kStep;
          for (int column = 0; column < 3; ++column)
            rate[p].col(column) = 0.02 * fast / kSide / kStep * vector();
          if (step % 80 == 0) rate[p] = (Mat3::Identity() - gradient[p]) / (40 * kStep);
        }
        shift[p] += kStep * speed[p];
        gradient[p] += kStep * rate[p];
        const Part& part = body.parts[p];
        for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
          const Vec3 before = state.displacement[e], arm = body.rest[e] - centre[p];
          state.displacement[e] = shift[p] + gradient[p] * arm - arm;
          state.velocity[e] = (state.displacement[e] - before) / kStep;
        }
      }
      state.time = (step + 1) * kStep;
      state.kick = kStep;
      contacts.finish_step(state, kStep);
      contacts.finish_losses(state, kStep);
      if (step % 5 != 0) {
        (void)forces_of(contacts, state);
        continue;
      }
      Contacts anew(all_of_contact(body), problem);
      anew.restore(contacts.memory());
      ASSERT_EQ(anew.energy(state), contacts.energy(state)) << seed << " " << step;
      const std::vector<Vec3> expected = forces_of(anew, state), found = forces_of(contacts, state);
      ASSERT_EQ(found, expected) << seed << " " << step;
      ASSERT_EQ(anew.touching(state), contacts.touching(state));
      touched += contacts.energy(state) > 0 ? 1 : 0;
    }
    EXPECT_GT(touched, 5u);
  }
}

// What falls, bounces, slides and comes to rest hardens, and the books have what that takes.
TEST(ContactSchedule, HardeningIsInTheBooks) {
  const Body body = block("a", {2, 2, 2}, kSide * Vec3(0, 0, 0.6), turn(0.3, Vec3(1, 2, 0)));
  Scene scene = scene_of(0.06);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  scene.get<Contact>().planes.push_back(plane_at(0));
  scene.get<Contact>().friction = 0.3;
  scene.get<Contact>().damping = 2e-4;
  throw_part(scene, "a", Vec3(0.2, 0, -1.5));
  const TimedCase run = testing::run_timed(body, scene);
  const std::vector<double>&hardened = run.history.column("contact hardening dissipated"),
        &residual = run.history.column("residual");
  const double whole = run.history.column("kinetic")[0];
  EXPECT_GT(hardened.back(), 0);
  EXPECT_LT(hardened.back(), 0.02 * whole);
  for (const double each : residual) EXPECT_LT(std::abs(each), 2e-3 * whole);
}

// Glue takes hold of what begins within a hundredth of a cell, where nothing moves yet either.
TEST(ContactSchedule, GlueHoldsWhatBeginsNearlyInTouch) {
  Body body = block("low", {2, 2, 2});
  append(body, block("high", {2, 2, 1}, kSide * Vec3(0, 0, 2.007)));
  Scene scene = scene_of(0.02);
  scene.get<Contact>().stick = 1e5;
  throw_part(scene, "high", Vec3(0, 0, 0.02));
  const TimedCase run = testing::run_timed(body, scene);
  // freely it would be .4 mm up, the lower one still at rest
  const auto height = [&](std::size_t p) {
    const Part& part = run.body.parts[p];
    double sum = 0;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      sum += (run.body.position[e] - run.body.rest[e]).z() / (part.element_end - part.element_begin);
    return sum;
  };
  EXPECT_GT(height(0), 5e-5);
  EXPECT_LT(height(1), 3e-4);
}

}  // namespace
}  // namespace flexel::simulate
