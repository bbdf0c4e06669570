// Events of timed runs: what each leaves behind, momenta and books across them, and what is refused.
#include <gmock/gmock.h>

#include "base/error.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/cell_moments.h"
#include "tests/scratch.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::book;
using testing::box_body;
using testing::BoxOptions;
using testing::Csv;
using testing::expect_books_close;
using ::testing::HasSubstr;
using testing::random_displacements;
using testing::run_timed;
using testing::set_velocity;
using testing::TimedCase;

Body bar_of_cells(std::array<int, 3> cells = {8, 2, 2}) {
  BoxOptions options;
  options.cells = cells;
  options.spacing = Vec3::Constant(1e-2);
  options.name = "bar";
  return box_body(options);
}

Scene gum_scene_with(const std::string& rest) {
  return parse_scene(
      "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 kg/m3\"\n" +
          rest,
      "scene.toml");
}

std::string event(const std::string& at, const std::string& keys) {
  return "[[event]]\nat = \"" + at + "\"\n" + keys + "\n";
}

// Thrown, spinning, with waves running in it.
Body lively_bar() {
  Body body = bar_of_cells();
  std::vector<Vec3> velocity;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    velocity.push_back(Vec3(1, 0.5, 0) + Vec3(0, 0, 20).cross(body.rest[e]));
    const double phase = 2 * M_PI * body.rest[e].x() / 0.08;
    body.position[e] += Vec3(2e-4 * std::sin(phase), 0, 1e-3 * std::cos(phase));
  }
  set_velocity(body, velocity);
  return body;
}

// Momenta before and after the row at which an event happens, which comes twice.
struct Rows {
  std::size_t before = 0, after = 0;
};
Rows at_event(const Csv& history) {
  const std::vector<double>& time = history.column("time");
  for (std::size_t i = 1; i < time.size(); ++i)
    if (time[i] == time[i - 1]) return {i - 1, i};
  ADD_FAILURE() << "no event in the books";
  return {};
}

TEST(Events, RenormalisedBodyRestsAsItIs) {
  for (const char* model : {"cells", "springs"}) {
    Body body = bar_of_cells();
    const std::vector<Vec3> bent = random_displacements(body, 2e-3, 1);
    for (std::size_t e = 0; e < bent.size(); ++e) body.position[e] += bent[e];
    const std::vector<Vec3> before = body.position;
    const TimedCase made = run_timed(std::move(body), gum_scene_with(std::string("[parts.bar]\nmodel = \"") +
                                                                     model + "\"\n[run]\ntime = \"20 ms\"\n" +
                                                                     event("0 s", "do = \"renormalise\"")));
    for (std::size_t e = 0; e < before.size(); ++e)
      EXPECT_LT((made.body.position[e] - before[e]).norm(), 1e-13) << model;
    EXPECT_TRUE(
        made.body.cell_columns.contains(model == std::string("cells") ? "rest_volume" : "spring_flow"));
    // a run from the file goes on from there, with no word of plasticity or events
    const TimedCase next = run_timed(made.body, gum_scene_with(std::string("[parts.bar]\nmodel = \"") +
                                                               model + "\"\n[run]\ntime = \"5 ms\"\n"));
    for (std::size_t e = 0; e < before.size(); ++e)
      EXPECT_LT((next.body.position[e] - before[e]).norm(), 1e-13) << model;
  }
}

TEST(Events, RenormalisingKeepsMomentaAndBooks) {
  const TimedCase made = run_timed(
      lively_bar(),
      gum_scene_with("[run]\ntime = \"20 ms\"\nstep = \"50 us\"\n" + event("10 ms", "do = \"renormalise\"")));
  testing::expect_momenta_kept(made.history, 1e-9);
  expect_books_close(made.result);
  const auto [before, after] = at_event(made.history);
  const double elastic = made.history.column("elastic")[before];
  EXPECT_GT(elastic, 0);
  EXPECT_LT(made.history.column("elastic")[after], 1e-12 * elastic);
  const auto both = [&](std::size_t row) {
    return made.history.column("kinetic")[row] + made.history.column("elastic")[row];
  };
  EXPECT_NEAR(made.history.column("events work")[after], both(after) - both(before), 1e-6 * both(before));
}

TEST(Events, EditOfMassAndStiffnessChangesTheFrequency) {
  // Length changes of a held bar: omega ~ sqrt(E / rho).
  const auto period = [](const std::string& events) {
    Body body = bar_of_cells({8, 1, 1});
    std::vector<Vec3> velocity;
    for (const Vec3& at : body.rest) velocity.emplace_back(1e-3 * std::sin(0.5 * M_PI * at.x() / 0.08), 0, 0);
    set_velocity(body, velocity);
    const TimedCase made = run_timed(
        std::move(body), gum_scene_with("[[fix]]\nwhere = \"x0\"\n[[probe]]\nname = \"end\"\nwhere = \"x1\"\n"
                                        "[run]\ntime = \"100 ms\"\nhistory_every = \"50 us\"\n" +
                                        events));
    expect_books_close(made.result);
    const std::vector<double>& time = made.history.column("time");
    const std::vector<double>& x = made.history.column("end x");
    std::vector<double> turns;
    for (std::size_t i = 1; i < x.size(); ++i)
      if (x[i - 1] < 0 && x[i] >= 0)
        turns.push_back(time[i - 1] - x[i - 1] * (time[i] - time[i - 1]) / (x[i] - x[i - 1]));
    EXPECT_GT(turns.size(), 4u);
    return (turns.back() - turns.front()) / static_cast<double>(turns.size() - 1);
  };
  const double plain = period("");
  EXPECT_NEAR(period(event("0 s", "do = \"edit\"\nstiffness = 2")), plain / std::sqrt(2.0), 0.01 * plain);
  EXPECT_NEAR(period(event("0 s", "do = \"edit\"\ndensity = 2")), plain * std::sqrt(2.0), 0.01 * plain);
  EXPECT_NEAR(
      period(event("0 s", "do = \"edit\"\ndensity = 2") + event("0 s", "do = \"edit\"\nstiffness = 2")),
      plain, 0.001 * plain);
}

// An edit of the whole is a scene with another time, whether the damping takes stages or not.
TEST(Events, EditOfDampingIsAnotherDamping) {
  for (const char* model : {"cells", "springs"})
    for (const double tau : {20e-6, 5e-3}) {
      const auto swung = [&](double time, const std::string& events) {
        return run_timed(lively_bar(),
                         gum_scene_with("[parts.bar]\nmodel = \"" + std::string(model) +
                                        "\"\n[damping]\ntime = \"" + std::to_string(1e6 * time) +
                                        " us\"\n[run]\nstep = \"20 us\"\ntime = \"4 ms\"\n" + events));
      };
      const TimedCase edited = swung(tau, event("0 s", "do = \"edit\"\ndamping = 2"));
      const TimedCase other = swung(2 * tau, "");
      expect_books_close(edited.result);
      EXPECT_EQ(edited.body.position, other.body.position) << model << tau;
      EXPECT_NE(edited.body.position, swung(tau, "").body.position) << model << tau;
      // from the file on as in the run, without an edit
      EXPECT_EQ(edited.body.cell_columns.at("damping_change").values,
                std::vector<double>(edited.body.cell_count(), 1));
    }
}

// Steps become ten times as short: the new forces act from the event on, not for half of the step before it.
TEST(Events, EditThatShortensTheStepClosesItsBooks) {
  Body body = bar_of_cells();  // stretched in its first mode, and let go
  for (Vec3& at : body.position) at.x() -= 4e-4 * std::cos(M_PI * at.x() / 0.08);
  const TimedCase made =
      run_timed(std::move(body),
                gum_scene_with("[run]\ntime = \"4 ms\"\n" + event("2 ms", "do = \"edit\"\nstiffness = 100")));
  expect_books_close(made.result);
  EXPECT_GT(made.history.column("events work").back(), 0.1);  // J
}

TEST(Events, EditOfMassKeepsVelocities) {
  Body body = bar_of_cells();
  set_velocity(body, std::vector<Vec3>(body.element_count(), Vec3(2, 0, 0)));
  const TimedCase made =
      run_timed(std::move(body),
                gum_scene_with("[run]\ntime = \"10 ms\"\n" +
                               event("5 ms",
                                     "do = \"edit\"\ndensity = 3\nwhere = { box = { min = [\"39 mm\", "
                                     "\"-9 mm\", \"-9 mm\"], max = [\"99 mm\", \"99 mm\", \"99 mm\"] } }\n"
                                     "positions = \"rest\"")));
  const auto [before, after] = at_event(made.history);
  const double kinetic = made.history.column("kinetic")[before];
  EXPECT_NEAR(kinetic, 0.5 * 32e-6 * 1000 * 4, 1e-9);
  EXPECT_NEAR(made.history.column("kinetic")[after], 2 * kinetic,
              1e-8 * kinetic);  // half of it weighs 3 times
  EXPECT_NEAR(made.history.column("events work")[after], kinetic, 1e-8 * kinetic);
  EXPECT_NEAR(made.result.mass, 0.064, 1e-12);
  expect_books_close(made.result);
}

TEST(Events, CarvedHalfLeavesHalf) {
  Body bar = lively_bar();
  bar.moment_cells = {0, static_cast<std::uint32_t>(bar.cell_count() - 1)};
  for (int cell = 0; cell < 2; ++cell)
    for (const double moment : whole_moments()) bar.moments.push_back(moment);
  const TimedCase made = run_timed(
      bar, gum_scene_with(
               "[run]\ntime = \"20 ms\"\nstep = \"50 us\"\n" +
               event("10 ms",
                     "do = \"carve\"\npositions = \"rest\"\nwhere = { half_space = { point = [\"40 mm\", "
                     "0, 0], normal = [1, 0, 0] } }")));
  EXPECT_NEAR(made.result.mass, 0.016, 1e-12);
  EXPECT_EQ(made.body.cell_count(), 16u);
  EXPECT_EQ(made.body.element_count(), 45u);
  EXPECT_NO_THROW(check(made.body, "carved"));
  EXPECT_EQ(made.body.moment_cells, std::vector<std::uint32_t>{0});
  expect_books_close(made.result);
  const auto [before, after] = at_event(made.history);
  const double kinetic = made.history.column("kinetic")[before];
  EXPECT_LT(made.history.column("events work")[after], -0.3 * kinetic);
  for (const std::string name : {"momentum", "angular momentum"})
    for (const char* axis : {" x", " y", " z"}) {
      const std::vector<double>& value = made.history.column(name + axis);
      for (std::size_t i = after; i < value.size(); ++i) EXPECT_NEAR(value[i], value[after], 1e-10);
    }
  EXPECT_NEAR(made.history.column("momentum y")[after], 0.016 * (0.5 + 20 * 0.02), 2e-3);
  // The quad over the carved end bounds no matter any more; those along the bar still do.
  const std::vector<double>& carved = made.body.surface.polygon_columns.at("carved").values;
  EXPECT_EQ(carved, (std::vector<double>{0, 1, 0, 0, 0, 0}));
}

TEST(Events, CarvingEverythingIsRefused) {
  try {
    (void)run_timed(bar_of_cells(),
                    gum_scene_with("[run]\ntime = \"2 ms\"\n" +
                                   event("1 ms",
                                         "do = \"carve\"\nwhere = { sphere = { centre = [\"0 mm\", 0, 0], "
                                         "radius = \"1 m\" } }")));
    FAIL() << "accepted";
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("leaves nothing of part \"bar\""));
  }
}

TEST(Events, FusedBlocksFlyAsOne) {
  BoxOptions options;
  options.cells = {4, 2, 2};
  options.spacing = Vec3::Constant(1e-2);
  options.name = "left";
  Body body = box_body(options);
  options.name = "right";
  options.origin = Vec3(4.015e-2, 0.3e-2, 0.2e-2);  // 0.15 mm away, shifted
  const Body right = box_body(options);
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("fuse_right.vtu");
  write_body(right, path);
  set_velocity(body, std::vector<Vec3>(body.element_count(), Vec3(0.02, 0, 0)));
  const std::string add = event("0 s", "do = \"add\"\nbody = \"" + path + "\"");
  const std::string run = "[run]\ntime = \"100 ms\"\n";
  const TimedCase made =
      run_timed(body, gum_scene_with(run + add + event("0 s", "do = \"fuse\"\nwithin = \"0.2 mm\"")));
  expect_books_close(made.result);
  const auto mean = [](const TimedCase& of, std::uint32_t part) {
    Vec3 sum = Vec3::Zero();
    const Part& range = of.body.parts[part];
    for (std::uint32_t e = range.element_begin; e < range.element_end; ++e)
      sum += of.body.position[e] - of.body.rest[e];
    return Vec3(sum / (range.element_end - range.element_begin));
  };
  ASSERT_EQ(made.body.parts.size(), 2u);
  EXPECT_NEAR(mean(made, 1).x(), 0.01 * 0.1, 2e-4) << "drawn along at half of the speed";
  testing::expect_momenta_kept(made.history, 1e-9);
  const TimedCase apart = run_timed(body, gum_scene_with(run + add));
  EXPECT_EQ(mean(apart, 1).norm(), 0);
  EXPECT_THROW(
      (void)run_timed(body, gum_scene_with(run + add + event("0 s", "do = \"fuse\"\nwithin = \"1 um\""))),
      InputError);
}

TEST(Events, AddedBodyFallsLikeTheOthers) {
  BoxOptions options;
  options.cells = {2, 2, 2};
  options.spacing = Vec3::Constant(1e-2);
  options.name = "late";
  options.origin = Vec3(1, 0, 0);
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("late.vtu");
  write_body(box_body(options), path);
  const TimedCase made = run_timed(
      bar_of_cells(),
      gum_scene_with("[gravity]\nacceleration = [0, 0, \"-9.81 m/s2\"]\n[run]\ntime = \"100 ms\"\n" +
                     event("50 ms", "do = \"add\"\nbody = \"" + path +
                                        "\"\nvelocity = [\"0 m/s\", \"1 m/s\", \"0 "
                                        "m/s\"]")));
  ASSERT_EQ(made.body.parts.size(), 2u);
  const std::vector<double>& v = made.body.element_columns.at("velocity").values;
  const std::size_t first = made.body.parts[1].element_begin;
  EXPECT_NEAR(v[2], -0.981, 2e-3);
  EXPECT_NEAR(v[3 * first + 2], -0.4905, 2e-3);
  EXPECT_NEAR(made.body.position[first].y(), 0.05, 1e-9);
  EXPECT_NEAR(made.result.mass, 0.040, 1e-12);
  expect_books_close(made.result);
}

TEST(Events, BrokenCellsAreHealedWhereTheyAreWhole) {
  Body body = bar_of_cells();
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    body.broken[c] = body.lattice_index[body.cell_elements[c][0]][0] == 4;
  derive_connections(body);
  const std::string pull =
      "[[velocity]]\nwhere = { half_space = { point = [\"45 mm\", 0, 0], normal = [1, 0, 0] } }\nvelocity = "
      "[\"10 "
      "mm/s\", 0, 0]\n[run]\ntime = \"50 ms\"\n";
  const auto stretch = [&](const std::string& events) {
    const TimedCase made = run_timed(body, gum_scene_with(pull + events));
    double low = 0, high = 0;
    for (std::size_t e = 0; e < made.body.element_count(); ++e) {
      const double u = (made.body.position[e] - made.body.rest[e]).x();
      made.body.lattice_index[e][0] <= 4 ? low += u / 45 : high += u / 36;
    }
    return high - low;
  };
  EXPECT_NEAR(stretch(""), 0.5e-3, 1e-6) << "parted: the right one flies on";
  EXPECT_LT(stretch(event("0 s", "do = \"fuse\"\nwithin = \"1 mm\"")), 0.1e-3);
}

// Two blocks that come, one of which is drawn, the other held; nothing acts on them before.
TEST(Events, PartsThatComeCanBeSelectedByTheScene) {
  const flexel::test::Scratch scratch;
  const auto block = [&](const std::string& name, double x) {
    BoxOptions options;
    options.cells = {2, 2, 2};
    options.spacing = Vec3::Constant(1e-2);
    options.name = name;
    options.origin = Vec3(x, 0, 0);
    write_body(box_body(options), scratch.path(name + ".vtu"));
    return event("2 ms", "do = \"add\"\nbody = \"" + scratch.path(name + ".vtu") + "\"");
  };
  const std::string text =
      "[run]\ntime = \"10 ms\"\n[gravity]\nacceleration = [0, 0, \"-1 m/s2\"]\n[[load]]\nwhere = "
      "\"drawn/x1\"\nforce = [\"0.4 N\", 0, 0]\n[[fix]]\nwhere = \"held\"\n" +
      block("drawn", 0.2) + block("held", 0.4);
  const TimedCase made = run_timed(bar_of_cells(), gum_scene_with(text));
  expect_books_close(made.result);
  ASSERT_EQ(made.body.parts.size(), 3u);
  const auto momentum = [&](std::size_t part, std::size_t axis) {
    double sum = 0;
    for (std::uint32_t e = made.body.parts[part].element_begin; e < made.body.parts[part].element_end; ++e)
      sum += made.body.element_columns.at("velocity").values[3 * e + axis];
    return sum;
  };
  for (std::uint32_t e = made.body.parts[2].element_begin; e < made.body.element_count(); ++e)
    EXPECT_EQ(made.body.position[e], made.body.rest[e]) << "held from the moment that it came";
  EXPECT_EQ(momentum(2, 2), 0);
  // 8 g drawn by 0.4 N for 8 ms; the middle moves by half of a t^2
  Vec3 middle = Vec3::Zero();
  const Part& drawn = made.body.parts[1];
  for (std::uint32_t e = drawn.element_begin; e < drawn.element_end; ++e)
    middle += (made.body.position[e] - made.body.rest[e]) / (drawn.element_end - drawn.element_begin);
  EXPECT_NEAR(middle.x(), 0.5 * 50 * 0.008 * 0.008, 0.1 * 0.5 * 50 * 0.008 * 0.008);
  EXPECT_THROW(
      (void)run_timed(bar_of_cells(), gum_scene_with("[run]\ntime = \"1 ms\"\n[[fix]]\nwhere = \"drwn\"\n")),
      InputError);
}

// What a selection names beside a part that comes is held from the beginning.
TEST(Events, SelectionsWithPartsThatComeHoldTheRestBefore) {
  const flexel::test::Scratch scratch;
  BoxOptions options;
  options.cells = {2, 2, 2};
  options.spacing = Vec3::Constant(1e-2);
  options.name = "late";
  options.origin = Vec3(0.4, 0, 0);
  write_body(box_body(options), scratch.path("late.vtu"));
  for (const char* where : {"[\"bar\", \"late\"]", "{ not = \"late\" }"}) {
    const std::string text =
        "[run]\ntime = \"4 ms\"\n[gravity]\nacceleration = [0, 0, \"-1 m/s2\"]\n[[fix]]\nwhere = " +
        std::string(where) + "\n" +
        event("2 ms", "do = \"add\"\nbody = \"" + scratch.path("late.vtu") + "\"");
    const TimedCase made = run_timed(bar_of_cells(), gum_scene_with(text));
    ASSERT_EQ(made.body.parts.size(), 2u);
    std::size_t before = 0;
    for (std::size_t i = 0; i < made.history.column("time").size(); ++i) {
      if (made.history.column("time")[i] >= 2e-3) continue;
      ++before;
      EXPECT_EQ(made.history.column("kinetic")[i], 0) << where;
    }
    EXPECT_GT(before, 1u);
  }
}

TEST(Events, WrongEntriesAreRefused) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      (void)gum_scene_with(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string run = "[run]\ntime = \"1 s\"\n";
  EXPECT_THAT(message(run + event("2 s", "do = \"renormalise\"")), HasSubstr("not within the run"));
  EXPECT_THAT(message(run + event("0.2 s", "do = \"renormalize\"")),
              HasSubstr("did you mean \"renormalise\"?"));
  EXPECT_THAT(message(event("0.2 s", "do = \"renormalise\"")), HasSubstr("a time of a timed run"));
  EXPECT_THAT(message(run + event("0.2 s", "do = \"edit\"")),
              HasSubstr("needs \"stiffness\", \"damping\", \"density\""));
  EXPECT_THAT(message(run + event("0.2 s", "do = \"edit\"\nstiffness = 0")), HasSubstr("is a factor"));
  EXPECT_THAT(message(run + event("0.2 s", "do = \"carve\"")), HasSubstr("where"));
  EXPECT_THAT(message(run + event("0.2 s", "do = \"fuse\"")), HasSubstr("within"));
  EXPECT_THAT(message(run + event("0.2 s", "do = \"renormalise\"\nwhen = 3")), HasSubstr("unknown key"));
}

}  // namespace
}  // namespace flexel::simulate
