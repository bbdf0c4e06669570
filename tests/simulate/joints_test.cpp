// Joints between rigid parts: known motions, what is kept, what drives do, what is refused.
#include "simulate/joints/joints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "formats/lattice/fused_points.h"
#include "formats/lattice/merge.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "tests/simulate/contact_case.h"
#include "tests/simulate/scene_case.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using std::numbers::pi;
using testing::block;
using testing::book;
using testing::Csv;
using testing::expect_books_close;
using testing::expect_momenta_kept;
using ::testing::HasSubstr;
using testing::kSide;
using testing::throw_part;
using testing::TimedCase;

constexpr double kFreeFall = 9.81;  // m/s2

// Rigid parts of gum, in `time` s, that do not touch.
Scene mechanism(const std::vector<std::string>& parts, double time) {
  Scene scene = testing::scene_of(time);
  scene.get<Contact>().on = false;
  scene.get<RigidParts>().parts = parts;
  return scene;
}

Joint joint_of(JointKind kind, const std::string& first, const std::string& second, const Vec3& at,
               const Vec3& axis = Vec3::Zero()) {
  Joint joint;
  joint.kind = kind;
  joint.name = second.empty() ? first : first + " " + second;
  joint.origin = "scene.toml:1";
  joint.parts = {first, second};
  joint.at = at;
  joint.axis = axis.isZero() ? axis : Vec3(axis.normalized());
  return joint;
}

void join(Scene& scene, Joint joint) {
  scene.get<Joints>().joints.push_back(std::move(joint));
}

Scene joined(const std::string& rest,
             const std::string& more = "[parts.bar]\nrigid = true\n[run]\ntime = \"10 ms\"\n",
             const std::string& head = "") {
  return parse_scene(head +
                         "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = "
                         "\"1000 kg/m3\"\n" +
                         more + rest,
                     "scene.toml");
}

// Where the point of a part that rested at `rest` is: rigid parts move as four of their elements do.
Vec3 place_now(const Body& body, std::size_t part, const Vec3& rest) {
  const std::uint32_t first = body.parts[part].element_begin, last = body.parts[part].element_end;
  Mat3 was = Mat3::Zero(), is = Mat3::Zero();
  int found = 0;
  for (std::uint32_t e = first + 1; e < last && found < 3; ++e) {
    was.col(found) = body.rest[e] - body.rest[first];
    is.col(found) = body.position[e] - body.position[first];
    const double across = found == 0   ? 1.0
                          : found == 1 ? was.col(0).cross(was.col(1)).norm()
                                       : std::abs(was.determinant());
    if (across > 1e-12) ++found;
  }
  return body.position[first] + is * was.inverse() * (rest - body.rest[first]);
}

// Times at which the column passes `level` upwards.
std::vector<double> crossings(const Csv& history, const std::string& column, double level) {
  const std::vector<double>&time = history.column("time"), &value = history.column(column);
  std::vector<double> times;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (value[i - 1] < level && value[i] >= level)
      times.push_back(time[i - 1] +
                      (time[i] - time[i - 1]) * (level - value[i - 1]) / (value[i] - value[i - 1]));
  return times;
}

// Largest change of kinetic energy and that in the field of gravity, beside the largest kinetic energy.
double energy_swing(const Csv& history) {
  const std::vector<double>&kinetic = history.column("kinetic"), &potential = history.column("potential");
  double largest = 0, swing = 0;
  for (std::size_t i = 0; i < kinetic.size(); ++i) {
    largest = std::max(largest, kinetic[i]);
    swing = std::max(swing, std::abs(kinetic[i] + potential[i] - kinetic[0] - potential[0]));
  }
  return swing / largest;
}

constexpr double kPendulum = 10 * kSide, kPendulumThick = 2 * kSide;  // of bars
const Vec3 kEnd(0, kPendulumThick / 2, kPendulumThick / 2);

// m d and J + m d^2 of a bar hung at its end.
double squared_swing() {
  const double mass = 1000 * kPendulum * kPendulumThick * kPendulumThick, arm = kPendulum / 2;
  const double inertia = mass / 12 * (kPendulum * kPendulum + kPendulumThick * kPendulumThick);
  return mass * kFreeFall * arm / (inertia + mass * arm * arm);
}

TEST(Joints, APendulumSwingsInTheTimeOfTheCompoundPendulum) {
  const double tilt = 0.02, period = 2 * pi / std::sqrt(squared_swing());
  Scene scene = mechanism({"bar"}, 5.3 * period);
  scene.run.history_every = period / 200;
  scene.get<Gravity>().acceleration = kFreeFall * Vec3(std::cos(tilt), 0, -std::sin(tilt));
  join(scene, joint_of(JointKind::hinge, "bar", "", kEnd, Vec3::UnitY()));
  const TimedCase made = testing::run_timed(block("bar", {10, 2, 2}), scene);
  const std::vector<double> times = crossings(made.history, "bar angle", tilt);
  ASSERT_GE(times.size(), 5u);
  EXPECT_NEAR((times.back() - times.front()) / static_cast<double>(times.size() - 1),
              period * (1 + tilt * tilt / 16), 1e-4 * period);
  expect_books_close(made.result);
  EXPECT_LT((place_now(made.body, 0, kEnd) - kEnd).norm(), 1e-12);
  // what the hinge bears as the bar hangs: its weight, and what keeps it on its circle
  EXPECT_NEAR(made.history.column("bar joint force x")[1],
              -1000 * kPendulum * kPendulumThick * kPendulumThick * kFreeFall, 0.01 * 0.4);
}

TEST(Joints, EnergySwingsWithTheSquareOfTheStep) {
  const auto swing = [&](double step) {
    Scene scene = mechanism({"one", "two", "three", "four", "five"}, 0.3);
    scene.run.step = step;
    scene.run.history_every = 4e-4;
    scene.get<Gravity>().acceleration = Vec3(0, 0, -kFreeFall);
    Body body = block("one", {4, 2, 2});
    const char* names[] = {"one", "two", "three", "four", "five"};
    for (int link = 1; link < 5; ++link)
      append(body, block(names[link], {4, 2, 2}, Vec3(link * 5 * kSide, 0, 0)));
    join(scene, joint_of(JointKind::hinge, "one", "", Vec3(-kSide / 2, kSide, kSide), Vec3::UnitY()));
    for (int link = 1; link < 5; ++link)
      join(scene, joint_of(JointKind::hinge, names[link - 1], names[link],
                           Vec3((5 * link - 0.5) * kSide, kSide, kSide), Vec3::UnitY()));
    const TimedCase made = testing::run_timed(std::move(body), scene);
    for (std::size_t link = 1; link < 5; ++link) {
      const Vec3 at((5.0 * static_cast<double>(link) - 0.5) * kSide, kSide, kSide);
      EXPECT_LT((place_now(made.body, link - 1, at) - place_now(made.body, link, at)).norm(), 1e-11);
      EXPECT_NEAR(place_now(made.body, link, at).y(), kSide, 1e-11) << "the axes stay what they were";
    }
    return energy_swing(made.history);
  };
  // steps that the bound lets be
  const double coarse = swing(4e-5), fine = swing(2e-5);
  EXPECT_LT(coarse, 1e-2);
  EXPECT_NEAR(coarse / fine, 4, 0.8);
}

TEST(Joints, AFreePairKeepsItsMomenta) {
  Body pair = block("one", {2, 4, 3});
  append(pair, block("two", {3, 2, 2}, Vec3(3 * kSide, 0, 0)));
  const Vec3 at(2.5 * kSide, kSide, kSide), speed(0.1, -0.2, 0.05), axis(1, 2, 3);
  for (const JointKind kind : {JointKind::ball, JointKind::hinge, JointKind::slider}) {
    Scene scene = mechanism({"one", "two"}, 0.3);
    scene.run.step = 1e-4;
    const Vec3 spin(3, 20, -5);
    const Vec3 more = kind == JointKind::ball    ? Vec3(10, -15, 8)
                      : kind == JointKind::hinge ? Vec3(10 * axis.normalized())
                                                 : Vec3::Zero();
    throw_part(scene, "one", speed, spin, at);
    throw_part(scene, "two", speed + (kind == JointKind::slider ? 0.2 : 0.0) * axis.normalized(), spin + more,
               at);
    join(scene, joint_of(kind, "one", "two", at, kind == JointKind::ball ? Vec3::Zero() : axis));
    const TimedCase made = testing::run_timed(pair, scene);
    expect_momenta_kept(made.history, 1e-9);
    const std::vector<double>& kinetic = made.history.column("kinetic");
    for (const double each : kinetic) ASSERT_NEAR(each, kinetic[0], 2e-4 * kinetic[0]);
    const Vec3 first = place_now(made.body, 0, at), second = place_now(made.body, 1, at);
    const Vec3 far = at + 0.05 * axis.normalized();
    if (kind != JointKind::slider) {
      EXPECT_LT((first - second).norm(), 1e-11);
    } else {
      const Vec3 along = (place_now(made.body, 0, far) - first).normalized();
      EXPECT_LT(along.cross(second - first).norm(), 1e-11);
      EXPECT_GT((second - first).norm(), 0.01);
    }
    if (kind != JointKind::ball) {
      EXPECT_LT(((place_now(made.body, 0, far) - first) - (place_now(made.body, 1, far) - second)).norm(),
                1e-11)
          << "the axis is one";
    }
  }
}

TEST(Joints, ASliderFallsAlongItsAxis) {
  Scene scene = mechanism({"box"}, 0.2);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -kFreeFall);
  const Vec3 axis = Vec3(1, 2, -2) / 3;
  join(scene, joint_of(JointKind::slider, "box", "", Vec3(0.1, 0.2, 0), axis));
  const TimedCase made = testing::run_timed(block("box", {2, 3, 4}), scene);
  const double travel = 0.5 * kFreeFall * 2.0 / 3 * 0.04;
  EXPECT_NEAR(made.history.column("box travel").back(), travel, 2e-3 * travel);
  const double slid = axis.dot(made.body.position[0] - made.body.rest[0]);
  EXPECT_NEAR(slid, travel, 2e-3 * travel);
  for (std::size_t e = 0; e < made.body.element_count(); ++e)
    EXPECT_LT((made.body.position[e] - made.body.rest[e] - slid * axis).norm(), 1e-11);
  expect_books_close(made.result);
}

TEST(Joints, AMotorReachesItsSpeedAndItsWorkIsInTheBooks) {
  const double speed = 30, couple = 2e-3, time = 0.5;
  const Vec3 middle(2 * kSide, 2 * kSide, kSide);
  const double mass = 1000 * 32 * std::pow(kSide, 3), inertia = mass / 12 * 2 * std::pow(4 * kSide, 2);
  Scene scene = mechanism({"wheel"}, time);
  Joint motor = joint_of(JointKind::motor, "wheel", "", middle, Vec3::UnitZ());
  motor.speed = speed;
  motor.torque = couple;
  join(scene, motor);
  const TimedCase made = testing::run_timed(block("wheel", {4, 4, 2}), scene);
  const double ramp = speed * inertia / couple;  // s
  ASSERT_LT(ramp, 0.8 * time);
  EXPECT_NEAR(made.history.column("wheel angle").back(), speed * (time - ramp / 2), 2e-3 * speed * time);
  EXPECT_NEAR(made.history.column("kinetic").back(), 0.5 * inertia * speed * speed,
              1e-6 * inertia * speed * speed);
  EXPECT_NEAR(made.history.column("motors work").back(), 0.5 * inertia * speed * speed,
              1e-5 * inertia * speed * speed);
  EXPECT_NEAR(made.history.column("wheel drive")[1], couple, 1e-9 * couple);
  EXPECT_NEAR(made.history.column("wheel drive").back(), 0, 1e-9 * couple);
  expect_books_close(made.result);
  // torque times angle while it runs up
  const std::vector<double>&angle = made.history.column("wheel angle"),
        &work = made.history.column("motors work");
  for (std::size_t i = 0; i < angle.size(); ++i)
    if (made.history.column("time")[i] < 0.9 * ramp) {
      EXPECT_NEAR(work[i], couple * angle[i], 0.02 * couple * speed * ramp);
    }
}

// A couple alone, between two parts that are free: they turn against each other, and the sum stays.
TEST(Joints, ACoupleTurnsAFreePairAgainstEachOther) {
  Body pair = block("one", {4, 4, 2});
  append(pair, block("two", {4, 4, 2}, Vec3(0, 0, 3 * kSide)));
  Scene scene = mechanism({"one", "two"}, 0.2);
  Joint motor =
      joint_of(JointKind::motor, "one", "two", Vec3(2 * kSide, 2 * kSide, 2.5 * kSide), Vec3::UnitZ());
  motor.torque = 1e-3;
  join(scene, motor);
  const TimedCase made = testing::run_timed(std::move(pair), scene);
  const double mass = 1000 * 32 * std::pow(kSide, 3), inertia = mass / 12 * 2 * std::pow(4 * kSide, 2);
  EXPECT_NEAR(made.history.column("one two angle").back(), 1e-3 / inertia * 0.04,
              5e-3 * 1e-3 / inertia * 0.04);
  for (const double each : made.history.column("angular momentum z")) EXPECT_NEAR(each, 0, 1e-15);
  EXPECT_NEAR(made.history.column("motors work").back(), made.history.column("kinetic").back(),
              1e-6 * made.history.column("kinetic").back());
}

// A parallelogram: its coupler does not turn. Hinges in one plane hold three motions twice.
TEST(Joints, AClosedLoopOfFourBarsWorks) {
  Body bars = block("crank", {2, 2, 8});
  append(bars, block("coupler", {14, 2, 2}, Vec3(3 * kSide, 0, 8 * kSide)));
  append(bars, block("rocker", {2, 2, 8}, Vec3(18 * kSide, 0, 0)));
  Scene scene = mechanism({"crank", "coupler", "rocker"}, 0.4);
  Joint motor = joint_of(JointKind::motor, "crank", "", Vec3(kSide, kSide, 0), Vec3::UnitY());
  motor.speed = 2;
  join(scene, motor);
  join(scene, joint_of(JointKind::hinge, "crank", "coupler", Vec3(kSide, kSide, 9 * kSide), Vec3::UnitY()));
  join(scene,
       joint_of(JointKind::hinge, "coupler", "rocker", Vec3(19 * kSide, kSide, 9 * kSide), Vec3::UnitY()));
  join(scene, joint_of(JointKind::hinge, "rocker", "", Vec3(19 * kSide, kSide, 0), Vec3::UnitY()));
  const TimedCase made = testing::run_timed(std::move(bars), scene);
  EXPECT_NEAR(made.history.column("crank angle").back(), 0.8, 1e-9);
  EXPECT_NEAR(made.history.column("rocker angle").back(), 0.8, 1e-8);
  EXPECT_NEAR(made.history.column("crank coupler angle").back(), 0.8, 1e-8);
  const Vec3 corner(19 * kSide, kSide, 9 * kSide);
  EXPECT_LT((place_now(made.body, 1, corner) - place_now(made.body, 2, corner)).norm(), 1e-9);
}

// A crank, a rod and a piston, whose pin drives the rod: it turns against the piston by no more than asin(4 / 14), and the
// motor pushes there with what it has.
TEST(Joints, AMotorStallsWhereTheJointsDoNotLetItTurn) {
  const double couple = 1e-2;
  Body body = block("crank", {6, 2, 2});
  append(body, block("rod", {16, 2, 2}, Vec3(4 * kSide, 3 * kSide, 0)));
  append(body, block("piston", {2, 2, 2}, Vec3(18 * kSide, 0, 0)));
  Scene scene = mechanism({"crank", "rod", "piston"}, 0.4);
  const Vec3 pivot(kSide, kSide, kSide), crank_pin(5 * kSide, kSide, kSide), pin(19 * kSide, kSide, kSide);
  join(scene, joint_of(JointKind::hinge, "crank", "", pivot, Vec3::UnitY()));
  join(scene, joint_of(JointKind::hinge, "crank", "rod", crank_pin, Vec3::UnitY()));
  Joint motor = joint_of(JointKind::motor, "rod", "piston", pin, Vec3::UnitY());
  motor.speed = 3;
  motor.torque = couple;
  join(scene, motor);
  join(scene, joint_of(JointKind::slider, "piston", "", pin, Vec3::UnitX()));
  const TimedCase made = testing::run_timed(std::move(body), scene);
  const std::vector<double>&angle = made.history.column("rod piston angle"),
        &drive = made.history.column("rod piston drive");
  const double farthest = std::asin(4.0 / 14);
  EXPECT_NEAR(*std::max_element(angle.begin(), angle.end()), farthest, 1e-3 * farthest);
  EXPECT_NEAR(*std::max_element(drive.begin(), drive.end()), couple, 1e-9 * couple);
  expect_books_close(made.result);
}

// An event, which makes the joints anew, forgets no whole turns.
TEST(Joints, WholeTurnsAreCountedAcrossEvents) {
  const auto turned = [](const std::string& more) {
    const std::string text =
        "[parts.bar]\nrigid = true\n[run]\ntime = \"20 ms\"\n[[joint]]\nkind = \"motor\"\nparts = "
        "[\"bar\"]\nat = [0, 0, 0]\naxis = [0, 0, 1]\nangle_per_second = \"1000 rad\"\n";
    return testing::run_timed(block("bar", {4, 2, 2}), joined(text, more)).history.column("bar angle").back();
  };
  const double event = turned("[[event]]\nat = \"15 ms\"\ndo = \"edit\"\nstiffness = 2\n");
  EXPECT_NEAR(turned(""), 20, 0.1);
  EXPECT_NEAR(event, turned(""), 0.1);
}

// A pendulum on a tool that is led: what leads it does the work, and feels the pull.
TEST(Joints, ALedToolCarriesAPendulum) {
  Body body = block("tool", {2, 2, 2}, Vec3(0, 0, 11 * kSide));
  append(body, block("bob", {2, 2, 10}));
  Scene scene = mechanism({"bob"}, 0.4);
  Manipulator led;
  led.part = led.name = "tool";
  led.path.time = {0, 0.1, 0.2, 0.3};
  led.path.displacement = {Vec3::Zero(), Vec3(0.004, 0, 0), Vec3(0.012, 0, 0), Vec3(0.016, 0, 0)};
  led.path.turn.assign(4, Vec3::Zero());
  scene.get<RigidParts>().manipulators = {led};
  scene.get<Gravity>().acceleration = Vec3(0, 0, -kFreeFall);
  join(scene, joint_of(JointKind::ball, "bob", "tool", Vec3(kSide, kSide, 10.5 * kSide)));
  const TimedCase made = testing::run_timed(std::move(body), scene);
  expect_books_close(made.result);
  const double mass = 1000 * 40 * std::pow(kSide, 3), tool = 1000 * 8 * std::pow(kSide, 3);
  EXPECT_NEAR(made.history.column("tool force z")[1], (mass + tool) * kFreeFall, 1e-3);
  EXPECT_GT(made.history.column("kinetic").back(), 0);
  const Vec3 at(kSide, kSide, 10.5 * kSide);
  EXPECT_LT((place_now(made.body, 1, at) - at - Vec3(0.016, 0, 0)).norm(), 1e-11);
}

// A bar that hangs by its end from the world falls on a plane, and lies there at the angle that the plane leaves it.
TEST(Joints, AJointedPartLiesOnWhatItFallsOn) {
  Scene scene = mechanism({"bar"}, 0.5);
  scene.get<Contact>().on = true;
  scene.get<Contact>().damping = 1e-3;
  scene.get<Contact>().planes = {testing::plane_at(-0.05)};
  scene.get<Gravity>().acceleration = Vec3(0, 0, -kFreeFall);
  join(scene, joint_of(JointKind::hinge, "bar", "", kEnd, Vec3::UnitY()));
  const TimedCase made = testing::run_timed(block("bar", {10, 2, 2}), scene);
  // the lower corner of the end, 100 mm out and 10 mm below the axis at rest, is on the plane, 60 mm below the axis
  const double reach = std::hypot(0.1, 0.01), angle = std::asin(0.06 / reach) - std::atan2(0.01, 0.1);
  EXPECT_NEAR(made.history.column("bar angle").back(), angle, 0.01);
  EXPECT_LT((place_now(made.body, 0, kEnd) - kEnd).norm(), 1e-11);
  EXPECT_LT(book(made.result, "worst_residual"), 0.01 * book(made.result, "largest_term"));
}

// A bar that an earlier run left turned over: its axis, or what slides, is where it was and points the other way.
TEST(Joints, APartThatIsTurnedOverIsRefused) {
  const Vec3 at(2 * kSide, kSide, kSide);
  for (const auto& [kind, axis] :
       {std::pair{JointKind::hinge, Vec3(Vec3::UnitZ())}, {JointKind::slider, Vec3(Vec3::UnitX())}}) {
    Scene scene = mechanism({"bar"}, 0.01);
    join(scene, joint_of(kind, "bar", "", at, axis));
    Body bar = block("bar", {4, 2, 2});
    EXPECT_EQ(testing::refusal(bar, scene), "accepted");
    for (Vec3& x : bar.position) x = at + Vec3(x.x() - at.x(), at.y() - x.y(), at.z() - x.z());
    EXPECT_THAT(testing::refusal(bar, scene), HasSubstr("turned over"));
  }
}

std::string joint_refusal(const std::string& rest) {
  try {
    (void)joined(rest);
  } catch (const InputError& error) {
    return error.where() + ": " + error.what();
  }
  return "accepted";
}

TEST(Joints, WrongEntriesAreRefusedInOneLine) {
  const std::string at = "at = [0, 0, 0]\n", axis = "axis = [0, 0, 1]\n",
                    bar = "[[joint]]\nparts = [\"bar\"]\n";
  EXPECT_THAT(joint_refusal(bar + at), HasSubstr("kind"));
  EXPECT_THAT(joint_refusal(bar + "kind = \"hinje\"\n" + at), HasSubstr("hinge, slider, ball, motor"));
  EXPECT_THAT(joint_refusal(bar + "kind = \"hinge\"\n" + at), HasSubstr("axis"));
  EXPECT_THAT(joint_refusal(bar + "kind = \"hinge\"\naxis = [0, 0, 0]\n" + at), HasSubstr("axis"));
  EXPECT_THAT(joint_refusal(bar + "kind = \"ball\"\n" + axis + at), HasSubstr("no axis"));
  EXPECT_THAT(joint_refusal(bar + "kind = \"hinge\"\n" + axis), HasSubstr("\"at\""));
  EXPECT_THAT(joint_refusal(bar + "kind = \"hinge\"\ntorque = \"1 N m\"\n" + axis + at),
              HasSubstr("of motors"));
  EXPECT_THAT(joint_refusal(bar + "kind = \"motor\"\n" + axis + at), HasSubstr("angle_per_second"));
  EXPECT_THAT(joint_refusal(bar + "kind = \"motor\"\ntorque = \"-1 N m\"\nangle_per_second = \"1 deg\"\n" +
                            axis + at),
              HasSubstr("above 0"));
  EXPECT_THAT(joint_refusal("[[joint]]\nkind = \"ball\"\nparts = [\"bar\", \"bar\"]\n" + at),
              HasSubstr("with itself"));
  EXPECT_THAT(joint_refusal("[[joint]]\nkind = \"ball\"\nparts = [\"a\", \"b\", \"c\"]\n" + at),
              HasSubstr("one name or two"));
  EXPECT_THAT(joint_refusal("[[joint]]\nkind = \"ball\"\nparts = []\n" + at), HasSubstr("one name or two"));
  const std::string ball = bar + "kind = \"ball\"\n" + at;
  EXPECT_THAT(joint_refusal(ball + ball), HasSubstr("twice"));
}

TEST(Joints, WhatCannotMoveIsRefusedByName) {
  const Body bar = block("bar", {4, 2, 2});
  const std::string hinge = "[[joint]]\nkind = \"hinge\"\naxis = [0, 0, 1]\nat = [0, 0, 0]\nparts = ";
  const std::string run = "[run]\ntime = \"10 ms\"\n";
  EXPECT_EQ(testing::refusal(bar, joined(hinge + "[\"bar\"]\n")), "accepted");
  EXPECT_THAT(testing::refusal(bar, joined(hinge + "[\"bra\"]\n")), HasSubstr("no part"));
  EXPECT_THAT(testing::refusal(bar, joined(hinge + "[\"bar\"]\n", run)),
              HasSubstr("rigid = true in [parts.\"bar\"]"));
  EXPECT_THAT(testing::refusal(bar, joined(hinge + "[\"bar\"]\n", "[[manipulator]]\npart = \"bar\"\n" + run)),
              HasSubstr("no part that is free"));
  EXPECT_THAT(testing::refusal(bar, joined(hinge + "[\"bar\"]\n", "[parts.bar]\nrigid = true\n")),
              HasSubstr("timed runs only"));
  EXPECT_THAT(testing::refusal(bar, joined(hinge + "[\"bar\"]\n",
                                           "[parts.bar]\nrigid = true\n" + run + "method = \"implicit\"\n")),
              HasSubstr("implicit"));
  EXPECT_THAT(
      testing::refusal(bar, joined(hinge + "[\"bar\"]\n[[joint]]\nkind = \"hinge\"\nname = \"two\"\nparts = "
                                           "[\"bar\"]\naxis = [1, 0, 0]\nat = [0, 0, 0]\n")),
      HasSubstr("leave nothing to move"));
  Body moved = bar;
  for (Vec3& position : moved.position) position.x() += 0.001;
  EXPECT_THAT(testing::refusal(moved, joined(hinge + "[\"bar\"]\n")),
              HasSubstr("does not hold where the run begins"));
  EXPECT_THAT(
      testing::refusal(
          bar, joined(hinge + "[\"bar\"]\n[[velocity]]\nwhere = \"bar\"\nvelocity = [\"1 m/s\", 0, 0]\n")),
      HasSubstr("joints would stop"));
  Body pair = bar;
  append(pair, block("base", {4, 2, 2}, Vec3(4 * kSide, 0, 0)));
  const std::string both = "[parts.bar]\nrigid = true\n[parts.base]\nrigid = true\n" + run;
  EXPECT_THAT(testing::refusal(pair, joined(hinge + "[\"bar\", \"base\"]\n", both)),
              HasSubstr("bond = false"));
  EXPECT_EQ(testing::refusal(pair, joined(hinge + "[\"bar\", \"base\"]\n", both, "bond = false\n")),
            "accepted");
}

// What an event of an earlier run fused is bonded as what touches is.
TEST(Joints, PartsThatAnEarlierRunFusedAreRefusedByName) {
  Body pair = block("bar", {4, 2, 2});
  append(pair, block("base", {4, 2, 2}, Vec3(5 * kSide, 0, 0)));
  append(pair, block("arm", {4, 2, 2}, Vec3(-5 * kSide, 0, 0)));
  const auto hinge = [](const std::string& parts) {
    return joined(
        "[[joint]]\nkind = \"hinge\"\naxis = [0, 0, 1]\nat = [0, 0, 0]\nparts = [" + parts + "]\n",
        "[parts.bar]\nrigid = true\n[parts.base]\nrigid = true\n[parts.arm]\nrigid = true\n[run]\ntime = "
        "\"1 ms\"\n");
  };
  const Scene fused = joined("[[event]]\nat = \"0 s\"\ndo = \"fuse\"\nwithin = \"" +
                                 std::to_string(1.5 * kSide) + " m\"\nwhere = [\"bar\", \"base\"]\n",
                             "[run]\ntime = \"1 us\"\n");
  EXPECT_EQ(testing::refusal(pair, hinge("\"bar\", \"base\"")), "accepted");
  (void)testing::simulate_quietly(pair, fused);
  ASSERT_FALSE(fused_points(pair).empty());
  pair.element_columns.erase("velocity");  // what rounding left is not what the joints allow
  EXPECT_THAT(testing::refusal(pair, hinge("\"bar\", \"base\"")),
              ::testing::AllOf(HasSubstr("\"bar\" and \"base\""), HasSubstr("earlier run")));
  EXPECT_THAT(testing::refusal(pair, hinge("\"base\", \"bar\"")), HasSubstr("earlier run"));
  EXPECT_EQ(testing::refusal(pair, hinge("\"bar\", \"arm\"")), "accepted");
  EXPECT_EQ(testing::refusal(pair, hinge("\"bar\"")), "accepted");
}

}  // namespace
}  // namespace flexel::simulate
