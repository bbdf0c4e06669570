// Parts that begin inside each other, or join so: refused, or let out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "base/error.h"
#include "formats/lattice/body_file.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/input/scene_selection.h"
#include "tests/sanitized.h"
#include "tests/scratch.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;
using ::testing::HasSubstr;

TEST(Contact, PartsThatBeginInsideEachOtherAreRefused) {
  const auto refusal = [](const Vec3& origin, double floor) {
    Body body = block("a", {3, 3, 3}, Vec3::Zero());
    append(body, block("b", {3, 3, 3}, origin));
    Scene scene = scene_of(1e-4);
    scene.get<Contact>().planes.emplace_back();
    scene.get<Contact>().planes[0].name = "floor";
    scene.get<Contact>().planes[0].point = Vec3(0, 0, floor);
    try {
      (void)testing::run_timed(std::move(body), scene);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(Vec3(0, 0, 3 * kSide), 0), "");
  EXPECT_EQ(refusal(Vec3(3 * kSide, 0.004, 0), 0), "");
  EXPECT_THAT(refusal(Vec3(0, 0, 2.9 * kSide), 0), HasSubstr("parts \"a\" and \"b\" overlap by 1 mm"));
  EXPECT_THAT(refusal(Vec3(0.003, 0.002, 1.5 * kSide), 0), HasSubstr("overlap"));
  EXPECT_THAT(refusal(Vec3(0, 0, 3 * kSide), 0.2 * kSide), HasSubstr("inside floor"));
}

TEST(Contact, PartsThatBeginInsideEachOtherAreLetOutGently) {
  Body body = block("a", {2, 2, 2}, Vec3::Zero());
  append(body, block("b", {2, 2, 2}, Vec3(0.002, 0, 1.6 * kSide)));
  Scene scene = scene_of(0.012);
  scene.get<Contact>().parting = 0.008;
  const TimedCase made = testing::run_timed(std::move(body), scene);
  double low = -1, high = 1, fastest = 0;
  const Column& velocity = made.body.element_columns.at("velocity");
  for (std::uint32_t e = 0; e < made.body.element_count(); ++e) {
    const double z = made.body.position[e].z();
    if (e < made.body.parts[0].element_end)
      low = std::max(low, z);
    else
      high = std::min(high, z);
    fastest = std::max(fastest, std::abs(velocity.values[3 * e + 2]));
  }
  EXPECT_GT(high - low, 0);
  EXPECT_LT(fastest, 0.05 * std::sqrt(kGum.young / kGum.density));
  // all of their energy is the work of the letting out, and has been booked as such
  const double work = made.history.column("overlap work").back();
  EXPECT_GT(work, 0);
  EXPECT_NEAR(made.history.column("kinetic").back() + made.history.column("elastic").back(), work,
              0.01 * work);
  expect_books_close(made.result);
  EXPECT_LT(book(made.result, "worst_contact_error"), 0.01 * work);
  for (const char* axis : {"momentum x", "momentum y", "momentum z"})
    EXPECT_LT(std::abs(made.history.column(axis).back()), 1e-12) << axis;
}

TEST(Contact, APartThatBeginsInsideAPlaneIsLetOutGently) {
  Scene scene = scene_of(0.02);
  scene.get<Contact>().planes.push_back(plane_at(0.4 * kSide));
  scene.get<Contact>().parting = 0.01;
  const TimedCase made = testing::run_timed(block("a", {2, 2, 2}), scene);
  double low = 1;
  for (const Vec3& at : made.body.position) low = std::min(low, at.z());
  EXPECT_GT(low, 0.4 * kSide);
  EXPECT_LT(low, 1.5 * kSide);  // not thrown
  expect_books_close(made.result);
}

// A ball of 5 cells' radius on its own lattice, the cells at its surface part of a voxel.
Body solid_ball(const std::string& name, const Vec3& centre) {
  constexpr int kRadius = 5;
  BoxOptions options;
  options.name = name;
  options.cells = {2 * kRadius, 2 * kRadius, 2 * kRadius};
  options.spacing = Vec3::Constant(kSide);
  options.origin = centre - Vec3::Constant(kRadius * kSide);
  options.fill = [](int i, int j, int k) {
    double nearest = 1e9, farthest = 0;  // cells, of its corners
    for (int n = 0; n < 8; ++n) {
      const Vec3 at = Vec3(i + (n & 1), j + (n >> 1 & 1), k + (n >> 2)) - Vec3::Constant(kRadius);
      nearest = std::min(nearest, at.norm());
      farthest = std::max(farthest, at.norm());
    }
    return nearest >= kRadius ? 0 : farthest > kRadius ? 0.5 : 1;
  };
  return testing::ball_within(box_body(options), centre, kRadius * kSide);
}

// Why a run that lets out, or does not, refuses; "": it does not.
std::string refusal_of_overlap(const Body& below, const Body& above, double parting) {
  Body body = below;
  append(body, above);
  Scene scene = scene_of(1e-6);
  scene.get<Contact>().parting = parting;
  try {
    (void)testing::run_timed(std::move(body), scene);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

double millimetres_in(const std::string& refusal) {
  const std::size_t at = refusal.find("overlap by ");
  return at == std::string::npos ? 0 : std::stod(refusal.substr(at + 11));
}

// However shallow they are at the rim.
TEST(Contact, OverlapsDeeperThanContactFeelsAreRefusedEvenIfTheyAreToPart) {
  const Body low = block("a", {3, 3, 3}, Vec3::Zero()), ball = solid_ball("a", Vec3::Zero());
  const Body slab = block("a", {9, 6, 4}, Vec3(-0.05, -0.01, -4 * kSide));
  const auto turned = [](double
                             depth) {  // an edge along y goes in deepest, `depth` cells under the slab's top
    const Mat3 tilt = turn(0.2, Vec3::UnitY());
    return block("b", {6, 4, 4}, Vec3(0.5 * kSide, 0, -depth * kSide) - tilt * Vec3(6 * kSide, 0, 0), tilt);
  };
  for (const double parting : less_if_sanitized<std::vector<double>>({0, 0.01}, {0.01}, "one of two")) {
    const auto depth = [&](const Body& below, const Body& above) {
      return millimetres_in(refusal_of_overlap(below, above, parting));
    };
    EXPECT_NEAR(depth(low, block("b", {3, 3, 3}, Vec3(0, 0, 1.5 * kSide))), 15, 1e-6);
    EXPECT_NEAR(depth(ball, solid_ball("b", Vec3(0, 0, 7 * kSide))), 30, 1.5);
    EXPECT_NEAR(depth(slab, turned(2.5)), 25, 2.5);
  }
  // what is within reach everywhere is let out
  const double parting = 0.01;
  EXPECT_EQ(refusal_of_overlap(ball, solid_ball("b", Vec3(0, 0, 9.2 * kSide)), parting), "");
  EXPECT_EQ(refusal_of_overlap(slab, turned(0.8), parting), "");
  EXPECT_EQ(refusal_of_overlap(low, block("b", {1, 1, 3}, Vec3(kSide, kSide, 2.2 * kSide)), parting), "");
  EXPECT_EQ(refusal_of_overlap(low, block("b", {3, 3, 3}, Vec3(0, 2.5 * kSide, 2.5 * kSide)), parting), "");
  // the sides of what ends in a cut cell, which is not looked into, come out with that end
  BoxOptions options{{3, 3, 3}, Vec3::Constant(kSide)};
  options.name = "a";
  options.fill = [](int, int, int k) { return k == 2 ? 0.9 : 1; };
  Body cut = box_body(options);
  for (Vec3& at : cut.surface.vertices) at.z() = std::min(at.z(), 2.9 * kSide);
  EXPECT_EQ(refusal_of_overlap(cut, block("b", {3, 3, 3}, Vec3(0, 0, 2.5 * kSide)), parting), "");
  EXPECT_NEAR(millimetres_in(refusal_of_overlap(cut, block("b", {3, 3, 3}, Vec3(0, 0, 2.5 * kSide)), 0)), 4,
              1e-6);
  // and is not told to ask for what it asked for
  const std::string told = refusal_of_overlap(low, block("b", {3, 3, 3}, Vec3(0, 0, kSide)), parting);
  EXPECT_THAT(told, HasSubstr("larger cells: \"overlap\" = \"part\" lets out up to 9 mm"));
}

// What comes near only while it slides goes on as deep as its neighbours are.
TEST(Contact, PartsThatSlideWhileTheyAreLetOutAreNotThrown) {
  const auto strained = [](double speed) {
    Body body = block("a", {6, 3, 2}, Vec3::Zero());
    append(body, block("b", {6, 3, 2}, Vec3(0, 0, 1.6 * kSide)));
    Scene scene = scene_of(0.024);
    scene.get<Contact>().parting = 0.02;
    throw_part(scene, "b", Vec3(speed, 0, 0));
    const TimedCase made = testing::run_timed(std::move(body), scene);
    double low = -1, high = 1;
    for (std::uint32_t e = 0; e < made.body.element_count(); ++e) {
      double& face = e < made.body.parts[0].element_end ? low : high;
      const double z = made.body.position[e].z();
      face = &face == &low ? std::max(low, z) : std::min(high, z);
    }
    EXPECT_GT(high - low, 0) << speed;
    expect_books_close(made.result);
    double most = 0;
    const std::vector<double>&elastic = made.history.column("elastic"),
          &stored = made.history.column("contact stored");
    for (std::size_t row = 0; row < elastic.size(); ++row) most = std::max(most, elastic[row] + stored[row]);
    return most;
  };
  const double still = strained(0);
  ASSERT_GT(still, 0);
  EXPECT_LT(strained(1.5), 2 * still);
}

// Two blocks that are held apart by less than they overlap.
Scene held_while_let_out(const std::string& events) {
  Scene scene = scene_of(0.03);
  scene.get<Contact>().parting = 0.02;
  scene.get<Damping>().entries.push_back({1e-4, std::nullopt, ""});
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("a/z0")));
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("b/z1")));
  scene.events = parse_scene(events + "[run]\ntime = \"30 ms\"\n", "test").events;
  return scene;
}

TEST(Contact, LettingOutGoesOnOverAnEvent) {
  const auto run = [](const std::string& events) {
    Body body = block("a", {2, 2, 2}, Vec3::Zero());
    append(body, block("b", {2, 2, 2}, Vec3(0, 0, 1.8 * kSide)));
    return testing::run_timed(std::move(body), held_while_let_out(events));
  };
  const TimedCase plain = run("");
  const TimedCase edited =
      run("[[event]]\nat = \"10 ms\"\ndo = \"edit\"\nwhere = \"b\"\ndensity = 1.000001\n");
  for (const char* column : {"overlap work", "contact stored", "elastic"}) {
    const double expected = plain.history.column(column).back();
    ASSERT_GT(expected, 0) << column;
    EXPECT_NEAR(edited.history.column(column).back(), expected, 1e-3 * expected) << column;
  }
}

TEST(Contact, APartThatJoinsInsideAnotherIsRefusedOrLetOut) {
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("joins.vtu");
  const auto run = [&](double depth, double parting, std::optional<double> step = {}) {
    write_body(block("b", {2, 2, 2}, Vec3(0, 0, (2 - depth) * kSide)), path);
    Scene scene = scene_of(0.02);
    scene.run.step = step;
    scene.get<Contact>().parting = parting;
    throw_part(scene, "a", Vec3(0, 0, 0), Vec3(0, 0, 1));  // it has moved by then
    scene.events = parse_scene("[[event]]\nat = \"5 ms\"\ndo = \"add\"\nbody = \"" + path +
                                   "\"\n[run]\ntime = \"20 ms\"\n",
                               "test")
                       .events;
    for (Event& each : scene.events) (void)each.prepare();
    return testing::run_timed(block("a", {2, 2, 2}, Vec3::Zero()), scene);
  };
  const auto refusal = [&](double depth, double parting) {
    try {
      (void)run(depth, parting);
    } catch (const DivergedError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal(0.4, 0), HasSubstr("overlap by 4 mm at 0.005 s, when it joins"));
  EXPECT_THAT(refusal(1.5, 0.01), HasSubstr("overlap by 15 mm"));

  const TimedCase out = run(0.4, 0.01);
  const double spun = out.history.column("kinetic")[0];
  const double work = out.history.column("overlap work").back();
  ASSERT_GT(work, 0);
  EXPECT_NEAR(out.history.column("kinetic").back() + out.history.column("elastic").back(), spun + work,
              0.02 * (spun + work));
  EXPECT_LT(std::abs(book(out.result, "worst_contact_error")), 0.02 * work);
  expect_books_close(out.result);

  // what is too shallow to be refused presses at once: the event gave that
  const TimedCase pressed = run(0.04, 0, 1e-5);
  const double given = pressed.history.column("events work").back();
  ASSERT_GT(given, 0);
  EXPECT_NEAR(pressed.history.column("kinetic").back() + pressed.history.column("elastic").back(),
              spun + given, 0.1 * given);
}

}  // namespace
}  // namespace flexel::simulate
