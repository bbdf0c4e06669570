// Events of a scene without a time: they change the body before equilibrium is looked for.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/fields.h"
#include "formats/lattice/fused_points.h"
#include "formats/lattice/merge.h"
#include "simulate/scene/scene.h"
#include "simulate/scene/strength.h"
#include "tests/scratch.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;
using ::testing::HasSubstr;
using testing::refusal;
using testing::simulate_quietly;

constexpr double kBarCell = 0.01;  // m

Body resting_bar(const std::string& name = "bar", const Vec3& origin = Vec3::Zero()) {
  BoxOptions options;
  options.cells = {6, 2, 2};
  options.spacing = Vec3::Constant(kBarCell);
  options.name = name;
  options.origin = origin;
  return box_body(options);
}

Scene rest_scene(const std::string& text, const std::string& name = "scene.toml") {
  return parse_scene(
      "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 kg/m3\"\n" +
          text,
      name);
}

const std::string kPulled =
    "[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = \"x1\"\nforce = [0, 0, \"-0.02 N\"]\n";

Vec3 end_of(Body body, const std::string& events) {
  (void)simulate_quietly(body, rest_scene(kPulled + events));
  return body.position.back() - body.rest.back();
}

// Twice as stiff everywhere: half as far, but for what bending itself changes.
TEST(EventsAtRest, AnEditActsBeforeTheLoad) {
  const Vec3 plain = end_of(resting_bar(), ""),
             edited = end_of(resting_bar(), "[[event]]\ndo = \"edit\"\nstiffness = 2\n");
  EXPECT_NEAR(edited.z(), 0.5 * plain.z(), 1e-4 * std::abs(plain.z()));
  // in the order of the file: twice twice
  const Vec3 twice = end_of(resting_bar(),
                            "[[event]]\ndo = \"edit\"\nstiffness = 2\n[[event]]\ndo = "
                            "\"edit\"\nstiffness = 2\n");
  EXPECT_NEAR(twice.z(), 0.25 * plain.z(), 1e-4 * std::abs(plain.z()));
}

// How far the second of two bars goes, all of whose matter is so many times as stiff: by its material, or by an edit.
Vec3 moved_at(double stiffer, bool by_edit, const std::string& top, const std::string& text, double gap) {
  Body body = resting_bar();
  append(body, resting_bar("other", Vec3(6 * kBarCell + gap, 0, 0)));
  const std::string gum = fmt::format(
      "material = \"gum\"\n[materials.gum]\nyoung = \"{} MPa\"\npoisson = 0.3\ndensity = \"1000 "
      "kg/m3\"\n",
      by_edit ? 1 : stiffer);
  const std::string edit = by_edit ? fmt::format("[[event]]\ndo = \"edit\"\nstiffness = {}\n", stiffer) : "";
  (void)simulate_quietly(body, parse_scene(top + gum + edit + text, "s.toml"));
  return body.position.back() - body.rest.back();
}

// What holds matter, what parts have between them and what pushes it is as stiff as the matter that it touches.
TEST(EventsAtRest, WhatTouchesEditedMatterIsAsStiffAsIt) {
  const std::string bent =
      "[[fix]]\nwhere = \"bar/x0\"\n[[load]]\nwhere = \"other/x1\"\nforce = [0, 0, \"-0.02 N\"]\n";
  const std::string pressed =
      "[[fix]]\nwhere = \"bar/x0\"\n[[fix]]\nwhere = \"other/x1\"\naxes = "
      "\"yz\"\n[[load]]\nwhere = \"other/x1\"\nforce = [\"-0.2 N\", 0, 0]\n";
  const std::string dented =
      "[[fix]]\nwhere = \"bar/x0\"\n[[indenter]]\nball = { centre = [\"110 mm\", \"10 mm\", \"40 mm\"], "
      "radius = \"20 mm\" }\ndisplacement = [0, 0, \"-2 mm\"]\n";
  const std::string fuse = "[[event]]\ndo = \"fuse\"\nwithin = \"1 mm\"\n";
  using Case = std::tuple<const char*, std::string, double>;
  for (const auto& [top, text, gap] :
       {Case{"", bent, 0}, Case{"", dented, 0}, Case{"contact = true\n", pressed, 0},
        Case{"bond = false\n", fuse + bent, 5e-4}}) {
    const Vec3 made = moved_at(100, false, top, text, gap), edited = moved_at(100, true, top, text, gap);
    EXPECT_LT((edited - made).norm(), 1e-4 * made.norm()) << text;
  }
}

// As a timed run with the event at its start leaves the body, so equilibrium has it.
TEST(EventsAtRest, CarvingIsThatOfARunInTime) {
  const std::string carve =
      "do = \"carve\"\nwhere = { box = { min = [\"19 mm\", \"-1 mm\", \"9 mm\"], max = [\"41 mm\", \"21 "
      "mm\", \"21 "
      "mm\"] } }\n";
  Body timed = resting_bar();
  (void)simulate_quietly(timed, rest_scene("[[event]]\nat = \"0 s\"\n" + carve + "[run]\ntime = \"1 us\"\n"));
  timed.element_columns.erase("velocity");
  timed.position = timed.rest;
  Body rest = resting_bar();
  (void)simulate_quietly(rest, rest_scene(kPulled + "[[event]]\n" + carve));
  EXPECT_LT(rest.element_count(), resting_bar().element_count());
  EXPECT_EQ(rest.cell_elements, timed.cell_elements);
  EXPECT_EQ(rest.notes.at("carved"), timed.notes.at("carved"));
  (void)simulate_quietly(timed, rest_scene(kPulled));
  EXPECT_EQ(rest.position, timed.position);
  EXPECT_LT((rest.position.back() - rest.rest.back()).z(), 1.5 * end_of(resting_bar(), "").z()) << "weaker";
}

// What is told of the largest displacement is of the matter that is left, though the surface goes on.
TEST(EventsAtRest, WhatIsCarvedAwayHasNoDisplacement) {
  const std::string pulled = "[[fix]]\nwhere = \"x0\"\n[gravity]\nacceleration = [\"10 m/s2\", 0, 0]\n";
  Body body = resting_bar();
  const SimulateResult result = simulate_quietly(
      body, rest_scene(pulled + "[[event]]\ndo = \"carve\"\nwhere = { half_space = { point = [\"20 mm\", 0, "
                                "0], normal = [1, 0, 0] } }\n"));
  double largest = 0;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    largest = std::max(largest, (body.position[e] - body.rest[e]).norm());
  EXPECT_LT(result.largest_displacement_at.x(), 2 * kBarCell + 1e-9);
  EXPECT_NEAR(result.largest_displacement / largest, 1, 1e-12);
}

// A tip that was too little for a cell moves with the cell beside it, and goes on to where matter elsewhere is carved.
TEST(EventsAtRest, WhatWasTooLittleForACellIsNotCarvedAway) {
  BoxOptions options;
  options.cells = {6, 2, 2};
  options.spacing = Vec3::Constant(kBarCell);
  options.fill = [](int i, int, int) { return i < 5 ? 1.0 : 0.0; };
  Body body = box_body(options);
  const SimulateResult result = simulate_quietly(
      body, rest_scene("[[fix]]\nwhere = \"x0\"\n[gravity]\nacceleration = [\"10 m/s2\", 0, 0]\n[[event]]\n"
                       "do = \"carve\"\nwhere = { box = { min = [\"19 mm\", \"-1 mm\", \"9 mm\"], max = "
                       "[\"31 mm\", \"21 mm\", \"21 mm\"] } }\n"));
  EXPECT_NEAR(result.largest_displacement_at.x(), 6 * kBarCell, 1e-9);
}

// Frames after an event have the surface of the first one, whose polygons know no cell of theirs.
TEST(EventsAtRest, ACarvedBodyWhoseSurfaceKnowsNoCells) {
  Body body = resting_bar();
  const std::string carve =
      "[[event]]\ndo = \"carve\"\nwhere = { half_space = { point = [\"20 mm\", 0, 0], normal = [1, 0, 0] } "
      "}\n";
  (void)simulate_quietly(
      body, rest_scene("[[fix]]\nwhere = \"x0\"\n[gravity]\nacceleration = [\"10 m/s2\", 0, 0]\n" + carve));
  body.surface_cells.clear();
  body.surface_cell_offsets.clear();
  body.position.back() = body.rest.back() + Vec3(0, 0, 1);
  EXPECT_NEAR(largest_displacement(body).value(), 1, 1e-12);
}

// Two bars half a millimetre apart are one, and stay so in the body.
TEST(EventsAtRest, FusedPartsCarryEachOther) {
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("other.vtu");
  write_body(resting_bar("other", Vec3(6 * kBarCell + 5e-4, 0, 0)), path);
  const std::string
      add = "[[event]]\ndo = \"add\"\nbody = \"" + path + "\"\n",
      fuse = "[[event]]\ndo = \"fuse\"\nwithin = \"1 mm\"\n",
      pull = "[[fix]]\nwhere = \"bar/x0\"\n[[load]]\nwhere = \"other/x1\"\nforce = [0, 0, \"-0.02 N\"]\n";
  EXPECT_THAT(refusal(resting_bar(), rest_scene(pull + add)), HasSubstr("other")) << "it hangs on nothing";
  Body body = resting_bar();
  (void)simulate_quietly(body, rest_scene(pull + add + fuse));
  EXPECT_EQ(body.parts.size(), 2u);
  EXPECT_FALSE(fused_points(body).empty());
  // twice as long a cantilever: eight times as far, but for shear
  const double ratio = (body.position.back() - body.rest.back()).z() / end_of(resting_bar(), "").z();
  EXPECT_GT(ratio, 6);
  EXPECT_LT(ratio, 10);
  Body later = body;
  (void)simulate_quietly(later, rest_scene(pull));
  EXPECT_LT((later.position.back() - body.position.back()).norm(),
            1e-5 * (body.position.back() - body.rest.back()).norm());
}

// The shape that an earlier run left becomes the rest shape: without a load nothing moves.
TEST(EventsAtRest, RenormalisingKeepsTheShapeOfAnEarlierRun) {
  Body body = resting_bar();
  (void)simulate_quietly(body, rest_scene(kPulled));
  const std::vector<Vec3> bent = body.position;
  const std::string hold = "[[fix]]\nwhere = \"x0\"\n";
  Body sprung = body;
  (void)simulate_quietly(sprung, rest_scene(hold));
  (void)simulate_quietly(body, rest_scene(hold + "[[event]]\ndo = \"renormalise\"\n"));
  const double way = (bent.back() - body.rest.back()).norm();
  EXPECT_LT((body.position.back() - bent.back()).norm(), 1e-6 * way);
  EXPECT_GT((sprung.position.back() - bent.back()).norm(), 0.9 * way);
}

// With contact equilibrium is looked for in steps: the events come before them too.
TEST(EventsAtRest, TheyComeBeforeARunThatSettlesToo) {
  const auto sag = [](const std::string& event) {
    Body body = resting_bar();
    (void)simulate_quietly(
        body, rest_scene("[contact]\nself = true\n[[fix]]\nwhere = \"x0\"\n[gravity]\nacceleration = [0, 0, "
                         "\"-1 m/s2\"]\n" +
                         event));
    return (body.position.back() - body.rest.back()).z();
  };
  EXPECT_NEAR(sag("[[event]]\ndo = \"edit\"\nstiffness = 2\n"), 0.5 * sag(""), 2e-3 * std::abs(sag("")));
}

// What edits make of the yield stress is not the material's: no share of it is told.
TEST(EventsAtRest, SharesOfTheMaterialsYieldAreNotToldOfEditedParts) {
  const auto share = [](const std::string& event) {
    Body body = resting_bar();
    const SimulateResult result = simulate_quietly(body, rest_scene("yield = \"1 kPa\"\n" + kPulled + event));
    std::vector<std::string> unknown;
    const std::vector<Material> materials(1, {"gum", 1e6, 0.3, 1000, "", 1e3});
    EXPECT_EQ(nearest_to_strength(body, materials, unknown).has_value(),
              result.stress->yield_share.has_value());
    EXPECT_EQ(unknown.empty(), result.stress->yield_share.has_value());
    return result.stress->yield_share;
  };
  EXPECT_GT(share("").value_or(0), 0);
  EXPECT_TRUE(share("[[event]]\ndo = \"edit\"\ndensity = 2\n").has_value());
  for (const char* what : {"yield", "strength", "stiffness"})
    EXPECT_FALSE(share(std::string("[[event]]\ndo = \"edit\"\n") + what + " = 0.5\n").has_value()) << what;
}

// A material that breaks before it yields, and two parts of which one is nearer to its limit across its layers.
TEST(Strength, TheLeastLimitCounts) {
  Body body = resting_bar();
  body.element_columns["von_mises"] = {1, std::vector<double>(body.element_count(), 2e3)};
  std::vector<std::string> unknown;
  const auto told = [&](double yield, double strength, double across) {
    Material gum{"gum", 1e6, 0.3, 1000, "", yield};
    gum.strength = strength;
    gum.layer_strength = across;
    return nearest_to_strength(body, std::vector<Material>(body.parts.size(), gum), unknown).value();
  };
  EXPECT_EQ(told(1e4, 1e3, 0).share, 2);
  EXPECT_FALSE(told(1e4, 1e3, 0).yields);
  EXPECT_EQ(told(1e3, 1e4, 0).share, 2);
  EXPECT_TRUE(told(1e3, 1e4, 0).yields);
  EXPECT_EQ(told(1e3, 0, 0).share, 2);
  EXPECT_EQ(told(0, 1e3, 0).share, 2);
  const std::string gum = "[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 kg/m3\"\n";
  EXPECT_NO_THROW((void)parse_scene(gum + "strength = \"2 kPa\"\nlayer_strength = \"1 kPa\"\n", "s.toml"));
  EXPECT_THROW((void)parse_scene(gum + "layer_strength = \"1 kPa\"\n", "s.toml"), InputError);
  Part other = body.parts[0];
  other.name = "other";
  const std::uint32_t half = other.element_end / 2;
  body.parts[0].element_end = other.element_begin = half;
  body.parts.push_back(other);
  std::vector<Material> materials(2, {"gum", 1e6, 0.3, 1000, "", 1e4});
  materials[1].layer_strength = 1e3;
  EXPECT_EQ(nearest_to_strength(body, materials, unknown)->part, "other");
  std::swap(materials[0], materials[1]);
  EXPECT_EQ(nearest_to_strength(body, materials, unknown)->part, body.parts[0].name);
}

// Before anything is written into its columns.
TEST(EventsAtRest, ADamagedBodyIsNotAdded) {
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("damaged.vtu");
  Body damaged = resting_bar("other", Vec3(0.1, 0, 0));
  damaged.element_columns["connection_rest"] = {1, std::vector<double>(damaged.element_count(), 0)};
  write_body(damaged, path);
  const std::string add = "[[event]]\ndo = \"add\"\nbody = \"" + path + "\"\n";
  EXPECT_THAT(refusal(resting_bar(), rest_scene(kPulled + add)), HasSubstr("damaged.vtu: column"));
}

// At centre placement no element lies at a surface: an edit of one would change nothing, and say that it did.
TEST(EventsAtRest, ASurfaceOverNothingIsRefused) {
  testing::CentreOptions options;
  options.voxels = {4, 3, 3};
  options.spacing = kBarCell;
  const std::string hold = "[[fix]]\nwhere = \"xmin\"\n[gravity]\nacceleration = [0, 0, \"-1 m/s2\"]\n";
  EXPECT_THAT(refusal(testing::centre_body(options),
                      rest_scene(hold + "[[event]]\ndo = \"edit\"\nwhere = \"xmax\"\nstiffness = 2\n")),
              HasSubstr("surface only"));
}

TEST(EventsAtRest, AVelocityIsOfTimedRuns) {
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("other.vtu");
  write_body(resting_bar("other", Vec3(0.1, 0, 0)), path);
  EXPECT_THAT(refusal(resting_bar(), rest_scene(kPulled +
                                                "[[event]]\ndo = \"add\"\nvelocity = [\"1 m/s\", 0, 0]\nbody "
                                                "= \"" +
                                                path + "\"\n")),
              HasSubstr("\"velocity\" is of timed runs"));
}

TEST(EventsAtRest, ModelQuadraticRefusesThem) {
  EXPECT_THAT(refusal(resting_bar(),
                      rest_scene(kPulled + "[[event]]\ndo = \"edit\"\nstiffness = 2\n[parts.bar]\nmodel = "
                                           "\"quadratic\"\n")),
              HasSubstr("has no [[event]]"));
}

TEST(EventsAtRest, ATimeIsRefusedWithoutOne) {
  EXPECT_THROW(
      {
        try {
          (void)rest_scene("[[event]]\nat = \"1 s\"\ndo = \"renormalise\"\n");
        } catch (const InputError& error) {
          EXPECT_THAT(error.what(), HasSubstr("\"at\" is a time of a timed run"));
          throw;
        }
      },
      InputError);
  EXPECT_THROW((void)rest_scene("[run]\ntime = \"1 s\"\n[[event]]\ndo = \"renormalise\"\n"), InputError);
}

}  // namespace
}  // namespace flexel::simulate
