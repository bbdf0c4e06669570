// Contact by itself: pairs against brute force, forces against differences of the energy, where surfaces
// meet.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;

TEST(Contact, NeighboursAreThoseOfBruteForce) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (const double reach : {0.02, 0.2, 0.9}) {
    std::vector<Vec3> points;
    for (int i = 0; i < 700; ++i)
      points.emplace_back(coordinate(random), coordinate(random), 0.3 * coordinate(random));
    const Neighbours near =
        neighbours_within(points, reach, [](std::uint32_t i, std::uint32_t j) { return (i + j) % 3 != 0; });
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      std::vector<std::uint32_t> expected;
      for (std::uint32_t j = i + 1; j < points.size(); ++j)
        if ((i + j) % 3 != 0 && (points[i] - points[j]).norm() <= reach) expected.push_back(j);
      const auto found = near.of(i);
      ASSERT_EQ(std::vector<std::uint32_t>(found.begin(), found.end()), expected);
    }
  }
}

// Two blocks that overlap a little, turned against each other, all elements shaken.
struct Shaken {
  Body body = block("a", {3, 3, 2}, Vec3::Zero());
  State state;
  Shaken(double sink, std::uint32_t seed) {
    const Mat3 axes = turn(0.4, Vec3(0.1, 0.05, 1));
    append(body, block("b", {2, 2, 2}, Vec3(0.006, 0.002, 0.02 - sink), axes));
    state = starting_at_rest(body);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> shake(-2e-4, 2e-4);
    for (Vec3& u : state.displacement) u = Vec3(shake(random), shake(random), shake(random));
    for (Vec3& v : state.velocity) v = 1e3 * Vec3(shake(random), shake(random), shake(random));
  }
};

// The list of pairs has a margin and is kept while nothing moves far: on the way of a random walk it gives,
// to the bit, what a list found anew gives.
TEST(Contact, AKeptListGivesWhatAFreshOneGives) {
  Shaken made(2e-4, 11);
  const Problem problem = problem_of(made.body);
  ContactSettings settings = all_parts(made.body);
  settings.planes.emplace_back();
  Contacts kept(settings, problem);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> way(-4e-4, 4e-4);
  std::size_t touched = 0;
  for (int step = 0; step < 30; ++step) {
    const Vec3 drift(way(random), way(random), way(random) - 5e-5);
    for (std::uint32_t e = 0; e < made.body.element_count(); ++e)
      made.state.displacement[e] += (e < made.body.parts[0].element_end ? 0.2 : 1) * drift +
                                    0.02 * Vec3(way(random), way(random), way(random));
    Contacts fresh(settings, problem);
    EXPECT_EQ(kept.touching(made.state), fresh.touching(made.state));
    touched += fresh.touching(made.state).size();
    std::vector<Vec3> one(made.body.element_count(), Vec3::Zero()), other = one;
    kept.add_forces(made.state, one);
    fresh.add_forces(made.state, other);
    ASSERT_EQ(one, other) << step;
  }
  EXPECT_GT(touched, 100u);
}

TEST(Contact, ForcesAreTheDerivativeOfTheEnergy) {
  Shaken made(8e-4, 3);
  const Problem problem = problem_of(made.body);
  Contacts contacts(all_parts(made.body), problem);
  std::vector<Vec3> forces(made.body.element_count(), Vec3::Zero());
  contacts.add_forces(made.state, forces);
  double largest = 0;
  for (const Vec3& force : forces) largest = std::max(largest, force.norm());
  ASSERT_GT(largest, 0);
  const double by = 1e-8;
  for (std::uint32_t e = 0; e < made.body.element_count(); ++e)
    for (int axis = 0; axis < 3; ++axis) {
      State moved = made.state;
      moved.displacement[e][axis] += by;
      double difference = -contacts.energy(moved);
      moved.displacement[e][axis] -= 2 * by;
      difference += contacts.energy(moved);
      ASSERT_NEAR(forces[e][axis], difference / (2 * by), 1e-5 * largest) << e << " " << axis;
    }
}

TEST(Contact, ForcesAndLossesBalanceWithTheirMoments) {
  Shaken made(8e-4, 5);
  const Problem problem = problem_of(made.body);
  ContactSettings settings = all_parts(made.body);
  settings.friction = 0.5;
  settings.damping = 1e-4;
  Contacts contacts(settings, problem);
  for (const bool losses : {false, true}) {
    std::vector<Vec3> forces(made.body.element_count(), Vec3::Zero());
    if (losses)
      contacts.finish_losses(made.state, 1e-5), contacts.add_dissipative_forces(made.state, forces);
    else
      contacts.add_forces(made.state, forces);
    Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
    double size = 0, power = 0;
    for (std::size_t e = 0; e < forces.size(); ++e) {
      sum += forces[e];
      moment += (made.body.rest[e] + made.state.displacement[e]).cross(forces[e]);
      size += forces[e].norm();
      power += forces[e].dot(made.state.velocity[e]);
    }
    ASSERT_GT(size, 0);
    EXPECT_LT(sum.norm(), 1e-12 * size);
    EXPECT_LT(moment.norm(), 1e-12 * size);
    if (losses) {
      EXPECT_LT(power, 0);
    }
  }
}

// The gap [m] along z between a body and the one below it (the first part) at which contact begins.
double first_touch(const Body& body, double apart, const std::vector<ContactPlane>& planes = {}) {
  const Problem problem = problem_of(body);
  ContactSettings settings = all_parts(body);
  settings.planes = planes;
  settings.self = false;
  Contacts contacts(settings, problem);
  const std::uint32_t first = planes.empty() ? body.parts[0].element_end : 0;
  double touching = -0.2 * kSide, free = 0.2 * kSide;
  for (int i = 0; i < 20; ++i) {
    const double gap = 0.5 * (touching + free);
    State state = starting_at_rest(body);
    for (std::uint32_t e = first; e < body.element_count(); ++e)
      state.displacement[e] = Vec3(0, 0, gap - apart);
    (contacts.energy(state) > 0 ? touching : free) = gap;
  }
  return touching;
}

TEST(Contact, FlatFacesMeetWhereTheirSurfacesDoAtAnyAngleToTheLattice) {
  for (const double angle : {0.0, 0.3, 0.7}) {
    // a square of 4 cells that looks along +z, deep in a block turned against it; another above it, turned on
    const auto square = [](double z, bool up, double turned) {
      std::vector<Vec3> vertices;
      for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
        vertices.emplace_back(turn(turned, Vec3::UnitZ()) * Vec3(2 * kSide * x, 2 * kSide * y, z));
      return std::pair(vertices, up ? std::vector<std::vector<std::uint32_t>>{{0, 1, 2, 3}}
                                    : std::vector<std::vector<std::uint32_t>>{{3, 2, 1, 0}});
    };
    const Mat3 axes = turn(angle, Vec3(1, 0.4, 0.2)), other = turn(-0.6 * angle, Vec3(0.2, 1, 0.5));
    const auto below = square(0, true, 0), above = square(0, false, angle);
    Body body = within_block(block("below", {6, 6, 6}, axes * Vec3::Constant(-3.1 * kSide), axes),
                             below.first, below.second);
    append(body, within_block(block("above", {6, 6, 6}, other * Vec3::Constant(-2.8 * kSide), other),
                              above.first, above.second));
    EXPECT_NEAR(first_touch(body, 0), 0, 0.02 * kSide) << angle;
  }
}

// A ball in a block.
Body ball(const std::string& name, double radius, int cells, const Vec3& shift = Vec3::Zero()) {
  return testing::ball_within(
      block(name, {cells, cells, cells}, Vec3::Constant(-0.5 * cells * kSide) + shift), Vec3::Zero(), radius);
}

TEST(Contact, ABallTouchesAPlaneAndABlockWhereItsSurfaceIs) {
  const double radius = 4 * kSide;
  for (const double shift : {0.0, 0.23}) {
    Body alone = ball("ball", radius, 10, shift * kSide * Vec3(1, 0.5, 0.3));
    ContactPlane plane;
    plane.point = Vec3(0, 0, -radius);
    EXPECT_NEAR(first_touch(alone, 0, {plane}), 0, 0.1 * kSide) << shift;
    Body body = block("block", {6, 6, 2}, Vec3(-3.2 * kSide, -2.9 * kSide, -radius - 2 * kSide));
    append(body, std::move(alone));
    EXPECT_NEAR(first_touch(body, 0), 0, 0.1 * kSide) << shift;
  }
}

}  // namespace
}  // namespace flexel::simulate
