// Parts that join a timed run: bonded where they touch as they are then, as parts that touch from the beginning are.
#include "simulate/events/joined_bonds.h"

#include <gmock/gmock.h>

#include "base/error.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/merge.h"
#include "simulate/matter/joined_parts.h"
#include "tests/scratch.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::centre_body;
using testing::expect_books_close;
using ::testing::HasSubstr;
using testing::run_timed;
using testing::TimedCase;

// 40 x 20 x 20 mm from x = 0, and the same from x = 40 mm on a finer lattice.
Body left_half() {
  return box_body({.cells = {4, 2, 2}, .spacing = Vec3::Constant(1e-2), .name = "left"});
}
Body right_half() {
  return box_body(
      {.cells = {6, 3, 3}, .spacing = Vec3::Constant(2e-2 / 3), .origin = Vec3(4e-2, 0, 0), .name = "right"});
}

Scene late_gum_scene(const std::string& keys) {
  return parse_scene("material = \"gum\"\n" + keys +
                         "\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.25\ndensity = \"1000 kg/m3\"\n",
                     "scene.toml");
}

std::string late_add_at(const std::string& at, const std::string& path) {
  return "\n[[event]]\nat = \"" + at + "\"\ndo = \"add\"\nbody = \"" + path + "\"\n";
}

// Turned by a right angle about z, and drawn along.
Body turned_along(Body body, const Vec3& along) {
  for (Vec3& x : body.position) x = Vec3(-x.y(), x.x(), x.z()) + along;
  return body;
}

std::vector<Vec3> moves_of(const Body& body) {
  std::vector<Vec3> moved;
  for (std::size_t e = 0; e < body.element_count(); ++e) moved.push_back(body.position[e] - body.rest[e]);
  return moved;
}

double largest_of_moves(const std::vector<Vec3>& vectors) {
  double most = 0;
  for (const Vec3& each : vectors) most = std::max(most, each.norm());
  return most;
}

// A cantilever whose outer half comes at the beginning of the run, against one that has it.
TEST(JoinedBonds, APartThatComesAtOnceIsBondedAsOneThatWasThere) {
  const flexel::test::Scratch scratch;
  const auto expect_same = [&](const Body& left, const Body& right, const std::string& model, double share) {
    write_body(right, scratch.path("right.vtu"));
    Body both = left;
    append(both, right);
    const std::string keys = "model = \"" + model +
                             "\"\n[run]\ntime = \"30 ms\"\n[[fix]]\nwhere = \"left/x0\"\n[[load]]\nwhere = "
                             "\"right/x1\"\nforce = [0, 0, \"0.02 N\"]\n[[probe]]\nname = \"end\"\nwhere = "
                             "\"right/x1\"\n";
    const TimedCase there = run_timed(both, late_gum_scene(keys));
    const TimedCase came =
        run_timed(left, late_gum_scene(keys + late_add_at("0 s", scratch.path("right.vtu"))));
    expect_books_close(came.result);
    const auto farthest = [](const TimedCase& run) {
      const std::vector<double>& end = run.history.column("end z");
      return *std::max_element(end.begin(), end.end());
    };
    const double wanted = farthest(there);
    EXPECT_GT(wanted, 4e-5) << model;
    EXPECT_NEAR(farthest(came), wanted, share * wanted) << model;
    EXPECT_EQ(joined_parts(came.body), (std::vector<std::uint8_t>{0, 1}));
  };
  expect_same(left_half(), right_half(), "cells", 0.01);
  expect_same(left_half(), right_half(), "springs", 0.01);
  const auto centre = [](const std::string& name, double from) {
    testing::CentreOptions options;
    options.voxels = {4, 3, 3};
    options.spacing = 1e-2;
    options.origin = Vec3(from, 0, 0);
    options.name = name;
    return centre_body(options);
  };
  expect_same(centre("left", 0), centre("right", 4e-2), "paper", 0.02);
}

// Where they touch as they are, not as they rest: no force at that moment, and later they move as one.
TEST(JoinedBonds, TheyTouchWhereTheyAreThen) {
  const flexel::test::Scratch scratch;
  Body right = right_half();
  const Body left = turned_along(left_half(), Vec3(0.5, 0, 0));
  right = turned_along(std::move(right), Vec3(0.5, 0, 0));
  write_body(right, scratch.path("right.vtu"));
  const TimedCase still = run_timed(
      left, late_gum_scene("[run]\ntime = \"20 ms\"" + late_add_at("1 ms", scratch.path("right.vtu"))));
  Body both = left;
  append(both, right);
  std::vector<Vec3> moved = moves_of(still.body);
  for (std::size_t e = 0; e < moved.size(); ++e) moved[e] -= both.position[e] - both.rest[e];
  EXPECT_LT(largest_of_moves(moved), 1e-12);
  EXPECT_FALSE(fused_points(still.body).empty());
  // thrown: the other half is drawn along, with momentum and angular momentum kept
  Body thrown = left;
  testing::set_velocity(thrown, std::vector<Vec3>(thrown.element_count(), Vec3(0, 0.1, 0)));
  const TimedCase flown =
      run_timed(thrown, late_gum_scene("[damping]\ntime = \"2 ms\"\n[run]\ntime = \"300 ms\"" +
                                       late_add_at("0 s", scratch.path("right.vtu"))));
  testing::expect_momenta_kept(flown.history, 1e-9);
  double speed = 0;
  const Part& part = flown.body.parts[1];
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    speed +=
        flown.body.element_columns.at("velocity").values[3 * e + 1] / (part.element_end - part.element_begin);
  EXPECT_NEAR(speed, 0.05, 2e-3);
}

// What rests beside another and has been led away does not touch it; and what a later run finds stays so.
TEST(JoinedBonds, WhatTouchesAtRestOnlyStaysApart) {
  const flexel::test::Scratch scratch;
  Body right = right_half();
  write_body(right, scratch.path("right.vtu"));
  Body left = left_half();
  for (Vec3& x : left.position) x.x() -= 5e-3;
  testing::set_velocity(left, std::vector<Vec3>(left.element_count(), Vec3(-1, 0, 0)));
  const std::string run = "[run]\ntime = \"10 ms\"\n";
  const TimedCase first =
      run_timed(left, late_gum_scene(run + late_add_at("0 s", scratch.path("right.vtu"))));
  EXPECT_TRUE(fused_points(first.body).empty());
  const TimedCase second = run_timed(first.body, late_gum_scene(run));
  for (std::uint32_t e = second.body.parts[1].element_begin; e < second.body.element_count(); ++e)
    ASSERT_EQ(second.body.position[e], second.body.rest[e]);
  const std::string named = "[[bond]]\nparts = [\"left\", \"right\"]\n";
  const auto refusal = [&](const Body& body, const std::string& keys) -> std::string {
    try {
      (void)run_timed(body, late_gum_scene(keys));
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(first.body, run + named), HasSubstr("joined in an earlier run"));
  EXPECT_THAT(refusal(left, run + named + late_add_at("0 s", scratch.path("right.vtu"))),
              HasSubstr("do not touch"));
}

// Runs that go on from the body have the bonds, once.
TEST(JoinedBonds, LaterRunsGoOnWithThem) {
  const flexel::test::Scratch scratch;
  write_body(right_half(), scratch.path("right.vtu"));
  const auto keys = [](const char* time) {
    return std::string(
               "[[fix]]\nwhere = \"left/x0\"\n[[load]]\nwhere = \"right/x1\"\nforce = [0, 0, \"0.02 N\"]\n"
               "[[probe]]\nname = \"end\"\nwhere = \"right/x1\"\n[run]\ntime = \"") +
           time + "\"\n";
  };
  const std::string add = late_add_at("0 s", scratch.path("right.vtu"));
  const TimedCase whole = run_timed(left_half(), late_gum_scene(keys("30 ms") + add));
  const TimedCase first = run_timed(left_half(), late_gum_scene(keys("15 ms") + add));
  const TimedCase second = run_timed(first.body, late_gum_scene(keys("15 ms")));
  EXPECT_EQ(fused_points(second.body).size(), fused_points(first.body).size());
  const double wanted = whole.result.probes.at(0).displacement.z();
  EXPECT_NEAR(second.result.probes.at(0).displacement.z(), wanted, 0.01 * wanted);
}

// [[bond]] may name what comes, over a gap and beside contact, which then leaves the two alone.
TEST(JoinedBonds, ABondNamesAPartThatComes) {
  const flexel::test::Scratch scratch;
  Body right = right_half();
  for (Vec3& x : right.position) x.x() += 1e-3;
  write_body(right, scratch.path("right.vtu"));
  const std::string run = "contact = true\n[run]\ntime = \"5 ms\"\n";
  const std::string add = late_add_at("1 ms", scratch.path("right.vtu"));
  const TimedCase apart = run_timed(left_half(), late_gum_scene(run + add));
  EXPECT_TRUE(fused_points(apart.body).empty()) << "with contact nothing is bonded that is not named";
  const TimedCase made = run_timed(
      left_half(), late_gum_scene(run + "[[bond]]\nparts = [\"left\", \"right\"]\ngap = \"2 mm\"\n" + add));
  EXPECT_FALSE(fused_points(made.body).empty());
}

// A plate of one element: its neighbours do not tell where its faces are. It comes as it is, and the run says so.
TEST(JoinedBonds, APlateOfOneElementIsToldOf) {
  const flexel::test::Scratch scratch;
  const auto centre = [](const std::string& name, double from, int thick) {
    testing::CentreOptions options;
    options.voxels = {thick, 3, 3};
    options.spacing = 1e-2;
    options.origin = Vec3(from, 0, 0);
    options.name = name;
    return centre_body(options);
  };
  write_body(centre("right", 4e-2, 1), scratch.path("right.vtu"));
  const auto told = [&](double from) {
    ::testing::internal::CaptureStderr();
    const TimedCase made =
        run_timed(centre("left", from, 4), late_gum_scene("model = \"paper\"\n[run]\ntime = \"1 ms\"\n" +
                                                          late_add_at("0 s", scratch.path("right.vtu"))));
    EXPECT_TRUE(fused_points(made.body).empty());
    return ::testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(told(0), HasSubstr("\"right\" is one element thick"));
  EXPECT_THAT(told(-1), ::testing::Not(HasSubstr("one element thick")));
}

// Before its part comes a probe has no number; names are fields of the history as RFC 4180 has them.
TEST(JoinedBonds, AProbeSelectsAPartThatComes) {
  const flexel::test::Scratch scratch;
  Body right = right_half();
  for (Vec3& x : right.position) x.x() += 0.1;
  write_body(right, scratch.path("right.vtu"));
  const TimedCase made = run_timed(
      left_half(),
      late_gum_scene(
          "[[probe]]\nname = \"late\"\nwhere = \"right/x1\"\n[[probe]]\nname = \"all\"\nwhere = "
          "[\"left/x1\", \"right/x1\"]\n[run]\ntime = \"4 ms\"\n[gravity]\nacceleration = [0, 0, \"-10 "
          "m/s2\"]\n" +
          late_add_at("2 ms", scratch.path("right.vtu"))));
  const std::vector<double>&time = made.history.column("time"), &late = made.history.column("late x"),
        &all = made.history.column("all x");
  std::size_t before = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    before += std::isnan(late[i]);
    EXPECT_EQ(std::isnan(late[i]), std::isnan(made.history.column("late z")[i]));
    if (time[i] < 2e-3) {
      EXPECT_TRUE(std::isnan(late[i])) << time[i];
    } else if (time[i] > 2e-3) {
      EXPECT_NEAR(late[i], 0.1, 1e-9) << time[i];
    }
    EXPECT_FALSE(std::isnan(all[i]));
  }
  EXPECT_GT(before, 1u);
  EXPECT_NEAR(made.result.probes.at(0).displacement.x(), 0.1, 1e-9);
  EXPECT_NEAR(made.result.probes.at(1).displacement.x(), 0.05, 1e-6);
  EXPECT_THROW((void)run_timed(left_half(),
                               late_gum_scene("[[probe]]\nwhere = \"rihgt/x1\"\n[run]\ntime = \"4 ms\"\n" +
                                              late_add_at("2 ms", scratch.path("right.vtu")))),
               InputError);
}

}  // namespace
}  // namespace flexel::simulate
