// An event at the very end of a timed run: forces, stresses and books are those of a run that goes on for one step.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "formats/lattice/body_file.h"
#include "tests/scratch.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::centre_body;
using testing::run_timed;
using testing::TimedCase;

struct EndCase {
  std::string model = "cells", method = "symplectic", damping = "20 us";
  std::string events;  // without their times
  std::string more = "";
};

// 60 x 20 x 20 mm, and 0.1 mm beside its end 40 x 20 x 20 mm.
Body end_part(const std::string& model, const std::string& name) {
  const bool bar = name == "bar";
  const Vec3 origin = bar ? Vec3::Zero() : Vec3(6.01e-2, 0, 0);
  const std::array<int, 3> cells{bar ? 6 : 4, 2, 2};
  if (model == "paper")
    return centre_body({.voxels = cells, .spacing = 1e-2, .origin = origin, .name = name});
  return box_body({.cells = cells, .spacing = Vec3::Constant(1e-2), .origin = origin, .name = name});
}

// Events are at 2 ms, the last of so many steps of 20 us.
Scene end_scene(const EndCase& made, int steps_after) {
  std::string events = made.events;
  for (std::size_t at = 0; (at = events.find("[[event]]", at)) != std::string::npos; at += 9)
    events.insert(at + 9, "\nat = \"2 ms\"");
  return parse_scene(
      fmt::format(R"(material = "gum"
[materials.gum]
young = "1 MPa"
poisson = 0.25
density = "1000 kg/m3"
[gravity]
acceleration = [0, 0, "-9.81 m/s2"]
[damping]
time = "{}"
[[move]]
where = "bar/x0"
time = ["0 s", "4 ms"]
displacement = ["-2 mm", 0, 0]
factor = [0, 1]
[[load]]
where = "bar/x1"
force = ["1 N", 0, "0.5 N"]
[run]
time = "{} us"
step = "20 us"
method = "{}"
[parts.bar]
model = "{}"
{}{})",
                  made.damping, 2000 + 20 * steps_after, made.method, made.model, made.more, events),
      "scene.toml");
}

SimulateResult without_books(Body body, const Scene& scene) {
  Progress quiet("test", Progress::Mode::quiet);
  return simulate(body, scene, {}, quiet);
}

void expect_near(const Vec3& found, const Vec3& wanted, double tolerance, const std::string& what) {
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(found[axis], wanted[axis], tolerance) << what << " " << axis;
}

// `tolerance`: of the largest force. Moments are about the origin where the body is then, a step later by up to 20 um.
void expect_forces(const SimulateResult& found, const SimulateResult& wanted, double tolerance) {
  ASSERT_EQ(found.reactions.size(), wanted.reactions.size());
  ASSERT_EQ(found.loads.size(), wanted.loads.size());
  double largest = 0;
  for (const Reaction& each : wanted.reactions) largest = std::max(largest, each.force.norm());
  EXPECT_GT(largest, 0.01) << "N";
  constexpr double kStepsWay = 2e-5;  // m
  for (std::size_t r = 0; r < wanted.reactions.size(); ++r) {
    EXPECT_EQ(found.reactions[r].name, wanted.reactions[r].name);
    expect_near(found.reactions[r].force, wanted.reactions[r].force, tolerance * largest,
                wanted.reactions[r].name);
    expect_near(found.reactions[r].moment, wanted.reactions[r].moment, kStepsWay * largest, "moment");
  }
  for (std::size_t l = 0; l < wanted.loads.size(); ++l)
    expect_near(found.loads[l].force, wanted.loads[l].force, tolerance * largest, wanted.loads[l].name);
}

// The last row of the one is the row after the event of the other.
void expect_books(const TimedCase& ends, const TimedCase& goes_on, double tolerance) {
  const std::vector<double>& time = goes_on.history.column("time");
  std::size_t row = time.size();
  while (row-- > 1 && time[row] != time[row - 1]) continue;
  ASSERT_GT(row, 1u) << "no event in the books";
  EXPECT_EQ(ends.history.column("time").back(), time[row]);
  double largest = 0;
  for (const char* name : {"kinetic", "elastic", "potential", "work"})
    largest = std::max(largest, std::abs(goes_on.history.column(name)[row]));
  for (const char* name :
       {"kinetic", "elastic", "potential", "work", "dissipated", "events work", "residual"})
    EXPECT_NEAR(ends.history.column(name).back(), goes_on.history.column(name)[row], tolerance * largest)
        << name;
}

void expect_as_if_it_went_on(const EndCase& made) {
  SCOPED_TRACE(made.model + " " + made.method + " " + made.damping + " " + made.events);
  const Body body = end_part(made.model, "bar");
  const double tolerance = made.method == "implicit" ? 1e-5 : 1e-9;
  const Scene ends = end_scene(made, 0), goes_on = end_scene(made, 1);
  const SimulateResult found = without_books(body, ends), wanted = without_books(body, goes_on);
  expect_forces(found, wanted, tolerance);
  const TimedCase booked = run_timed(body, ends);
  expect_forces(booked.result, wanted, tolerance);
  EXPECT_NEAR(found.elastic_energy, testing::book(booked.result, "elastic"),
              1e-8 * testing::book(booked.result, "largest_term"));
  expect_books(booked, run_timed(body, goes_on), tolerance);
  // explicit Euler gains energy by itself, implicit steps lose it
  if (made.method == "symplectic" || made.method == "verlet") testing::expect_books_close(booked.result);
}

constexpr const char* kStiffer = "[[event]]\ndo = \"edit\"\nstiffness = 3\n";
constexpr const char* kLighter = "[[event]]\ndo = \"edit\"\ndensity = 0.5\n";
constexpr const char* kFrozen = "[[event]]\ndo = \"renormalise\"\n";
constexpr const char* kHalf =
    "[[event]]\ndo = \"carve\"\nwhere = { box = { min = [\"9 mm\", \"-9 mm\", \"-9 mm\"], "
    "max = [\"45 mm\", \"15 mm\", \"99 mm\"] } }\n";

TEST(EventAtEnd, ForcesAreThoseOfTheBodyThatIsThere) {
  for (const char* model : {"cells", "springs", "paper"})
    for (const char* event : {kStiffer, kLighter, kFrozen, kHalf})
      expect_as_if_it_went_on({.model = model, .events = event});
}

TEST(EventAtEnd, ByEveryMethodOfStepping) {
  for (const char* method : {"verlet", "explicit", "implicit"})
    expect_as_if_it_went_on({.method = method, .events = std::string(kStiffer) + kHalf});
  expect_as_if_it_went_on({.damping = "5 ms", .events = kStiffer});  // in stages
}

// What comes rests on a support of its own, of which nothing was known before.
TEST(EventAtEnd, WhatComesAndIsFusedHasForces) {
  const flexel::test::Scratch scratch;
  for (const std::string model : {"cells", "springs", "paper"}) {
    const std::string path = scratch.path(model + ".vtu");
    write_body(end_part(model, "late"), path);
    const std::string within = model == "paper" ? "12 mm" : "0.2 mm";
    expect_as_if_it_went_on(
        {.model = model,
         .events = "[[event]]\ndo = \"add\"\nbody = \"" + path +
                   "\"\nvelocity = [\"1 m/s\", 0, 0]\n[[event]]\ndo = \"fuse\"\nwithin = \"" + within +
                   "\"\n",
         .more = "[parts.late]\nmodel = \"" + model + "\"\n[[fix]]\nwhere = \"late/x1\"\n"});
  }
}

TEST(EventAtEnd, FinerLatticeHasForces) {
  for (const char* method : {"symplectic", "implicit"})
    expect_as_if_it_went_on(
        {.method = method, .events = "[[event]]\ndo = \"resolution\"\nchange = \"finer\"\n"});
}

// The state that is told is the one that the event left: the step beyond is taken back.
TEST(EventAtEnd, TheBodyStaysAsItWas) {
  const EndCase made{.events = kStiffer};
  EndCase plain = made;
  plain.events = "";
  const TimedCase with = run_timed(end_part("cells", "bar"), end_scene(made, 0)),
                  without = run_timed(end_part("cells", "bar"), end_scene(plain, 0));
  EXPECT_EQ(with.body.position, without.body.position);
  EXPECT_EQ(with.result.timed->time, without.result.timed->time);
  EXPECT_EQ(with.result.timed->steps, without.result.timed->steps);
}

}  // namespace
}  // namespace flexel::simulate
