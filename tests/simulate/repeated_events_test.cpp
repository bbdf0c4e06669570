// Tools that carve and paint as they move: events with `with` and `every`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>

#include "base/error.h"
#include "formats/lattice/fused_points.h"
#include "formats/lattice/merge.h"
#include "simulate/events/edit.h"
#include "simulate/simulate.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

constexpr double kSpacing = 1e-2;  // m

Body block_of(const std::string& name, std::array<int, 3> cells, const Vec3& origin) {
  testing::BoxOptions options;
  options.cells = cells;
  options.spacing = Vec3::Constant(kSpacing);
  options.origin = origin;
  options.name = name;
  return testing::box_body(options);
}

// A held block of 8 x 6 x 2 cells, and a tool of 2 x 2 x 2 above it that is led by 60 mm along x, turning by `angle`
// about z, in 10 ms.
Body block_and_tool() {
  Body body = block_of("work", {8, 6, 2}, Vec3::Zero());
  append(body, block_of("mill", {2, 2, 2}, Vec3(0, 0.02, 0.05)));
  return body;
}

std::string scene_with(const std::string& events, double angle = 0) {
  return "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 "
         "kg/m3\"\n[run]\ntime = \"10 ms\"\n"
         "[[fix]]\nwhere = \"work\"\n[[manipulator]]\npart = \"mill\"\ntime = [\"0 s\", \"10 ms\"]\n"
         "displacement = [[\"0 mm\", 0, 0], [\"60 mm\", 0, 0]]\n"
         "rotation = [{ axis = [0, 0, 1], angle = \"0 rad\" }, { axis = [0, 0, 1], angle = \"" +
         std::to_string(angle) + " rad\" }]\n" + events;
}

testing::TimedCase run_scene(const std::string& text) {
  return testing::run_timed(block_and_tool(), parse_scene(text, "scene.toml"));
}

// 20 mm around a point below the tool, `beside` its axis.
std::string sphere(const std::string& beside = "10") {
  return "where = { sphere = { centre = [\"" + beside +
         " mm\", \"30 mm\", \"10 mm\"], radius = \"13 mm\" } }\nwith = \"mill\"\n";
}

using Cell = std::array<int, 3>;
std::set<Cell> cells_of(const Body& body, std::uint32_t part) {
  std::set<Cell> cells;
  for (std::uint32_t c = body.parts[part].cell_begin; c < body.parts[part].cell_end; ++c) {
    const Index3& index = body.lattice_index[body.cell_elements[c][0]];
    cells.insert({index[0], index[1], index[2]});
  }
  return cells;
}

// The cells of the block that a sphere comes over at 0, 1, ... 10 ms: more than half of their corners.
std::set<Cell> passed_by(double beside, double angle) {
  const Body body = block_and_tool();
  const Vec3 axis(0.01, 0.03, 0.06);  // the tool's middle
  std::set<Cell> cells;
  for (int turn = 0; turn <= 10; ++turn) {
    const double share = turn / 10.0;
    const Vec3 centre =
        axis + Vec3(0.06 * share, 0, 0) +
        Eigen::AngleAxisd(angle * share, Vec3::UnitZ()) * (Vec3(1e-3 * beside, 0.03, 0.01) - axis);
    for (std::uint32_t c = body.parts[0].cell_begin; c < body.parts[0].cell_end; ++c) {
      int inside = 0;
      for (const std::uint32_t e : body.cell_elements[c]) inside += (body.rest[e] - centre).norm() <= 0.013;
      const Index3& index = body.lattice_index[body.cell_elements[c][0]];
      if (inside > 4) cells.insert({index[0], index[1], index[2]});
    }
  }
  return cells;
}

TEST(RepeatedEvents, AToolCarvesWhatItPassesThrough) {
  for (const double angle : {0.0, 2.5}) {
    const testing::TimedCase made = run_scene(
        scene_with("[[event]]\nat = \"0 s\"\ndo = \"carve\"\nevery = \"1 ms\"\n" + sphere("22"), angle));
    const std::set<Cell> left = cells_of(made.body, 0), gone = passed_by(22, angle);
    EXPECT_GT(gone.size(), 8u) << angle;
    EXPECT_EQ(left.size() + gone.size(), 96u) << angle;
    for (const Cell& cell : gone) EXPECT_FALSE(left.contains(cell)) << angle;
    EXPECT_EQ(cells_of(made.body, 1).size(), 8u) << "the tool itself stays";
  }
}

TEST(RepeatedEvents, PaintIsPutOnOnce) {
  // Twice over the same: two and two are not four.
  const std::string paint =
      "[[event]]\nat = \"1 ms\"\ndo = \"edit\"\ndensity = 2\nevery = \"0.5 ms\"\nuntil = \"8 ms\"\n" +
      sphere();
  const testing::TimedCase made = run_scene(scene_with(paint));
  const std::vector<double>& change = made.body.cell_columns.at("density_change").values;
  std::size_t painted = 0;
  for (const double each : change) {
    EXPECT_TRUE(each == 0 || each == 1) << each;
    painted += each == 1;
  }
  EXPECT_GT(painted, 8u);
  for (const Columns* columns : {&made.body.cell_columns, &made.body.element_columns})
    for (const auto& [name, column] : *columns)
      EXPECT_FALSE(name.starts_with("edited")) << name << " is left over";
  testing::expect_books_close(made.result);
}

TEST(RepeatedEvents, WhatNeverMeetsAnythingIsToldOnce) {
  ::testing::internal::CaptureStderr();
  Progress progress("test", Progress::Mode::lines);
  Body body = block_and_tool();
  const std::string far =
      "where = { sphere = { centre = [\"10 mm\", \"30 mm\", \"900 mm\"], radius = \"9 mm\" } }\nwith = "
      "\"mill\"\n";
  (void)simulate(body,
                 parse_scene(scene_with("[[event]]\nat = \"0 s\"\ndo = \"carve\"\nevery = \"2 ms\"\n" + far),
                             "scene.toml"),
                 {}, progress);
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_THAT(said, HasSubstr("warning: scene.toml:"));
  EXPECT_THAT(said, HasSubstr("carve found nothing in 6 times: the sphere holds no element"));
  EXPECT_EQ(cells_of(body, 0).size(), 96u);
}

TEST(RepeatedEvents, WhatChangesNoCellIsRefusedOrPassedOver) {
  // It holds one element, and so less than half of any cell.
  const std::string where =
      "where = { sphere = { centre = [\"20 mm\", \"20 mm\", \"20 mm\"], radius = \"3 mm\" } "
      "}\n";
  for (const std::string what : {"do = \"carve\"\n", "do = \"edit\"\nstiffness = 3\ndensity = 2\n"}) {
    const std::string small = what + where;
    try {
      (void)run_scene(scene_with("[[event]]\nat = \"1 ms\"\n" + small));
      ADD_FAILURE() << "accepted: " << what;
    } catch (const DivergedError& error) {
      EXPECT_THAT(error.what(), HasSubstr("no cell has more than half of its elements in sphere"));
    }
    const testing::TimedCase made =
        run_scene(scene_with("[[event]]\nat = \"1 ms\"\nevery = \"2 ms\"\n" + small));
    EXPECT_EQ(cells_of(made.body, 0).size(), 96u);
  }
  // Friction is of elements.
  (void)run_scene(scene_with("[[event]]\nat = \"1 ms\"\ndo = \"edit\"\nfriction = 2\n" + where));
}

TEST(RepeatedEvents, WhatAnEventHasEditedIsForgottenWhereTheRunEndsBeforeItsLastTime) {
  Body body = block_of("work", {2, 2, 2}, Vec3::Zero());
  for (const char* name : {"edited_12", "edited_by", "edited_", "edited_1x"})
    body.cell_columns[name] = {1, std::vector<double>(body.cell_count(), 1)};
  body.element_columns["edited_7"] = {1, std::vector<double>(body.element_count(), 1)};
  forget_edits(body);
  EXPECT_FALSE(body.cell_columns.contains("edited_12"));
  EXPECT_EQ(body.cell_columns.size(), 3u) << "others are the user's";
  EXPECT_TRUE(body.element_columns.empty());
}

TEST(RepeatedEvents, TimesThatRoundingTellsApartAreOne) {
  // 0.1 s, three times, is not 0.3 s: velocities were led to the time of the second event twice.
  const auto falling = [](const std::string& second) {
    const std::string fall =
        "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 "
        "kg/m3\"\n[gravity]\nacceleration = [0, 0, \"-9.81 m/s2\"]\n[run]\nmethod = \"verlet\"\ntime = \"40 "
        "ms\"\n";
    const auto edit_at = [](const std::string& at) {
      return "[[event]]\ndo = \"edit\"\nfriction = 2\nat = \"" + at + "\"\n";
    };
    const testing::TimedCase made =
        testing::run_timed(block_of("work", {2, 2, 2}, Vec3::Zero()),
                           parse_scene(fall + edit_at("0.03 s") + edit_at(second), "scene.toml"));
    testing::expect_books_close(made.result);
    return made.history.column("momentum z").back();
  };
  const double at_once = falling("0.03 s");
  EXPECT_NEAR(at_once, -9.81 * 0.04 * 8e-3, 1e-12);
  EXPECT_NEAR(falling("0.030000000000000006 s"), at_once, 1e-12);
  EXPECT_NEAR(falling("0.03000000000001 s"), at_once, 1e-12) << "no step lies between these either";
}

TEST(RepeatedEvents, AWelderFusesOnce) {
  // Blocks whose elements meet: the nearest of the cells that share one is another at each time.
  Body body = block_of("lower", {3, 3, 2}, Vec3::Zero());
  append(body, block_of("upper", {3, 3, 2}, Vec3(0, 0, 0.02)));
  const auto fused = [&](const std::string& every) {
    const Body made =
        testing::run_timed(
            body,
            parse_scene(
                "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = "
                "\"1000 kg/m3\"\n[run]\ntime = \"6 ms\"\n[[fix]]\nwhere = \"lower/z0\"\n[[load]]\nwhere = "
                "\"upper/z1\"\nforce = [\"2 N\", \"1 N\", \"1 N\"]\n[[event]]\nat = \"0 s\"\ndo = "
                "\"fuse\"\nwithin = \"4 mm\"\n" +
                    every,
                "scene.toml"))
            .body;
    return fused_points(made).size();
  };
  const std::size_t once = fused("");
  EXPECT_GT(once, 16u);
  EXPECT_EQ(fused("every = \"1 ms\"\n"), once);
}

TEST(RepeatedEvents, OneOfAListThatHoldsNothingIsNotPassedOver) {
  const std::string box =
      "{ box = { min = [\"-1 mm\", \"-1 mm\", \"-1 mm\"], max = [\"25 mm\", \"25 mm\", \"25 mm\"] } }";
  const std::string none = "{ sphere = { centre = [\"1 m\", 0, 0], radius = \"9 mm\" } }";
  for (const std::string& where : {"[" + box + ", " + none + "]", "{ not = " + none + " }"}) try {
      (void)run_scene(
          scene_with("[[event]]\nat = \"1 ms\"\nevery = \"1 ms\"\ndo = \"carve\"\nwhere = " + where + "\n"));
      ADD_FAILURE() << "accepted: " << where;
    } catch (const DivergedError& error) {
      EXPECT_THAT(error.what(), HasSubstr("each needs to hold something"));
    }
}

TEST(RepeatedEvents, WrongEntriesAreRefused) {
  const auto message = [](const std::string& event) -> std::string {
    try {
      (void)run_scene(scene_with("[[event]]\n" + event));
    } catch (const InputError& error) {
      return error.what();
    } catch (const DivergedError& error) {
      return error.what();
    }
    return "";
  };
  const std::string carve = "at = \"1 ms\"\ndo = \"carve\"\n" + sphere();
  EXPECT_THAT(message(carve + "every = \"0 s\""), HasSubstr("above 0"));
  EXPECT_THAT(message(carve + "until = \"4 ms\""), HasSubstr("give that too"));
  EXPECT_THAT(message(carve + "every = \"1 ms\"\nuntil = \"0.5 ms\""), HasSubstr("is not between"));
  EXPECT_THAT(message(carve + "every = \"1 ms\"\nuntil = \"1 s\""), HasSubstr("is not between"));
  EXPECT_THAT(message(carve + "every = \"1 ns\""), HasSubstr("at most 10000"));
  EXPECT_THAT(message("at = \"1 ms\"\ndo = \"carve\"\nwhere = \"work/x0\"\nwith = \"mill\""),
              HasSubstr("moves a box, a sphere"));
  EXPECT_THAT(message("at = \"1 ms\"\ndo = \"renormalise\"\nwith = \"mill\""),
              HasSubstr("moves a box, a sphere"));
  EXPECT_THAT(message("at = \"1 ms\"\ndo = \"add\"\nbody = \"a.vtu\"\nevery = \"1 ms\""),
              HasSubstr("added once"));
  EXPECT_THAT(
      message("at = \"1 ms\"\ndo = \"edit\"\nstiffness = 2\nconnections = \"inside\"\nevery = \"1 ms\""),
      HasSubstr("edited once"));
  std::string other = carve;
  other.replace(other.find("with = \"mill\""), 13, "with = \"milk\"");
  EXPECT_THAT(message(other), HasSubstr("no part is called that; did you mean \"mill\"?"));
  EXPECT_THROW(
      (void)parse_scene(
          "event = [{ at = \"1 ms\", every = \"1 ms\", do = \"carve\", where = \"work\" }, { at = \"2 ms\", "
          "every = \"1 ms\", do = \"carve\", where = \"mill\" }]\n[run]\ntime = \"9 ms\"\n",
          "scene.toml"),
      InputError)
      << "they would be told apart by their line";
  EXPECT_THROW(
      (void)parse_scene("[[event]]\ndo = \"carve\"\nevery = \"1 ms\"\nwhere = \"work\"\n", "scene.toml"),
      InputError);
}

}  // namespace
}  // namespace flexel::simulate
