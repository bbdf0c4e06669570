// What contact stuck together goes on in a later run, through the file.
#include "simulate/contact/pairs/stuck_places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "formats/lattice/body_file.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "tests/simulate/contact_case.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;
using ::testing::HasSubstr;

// A block that hangs from a plane by what sticks, drawn to the side too.
Scene hanging_scene(double time, bool contact = true) {
  Scene scene = scene_of(time);
  if (contact)
    scene.get<Contact>().planes.push_back(plane_at(0));
  else
    scene.get<Contact>() = {};
  scene.get<Contact>().stick = contact ? 2000 : 0;
  scene.get<Contact>().damping = contact ? 1e-4 : 0;
  scene.get<Damping>().entries.push_back({1e-4, std::nullopt, ""});
  scene.get<Gravity>().acceleration = Vec3(4, 0, 20);
  scene.run.step = 2e-5;
  return scene;
}

Body through_a_file(const Body& body) {
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("stuck.vtu");
  write_body(body, path);
  return read_body(path);
}

double farthest_apart(const Body& a, const Body& b) {
  double most = 0;
  for (std::size_t e = 0; e < a.element_count(); ++e)
    most = std::max(most, (a.position[e] - b.position[e]).norm());
  return most;
}

TEST(StuckPlaces, TwoRunsAreOne) {
  const Body body = block("a", {2, 2, 2});
  const Body whole = testing::run_timed(body, hanging_scene(0.02)).body;
  const Body half = through_a_file(testing::run_timed(body, hanging_scene(0.01)).body);
  EXPECT_FALSE(stuck_places(half).empty());
  const Body both = testing::run_timed(half, hanging_scene(0.01)).body;
  Body forgetful = half;
  set_stuck_places(forgetful, {});
  const Body other = testing::run_timed(forgetful, hanging_scene(0.01)).body;
  const double moved = farthest_apart(both, half);
  EXPECT_LT(farthest_apart(whole, both), 1e-6 * moved);
  EXPECT_GT(farthest_apart(whole, other), 1e-2 * moved) << "the note is what makes them one";
  EXPECT_EQ(stuck_places(both).size(), stuck_places(whole).size());
}

TEST(StuckPlaces, WhatDoesNotStickIsNotInTheFile) {
  Scene scene = hanging_scene(0.002);
  scene.get<Contact>().stick = 0;
  scene.get<Gravity>().acceleration = Vec3(0, 0, -20);
  EXPECT_TRUE(stuck_places(testing::run_timed(block("a", {2, 2, 2}), scene).body).empty());
}

TEST(StuckPlaces, ARunWithoutContactSaysThatItDropsThem) {
  Body half = testing::run_timed(block("a", {2, 2, 2}), hanging_scene(0.004)).body;
  Scene scene = hanging_scene(0.001, false);
  const flexel::test::Scratch scratch;
  ::testing::internal::CaptureStderr();
  Progress progress("test", Progress::Mode::lines);
  (void)simulate(half, scene, {}, progress);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(),
              HasSubstr("stuck together at the end of an earlier run"));
  EXPECT_TRUE(stuck_places(half).empty());
}

// Numbers of parts move up, those of planes stay.
TEST(StuckPlaces, BodiesThatAreMergedKeepThem) {
  const Body stuck = testing::run_timed(block("a", {2, 2, 2}), hanging_scene(0.004)).body;
  Body first = stuck;
  append(first, stuck);
  const std::vector<StuckPlaces> before = stuck_places(stuck), after = stuck_places(first);
  ASSERT_EQ(after.size(), 2 * before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    StuckPlaces expected = before[i];
    EXPECT_EQ(after[i], expected);
    expected[0] += 1;
    EXPECT_EQ(expected[7], -1) << "a plane";
    EXPECT_EQ(after[before.size() + i], expected);
  }
}

TEST(StuckPlaces, ADamagedNoteIsRefusedInOneLine) {
  const Body stuck = testing::run_timed(block("a", {2, 2, 2}), hanging_scene(0.004)).body;
  const std::string note = stuck.notes.at(kStuckNote);
  std::size_t lines = 0;
  for (const std::string& damaged :
       {"x" + note, note.substr(0, note.find('\n') - 3), "nan" + note.substr(note.find(' ')),
        "1" + note.substr(note.find(' ')), "0.5" + note.substr(note.find(' '))}) {
    Body body = stuck;
    body.notes[kStuckNote] = damaged;
    EXPECT_THAT(refusal(body, hanging_scene(0.001)), HasSubstr("note \"stuck\" is damaged in line 1"))
        << ++lines;
  }
}

// The scene decides what sticks: what bears nothing any more comes off.
TEST(StuckPlaces, ALaterSceneThatDoesNotStickLetsGo) {
  const Body half = testing::run_timed(block("a", {2, 2, 2}), hanging_scene(0.004)).body;
  Scene scene = hanging_scene(0.03);
  scene.get<Contact>().stick = 0;
  ::testing::internal::CaptureStderr();
  Progress progress("test", Progress::Mode::lines);
  Body after = half;
  (void)simulate(after, scene, {}, progress);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(),
              HasSubstr("nothing of this scene has stick, and they come off"));
  EXPECT_GT(after.position[0].z() - half.position[0].z(), 0.5 * kSide);
  EXPECT_TRUE(stuck_places(after).empty());
  // What an earlier run's glue (an event's edit) holds needs nothing of the scene.
  Body glued = half;
  glued.element_columns["stick_change"] = {1, std::vector<double>(half.element_count(), 2000)};
  ::testing::internal::CaptureStderr();
  Progress lines("test", Progress::Mode::lines);
  (void)simulate(glued, scene, {}, lines);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), ::testing::Not(HasSubstr("come off")));
  EXPECT_FALSE(stuck_places(glued).empty());
}

}  // namespace
}  // namespace flexel::simulate
