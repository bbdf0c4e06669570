// Implicit steps with contact: forces are those of a potential, what rests and slides does so at any step, tools
// press as in explicit steps, nothing is passed through, and what is not taken is refused.
#include "simulate/contact/implicit_contact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <tuple>

#include "base/error.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "simulate/linear/operator.h"
#include "simulate/models/cells.h"
#include "tests/sanitized.h"
#include "tests/simulate/contact_case.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;

Scene implicit(Scene scene, double step) {
  scene.run.method = TimeMethod::implicit_euler;
  scene.run.step = step;
  return scene;
}

double farthest(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t e = 0; e < a.size(); ++e) most = std::max(most, (a[e] - b[e]).norm());
  return most;
}

// Two blocks pressed together and on a plane, at a step that shears them: some pairs stick, some slide.
struct Pressed {
  Body body;
  Problem problem;
  std::optional<Contacts> contacts;
  State before, trial;

  // `shaken` [m]: how far its elements are moved in the step, at most, each its own way.
  Pressed(double friction, double damping, double shaken = 1e-4)
      : body(stacked()), problem(testing::problem_of(body)) {
    ContactSettings settings = all_parts(body);
    settings.friction = friction;
    settings.damping = damping;
    settings.planes.push_back(plane_at(0.0002));
    settings.planes.back().friction = friction;
    contacts.emplace(settings, problem);
    before = starting_at_rest(body);
    EXPECT_EQ(contacts->begin_implicit_step(before, before, 1e-3), 1);
    trial = before;
    const std::vector<Vec3> more = random_displacements(body, shaken, 3);
    for (std::size_t e = 0; e < more.size(); ++e) trial.displacement[e] += more[e];
    (void)contacts->energy(trial);
    (void)contacts->settles(trial);  // friction of the pressure there
  }
  static Body stacked() {
    Body body = block("a", {2, 2, 1});
    append(body, block("b", {2, 2, 1}, Vec3(0.002, 0.003, kSide - 0.0002), turn(0.1, Vec3(0.1, 0.2, 1))));
    return body;
  }
  [[nodiscard]] State along(const std::vector<Vec3>& direction, double way) const {
    State moved = trial;
    for (std::size_t e = 0; e < direction.size(); ++e) moved.displacement[e] += way * direction[e];
    return moved;
  }
  [[nodiscard]] std::vector<Vec3> forces(const State& at, bool normal) {
    std::vector<Vec3> sum(body.element_count(), Vec3::Zero());
    normal ? contacts->add_forces(at, sum) : contacts->add_dissipative_forces(at, sum);
    return sum;
  }
  [[nodiscard]] BlockMatrix matrix() const {
    return stiffness_pattern(body, active_cells(problem), connection_rows({}, body.element_count()),
                             contacts->couples())
        .matrix;
  }
};

double product(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t e = 0; e < a.size(); ++e) sum += a[e].dot(b[e]);
  return sum;
}

TEST(ImplicitContact, ForcesAreMinusTheDerivativeOfThePotentials) {
  Pressed made(0.2, 1e-4);
  const std::vector<Vec3> direction = random_displacements(made.body, 1, 9);
  constexpr double kWay = 1e-9;
  for (const bool normal : {true, false}) {
    const auto potential = [&](double way) {
      const State at = made.along(direction, way);
      return normal ? made.contacts->energy(at) : made.contacts->friction_potential(at);
    };
    const double slope = (potential(kWay) - potential(-kWay)) / (2 * kWay);
    const double power = product(made.forces(made.trial, normal), direction);
    EXPECT_GT(std::abs(power), 1e-3) << normal;
    EXPECT_NEAR(-slope, power, 1e-5 * std::abs(power)) << normal;
  }
}

TEST(ImplicitContact, FrictionsTangentIsTheDerivativeOfItsForces) {
  Pressed made(0.2, 1e-4);
  const std::vector<Vec3> direction = random_displacements(made.body, 1, 9);
  BlockMatrix matrix = made.matrix();
  made.contacts->add_friction_stiffness(made.trial, matrix);
  std::vector<Vec3> expected(direction.size());
  multiply(matrix, direction, expected);
  constexpr double kWay = 1e-10;
  const std::vector<Vec3> ahead = made.forces(made.along(direction, kWay), false),
                          behind = made.forces(made.along(direction, -kWay), false);
  double largest = 0;
  for (const Vec3& each : expected) largest = std::max(largest, each.norm());
  EXPECT_GT(largest, 1);
  for (std::size_t e = 0; e < expected.size(); ++e)
    EXPECT_LT((expected[e] + (ahead[e] - behind[e]) / (2 * kWay)).norm(), 1e-4 * largest) << e;
}

// Of the tangent of the normal forces along `direction`: N/m; how far it is from their derivative, relative.
struct Tangent {
  std::vector<Vec3> image;
  double error = 0;
};

Tangent tangent_along(Pressed& made, const std::vector<Vec3>& direction, ContactTangent kind) {
  BlockMatrix matrix = made.matrix();
  made.contacts->add_normal_stiffness(made.trial, kind, matrix);
  Tangent tangent{std::vector<Vec3>(direction.size()), 0};
  multiply(matrix, direction, tangent.image);
  constexpr double kWay = 1e-9;
  const std::vector<Vec3> ahead = made.forces(made.along(direction, kWay), true),
                          behind = made.forces(made.along(direction, -kWay), true);
  double norm = 0, error = 0;
  for (std::size_t e = 0; e < direction.size(); ++e) {
    norm += tangent.image[e].squaredNorm();
    error += (tangent.image[e] + (ahead[e] - behind[e]) / (2 * kWay)).squaredNorm();
  }
  tangent.error = std::sqrt(error / norm);
  return tangent;
}

// What is left out goes with the energy: it is of second order in the depth.
TEST(ImplicitContact, TheNormalTangentIsTheDerivativeOfTheForces) {
  for (const auto& [deeper, share] : {std::pair{1e-4, 1e-4}, std::pair{8e-4, 3e-3}}) {
    Pressed made(0, 0, deeper);
    for (const unsigned seed : {4u, 5u, 6u}) {
      const std::vector<Vec3> direction = random_displacements(made.body, 1, seed),
                              other = random_displacements(made.body, 1, seed + 10);
      const Tangent whole = tangent_along(made, direction, ContactTangent::whole),
                    positive = tangent_along(made, direction, ContactTangent::positive);
      EXPECT_LT(whole.error, share) << deeper;
      EXPECT_GT(positive.error, 10 * whole.error);
      EXPECT_GE(product(direction, positive.image), 0);
      const double back = product(direction, tangent_along(made, other, ContactTangent::whole).image);
      EXPECT_NEAR(back, product(other, whole.image), 1e-10 * std::abs(back));
    }
  }
}

// Blocks that press, deeper from step to step, until a trial leads them through one another: no place to be, though no
// pair presses any more.
TEST(ImplicitContact, ATrialThatLeadsThroughWhatPressesHasNoEnergy) {
  Body body = block("a", {2, 2, 2});
  append(body, block("b", {2, 2, 2}, Vec3(0, 0, 1.9 * kSide)));
  const Problem problem = problem_of(body);
  Contacts contacts(all_parts(body), problem);
  State at = starting_at_rest(body);
  const auto begin_and_lower = [&] {
    State aimed = at;
    for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
      aimed.displacement[e].z() -= 0.24 * kSide;
    EXPECT_EQ(contacts.begin_implicit_step(at, aimed, 1e-3), 1);
    const double before = contacts.energy(at);
    EXPECT_TRUE(before > 0 && std::isfinite(before));
    at = aimed;
    return contacts.energy(at);
  };
  for (const double depth : {0.34, 0.58, 0.82}) {
    EXPECT_TRUE(std::isfinite(begin_and_lower())) << depth;
    contacts.end_implicit_step(at);
  }
  EXPECT_EQ(begin_and_lower(), std::numeric_limits<double>::infinity());
}

TEST(ImplicitContact, FreeFallAboveAPlaneIsExact) {
  Scene scene = implicit(scene_of(0.04), 0.002);
  scene.get<Gravity>().acceleration = Vec3(0.5, -0.2, -9.81);
  scene.get<Contact>().planes.push_back(plane_at(-0.05));
  const TimedCase made = run_timed(block("a", {2, 2, 2}), scene);
  for (std::size_t e = 0; e < made.body.element_count(); ++e)
    EXPECT_LT(
        (made.body.position[e] - made.body.rest[e] - 0.002 * 0.002 * 210 * Vec3(0.5, -0.2, -9.81)).norm(),
        1e-10);
}

Scene resting(double time, double damping) {
  Scene scene = scene_of(time);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  scene.get<Contact>().planes.push_back(plane_at(0));
  scene.get<Contact>().friction = 0.3;
  scene.get<Contact>().damping = damping;
  scene.get<Damping>().entries.push_back({1e-3, {}, ""});
  return scene;
}

Body stack() {
  Body body = block("a", {3, 3, 2});
  append(body, block("b", {2, 2, 2}, Vec3(0.004, 0.003, 0.02)));
  return body;
}

// With friction there are many places to rest; without it a stack slides apart.
TEST(ImplicitContact, WhatRestsIsWhereExplicitStepsLeaveIt) {
  using Way = std::tuple<const char*, double, double>;
  for (const auto& [model, friction, share] : less_if_sanitized<std::vector<Way>>(
           {{"cells", 0.0, 1e-3}, {"cells", 0.3, 1e-2}, {"springs", 0.3, 1e-2}}, {{"cells", 0.3, 1e-2}},
           "one of three")) {
    Scene scene = resting(0.15, 5e-4);
    scene.model = model;
    scene.get<Contact>().friction = friction;
    const Body body = friction > 0 ? stack() : block("a", {3, 3, 3});
    const TimedCase by_steps = run_timed(body, scene);
    const double sag = farthest(by_steps.body.position, by_steps.body.rest);
    ASSERT_GT(sag, 1e-4 * kSide);
    for (const double step :
         less_if_sanitized<std::vector<double>>({1e-3, 5e-3}, {5e-3}, "one step of two")) {
      const TimedCase made = run_timed(body, implicit(scene, step));
      EXPECT_LT(farthest(made.body.position, by_steps.body.position), share * sag)
          << model << friction << step;
      expect_books_close(made.result);
      EXPECT_LT(book(made.result, "kinetic"), 1e-12 * book(made.result, "elastic"))
          << model << friction << step;
    }
  }
}

// Steps of thousands of stable ones.
TEST(ImplicitContact, ASteelBlockRests) {
  Scene scene = implicit(resting(0.2, 0), 1e-3);
  scene.materials["gum"] = {"gum", 210e9, 0.3, 7850, "test"};
  scene.get<Damping>().entries.clear();
  const TimedCase made = run_timed(block("a", {3, 3, 3}), scene);
  EXPECT_LT(farthest(made.body.position, made.body.rest), 1e-5 * kSide);
  expect_books_close(made.result);
}

// On a slope of 0.3 rad, whose tangent is 0.31.
TimedCase on_a_slope(double friction, double step) {
  const Mat3 tilt = turn(0.3, Vec3::UnitY());
  Scene scene = implicit(scene_of(0.2), step);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  scene.get<Contact>().friction = friction;
  scene.get<Contact>().planes.push_back(plane_at(0, tilt.col(2)));
  return run_timed(block("block", {3, 3, 2}, Vec3::Zero(), tilt * turn(0.4, Vec3::UnitZ())), scene);
}

TEST(ImplicitContact, ASlopeHoldsOrLetsSlideByCoulombsLaw) {
  const Vec3 down = turn(0.3, Vec3::UnitY()).col(0);
  for (const double step : {1e-3, 4e-3}) {
    const auto way = [&](const TimedCase& made) {
      double sum = 0;
      for (std::size_t e = 0; e < made.body.element_count(); ++e)
        sum += (made.body.position[e] - made.body.rest[e]).dot(down);
      return sum / static_cast<double>(made.body.element_count());
    };
    const TimedCase held = on_a_slope(0.4, step), slid = on_a_slope(0.2, step);
    EXPECT_LT(std::abs(way(held)), 1e-3 * kSide) << step;
    const double steps = 0.2 / step, rate = 9.81 * (std::sin(0.3) - 0.2 * std::cos(0.3));
    EXPECT_NEAR(way(slid), rate * step * step * steps * (steps + 1) / 2, 0.02 * way(slid)) << step;
    for (const TimedCase* made : {&held, &slid}) expect_books_close(made->result);
    EXPECT_GT(slid.history.column("contact friction dissipated").back(), 0);
  }
}

// Momentum is kept to Newton's tolerance; a step takes energy, and says so.
TEST(ImplicitContact, ACollisionKeepsMomentum) {
  for (const bool losses : {false, true}) {
    Scene scene = implicit(scene_of(0.02), 5e-4);
    throw_part(scene, "b", Vec3(0.3, -0.1, -1), Vec3(5, 2, 3));
    scene.get<Contact>().friction = losses ? 0.4 : 0;
    scene.get<Contact>().damping = losses ? 1e-4 : 0;
    Body body = block("a", {4, 3, 3});
    append(body, block("b", {3, 3, 3}, Vec3(0.003, 0.002, 0.034), turn(0.2, Vec3(0.1, 0.2, 1))));
    const TimedCase made = run_timed(body, scene);
    double of_a = 0;
    const Column& velocity = made.body.element_columns.at("velocity");
    for (std::uint32_t e = 0; e < made.body.parts[0].element_end; ++e) of_a += velocity.values[3 * e + 2];
    EXPECT_LT(of_a / made.body.parts[0].element_end, -0.2);
    for (const std::string axis : {" x", " y", " z"}) {
      const std::vector<double>& momentum = made.history.column("momentum" + axis);
      EXPECT_NEAR(momentum.back(), momentum.front(), 1e-6 * std::abs(made.history.column("momentum z")[0]));
    }
    expect_books_close(made.result);
    EXPECT_GT(made.history.column("numerical dissipated").back(), 0);
  }
}

// 25 mm a step would lead through the plane: the step is divided.
TEST(ImplicitContact, NothingIsPassedThrough) {
  Scene scene = implicit(scene_of(0.02), 5e-3);
  throw_part(scene, "a", Vec3(0, 0, -5));
  scene.get<Contact>().planes.push_back(plane_at(-0.02));
  const TimedCase made = run_timed(block("a", {2, 2, 2}), scene);
  for (const Vec3& at : made.body.position) EXPECT_GT(at.z(), -0.02 - 0.5 * kSide);
  const Column& velocity = made.body.element_columns.at("velocity");
  double up = 0;
  for (std::size_t e = 0; e < made.body.element_count(); ++e) up += velocity.values[3 * e + 2];
  EXPECT_GT(up, 0);
  expect_books_close(made.result);
}

TEST(ImplicitContact, SameBitsForAnyNumberOfThreads) {
  Scene scene = implicit(resting(0.01, 1e-4), 1e-3);
  std::vector<Vec3> first;
  for (const int threads : {1, 3}) {
    SimulateOptions options;
    options.threads = threads;
    const TimedCase made = run_timed(stack(), scene, options);
    if (first.empty()) first = made.body.position;
    EXPECT_EQ(first, made.body.position);
  }
}

// A plate on a path presses a block into a floor, by a sixth of its height, and turns.
struct Press {
  TimedCase made;
  Vec3 force, torque;  // of what leads the plate, at the end
};

Press press(const std::function<Scene(Scene)>& steps) {
  Body body = block("soft", {5, 5, 3});
  append(body, block("plate", {3, 3, 1}, Vec3(0.011, 0.012, 0.0302)));
  Scene scene = resting(0.15, 2e-4);
  scene.get<Gravity>().acceleration = Vec3::Zero();
  Manipulator tool;
  tool.part = tool.name = "plate";
  tool.path.time = {0, 0.05};
  tool.path.displacement = {Vec3::Zero(), Vec3(0.001, 0, -0.005)};
  tool.path.turn = {Vec3::Zero(), Vec3(0.02, 0.03, 0)};
  scene.get<RigidParts>().manipulators.push_back(tool);
  Press result{run_timed(body, steps(scene)), {}, {}};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    result.force[axis] = result.made.history.column("plate force " + name).back();
    result.torque[axis] = result.made.history.column("plate torque " + name).back();
  }
  return result;
}

TEST(ImplicitContact, AToolPressesAsInExplicitSteps) {
  const Press by_steps = press([](Scene scene) { return scene; });
  ASSERT_LT(by_steps.force.z(), -1);
  for (const double step : less_if_sanitized<std::vector<double>>({1e-3, 5e-3}, {5e-3}, "one step of two")) {
    const Press made = press([&](Scene scene) { return implicit(std::move(scene), step); });
    EXPECT_LT((made.force - by_steps.force).norm(), 0.01 * by_steps.force.norm()) << step;
    EXPECT_LT((made.torque - by_steps.torque).norm(), 0.02 * by_steps.torque.norm()) << step;
    EXPECT_LT(farthest(made.made.body.position, by_steps.made.body.position), 0.01 * 0.005) << step;
    expect_books_close(made.made.result);
  }
}

// A plate of PLA, led along `path`, above a block of it that lies free in space.
TimedCase push(const ManipulatorPath& path, double time, double step, double tolerance) {
  Body body = block("block", {3, 3, 2});
  append(body, block("plate", {2, 2, 1}, Vec3(0.004, 0.005, 0.0201)));
  Scene scene = implicit(scene_of(time), step);
  scene.materials["gum"] = {"gum", 3.5e9, 0.35, 1240, "test"};
  scene.run.tolerance = tolerance;
  scene.get<Contact>().friction = 0.3;
  Manipulator tool;
  tool.part = tool.name = "plate";
  tool.path = path;
  tool.path.turn.assign(path.time.size(), Vec3::Zero());
  scene.get<RigidParts>().manipulators.push_back(tool);
  return run_timed(body, scene);
}

// What moves freely feels forces far below those of a tool led into it before it moves.
TEST(ImplicitContact, AStiffFreeBlockIsPushedAtALooseToleranceAsAtATightOne) {
  for (const double step : {1e-3, 5e-3}) {
    const auto figures = [&](double tolerance) {
      ManipulatorPath path;
      path.time = {0, 0.03};
      path.displacement = {Vec3::Zero(), Vec3(0, 0, -0.009)};
      const TimedCase made = push(path, 0.03, step, tolerance);
      expect_books_close(made.result);
      double most = 0;
      for (const double force : made.history.column("plate force z")) most = std::max(most, std::abs(force));
      return std::array{most, made.history.column("work").back(), made.history.column("kinetic").back()};
    };
    const std::array<double, 3> loose = figures(1e-4), tight = figures(1e-8);
    for (std::size_t f = 0; f < tight.size(); ++f) {
      EXPECT_GT(tight[f], 0);
      EXPECT_NEAR(loose[f], tight[f], 0.01 * tight[f]) << step << " figure " << f;
    }
  }
}

// It would come out on the other side, where nothing touches any more.
TEST(ImplicitContact, AToolThatLeapsThroughAPartIsRefused) {
  for (const auto& [step, begins, takes] :
       {std::tuple{0.01, 0.0, 1e-6}, {0.02, 0.0, 2e-6}, {0.02, 0.0501, 1e-6}}) {
    ManipulatorPath path;
    path.time = {0, begins + takes, 0.1};
    path.displacement = {Vec3::Zero(), Vec3(0, 0, -0.05), Vec3(0, 0, -0.05)};
    if (begins > 0) {
      path.time.insert(path.time.begin() + 1, begins);
      path.displacement.insert(path.displacement.begin(), Vec3::Zero());
    }
    EXPECT_THROW((void)push(path, 0.1, step, 1e-4), DivergedError) << step << begins << takes;
  }
}

// An impact that Newton's method resolves in a few rounds with the dashpots of contacts as without.
TEST(ImplicitContact, DampedContactsSettleAtAnImpact) {
  const auto iterations = [](double damping) {
    Scene scene = implicit(scene_of(0.01), 2e-3);
    throw_part(scene, "b", Vec3(0.5, 0, -2));
    scene.get<Contact>().friction = 0.3;
    scene.get<Contact>().damping = damping;
    Body body = block("a", {3, 3, 2});
    append(body, block("b", {2, 2, 2}, Vec3(0.003, 0.002, 0.0204)));
    const TimedCase made = run_timed(body, scene);
    expect_books_close(made.result);
    return made.result.newton_iterations;
  };
  const int without = iterations(0);
  EXPECT_LT(iterations(2e-4), 2 * without);
}

TEST(ImplicitContact, WhatIsNotTakenIsRefusedByName) {
  const auto refusal = [](const std::function<void(Scene&)>& change) {
    Scene scene = implicit(resting(0.01, 0), 1e-3);
    change(scene);
    try {
      (void)run_timed(stack(), scene);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("taken");
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(refusal([](Scene&) {}), "taken");
  EXPECT_THAT(refusal([](Scene& scene) { scene.get<RigidParts>().parts = {"a"}; }),
              HasSubstr("does not take free rigid parts"));
  EXPECT_THAT(refusal([](Scene& scene) { scene.get<Contact>().stick = 1e3; }), HasSubstr("stick"));
  EXPECT_THAT(refusal([](Scene& scene) { scene.get<Contact>().planes.back().stick = 1e3; }),
              HasSubstr("stick"));
  EXPECT_THAT(refusal([](Scene& scene) { scene.get<Contact>().parting = 0.005; }), HasSubstr("overlap"));
}

}  // namespace
}  // namespace flexel::simulate
