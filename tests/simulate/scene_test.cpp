// Scenes: values in SI, and one line with file:line for everything that is wrong.
#include "simulate/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "simulate/effects/gravity.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

constexpr const char* kWhole = R"(material = "gum"
[materials.gum]
young = "1.2 MPa"
poisson = 0.49
density = "930 kg/m3"
[parts.box]
model = "cells"
[[fix]]
where = ["xmin", { sphere = { centre = ["1 mm", 0, 0], radius = "2 mm" } }]
axes = "xz"
[[load]]
where = "box/2"
force = ["5 N", "0 N", "-1 kN"]
[[load]]
where = { not = "zmin" }
pressure = "2 MPa"
name = "wind"
[[move]]
where = { box = { min = [0, 0, 0], max = ["1 m", "1 m", "1 m"] } }
displacement = ["1 mm", "free", "0 mm"]
[[move]]
where = { half_space = { point = [0, 0, "3 mm"], normal = [0, 0, 2] } }
rotation = { axis = [0, 0, 1], through = [0, 0, 0], angle = "180 deg" }
[gravity]
acceleration = [0, 0, "-9.81 m/s2"]
[[probe]]
name = "tip"
at = ["10 mm", "5 mm", "3 mm"]
[run]
until = "equilibrium"
tolerance = 1e-9
load_steps = 4
)";

std::pair<std::string, std::string> parse_refusal_at(const std::string& text) {
  try {
    (void)parse_scene(text, "s.toml");
  } catch (const InputError& error) {
    return {error.where(), error.what()};
  }
  return {"", "accepted"};
}

TEST(Scene, ReadsEveryKeyInSi) {
  const Scene scene = parse_scene(kWhole, "s.toml");
  EXPECT_EQ(scene.materials.at("gum").young, 1.2e6);
  EXPECT_EQ(scene.materials.at("gum").poisson, 0.49);
  const auto& ties = scene.get<Supports>().ties;
  ASSERT_EQ(ties.size(), 3u);
  EXPECT_EQ(ties[0].axes, (std::array<bool, 3>{true, false, true}));
  EXPECT_EQ(ties[0].where.members[1].radius, 0.002);
  EXPECT_EQ(ties[1].axes, (std::array<bool, 3>{true, false, true}));
  EXPECT_EQ(ties[1].motion.translation, Vec3(0.001, 0, 0));
  EXPECT_NEAR(ties[2].motion.angle, M_PI, 1e-15);
  EXPECT_EQ(ties[2].where.normal, Vec3::UnitZ());
  const auto& loads = scene.get<Loads>().loads;
  ASSERT_EQ(loads.size(), 2u);
  EXPECT_EQ(*loads[0].force, Vec3(5, 0, -1000));
  EXPECT_EQ(*loads[1].pressure, 2e6);
  EXPECT_EQ(loads[1].name, "wind");
  EXPECT_EQ(*scene.get<Gravity>().acceleration, Vec3(0, 0, -9.81));
  EXPECT_EQ(*scene.probes[0].at, Vec3(0.01, 0.005, 0.003));
  EXPECT_EQ(scene.run.tolerance, 1e-9);
  EXPECT_EQ(scene.run.load_steps, 4);
}

struct Wrong {
  const char* text;
  const char* where;
  const char* says;
};

TEST(Scene, RefusesWithLineAndReason) {
  const Wrong cases[] = {
      {"material = \n", "s.toml:1", ""},
      {"\nmaterail = \"steel\"\n", "s.toml:2", "did you mean \"material\"?"},
      {"[[fix]]\nwher = \"xmin\"\n", "s.toml:2", "did you mean \"where\"?"},
      {"[[fix]]\nwhere = \"xmin\"\naxis = \"x\"\n", "s.toml:3", "did you mean \"axes\"?"},
      {"[[fix]]\nwhere = \"xmin\"\naxes = \"xq\"\n", "s.toml:3", "\"axes\""},
      {"[fixx]\nwhere = \"xmin\"\n", "s.toml:1", "did you mean \"fix\"?"},
      {"[[load]]\nwhere = \"xmin\"\nforce = [1, 0, 0]\n", "s.toml:3", "bare number"},
      {"[[load]]\nwhere = \"xmin\"\nforce = [\"1 mm\", 0, 0]\n", "s.toml:3", "force"},
      {"[[load]]\nwhere = \"xmin\"\nforce = \"5 N\"\n", "s.toml:3", "three values"},
      {"[[load]]\nwhere = \"xmin\"\n", "s.toml:1", "either \"force\""},
      {"[[load]]\nwhere = \"xmin\"\npressure = \"1 Pa\"\nforce = [0, 0, 0]\n", "s.toml:1",
       "either \"force\""},
      {"[[load]]\nwhere = 3\npressure = \"1 Pa\"\n", "s.toml:2", "\"where\""},
      {"[[load]]\nwhere = { sphere = { centre = [0, 0, 0], radius = 5 } }\npressure = \"1 Pa\"\n", "s.toml:2",
       "unit"},
      {"[[load]]\nwhere = { sphere = { path = [[0, 0, 0]], radius = \"1 mm\" } }\npressure = \"1 Pa\"\n",
       "s.toml:2", "two places or more"},
      {"[[load]]\nwhere = { sphere = { path = [[0, 0, 0], [0, 0, 0]], centre = [0, 0, 0], radius = \"1 mm\" "
       "} }\npressure = \"1 Pa\"\n",
       "s.toml:2", "either \"centre\" or \"path\""},
      {"[[load]]\nwhere = { ball = 1 }\npressure = \"1 Pa\"\n", "s.toml:2", "unknown key \"ball\""},
      {"[[move]]\nwhere = \"xmin\"\n", "s.toml:1", "needs \"displacement\""},
      {"[[move]]\nwhere = \"xmin\"\ndisplacement = [\"free\", \"free\", \"free\"]\n", "s.toml:1",
       "every axis free"},
      {"[[move]]\nwhere = \"xmin\"\nrotation = { axis = [0, 0, 0], through = [0, 0, 0], angle = \"1 deg\" "
       "}\n",
       "s.toml:3", "direction"},
      {"[[move]]\nwhere = \"xmin\"\nrotation = { axis = [0, 0, 1], through = [0, 0, 0], angle = \"1 deg\", "
       "arc_from = [0, 0, \"1 mm\"] }\n",
       "s.toml:3", "makes no arc"},
      {"[[move]]\nwhere = \"xmin\"\nrotation = { axis = [0, 0, 1], through = [0, 0, 0], angle = \"1 deg\", "
       "arc_from = [0, 0, 0] }\n",
       "s.toml:3", "makes no arc"},
      {"[[move]]\nwhere = \"xmin\"\nrotation = { axis = [0, 0, 1], through = [0, 0, 0], angle = 0, "
       "arc_from = [\"1 mm\", 0, 0] }\n",
       "s.toml:3", "other than 0"},
      {"[materials.x]\nyoung = \"1 GPa\"\npoisson = 0.5\ndensity = \"1 kg/m3\"\n", "s.toml:1", "below 0.5"},
      {"[materials.x]\nyoung = \"-1 GPa\"\npoisson = 0.3\ndensity = \"1 kg/m3\"\n", "s.toml:1", "above 0"},
      {"[materials.x]\npoisson = 0.3\ndensity = \"1 kg/m3\"\n", "s.toml:1", "needs \"young\""},
      {"[run]\nuntil = \"tomorrow\"\n", "s.toml:2", "equilibrium"},
      {"[run]\ntolerance = 5\n", "s.toml:1", "tolerance"},
      {"[run]\ntime = \"1 ms\"\nstep = \"1e-30 s\"\n", "s.toml:3", "leave it out"},
      {"[[probe]]\nname = \"p\"\n", "s.toml:1", "either \"at\""},
      {"[gravity]\nacceleration = [0, 0, nan]\n", "s.toml:2", "finite"},
      {"gravity = 3\n", "s.toml:1", "table"},
  };
  for (const Wrong& wrong : cases) {
    const auto [where, what] = parse_refusal_at(wrong.text);
    EXPECT_EQ(where, wrong.where) << wrong.text << what;
    EXPECT_THAT(what, HasSubstr(wrong.says)) << wrong.text;
  }
}

TEST(Scene, WhereFromAnOption) {
  EXPECT_EQ(parse_where("bracket/12", "--fix").name, "bracket/12");
  EXPECT_EQ(parse_where("[\"xmin\", \"ymin\"]", "--fix").members.size(), 2u);
  EXPECT_EQ(parse_where("{ sphere = { centre = [0, 0, 0], radius = \"5 mm\" } }", "--fix").radius, 0.005);
  EXPECT_THROW((void)parse_where("{ sphere = 3 }", "--fix"), InputError);
  EXPECT_THROW((void)parse_where("", "--fix"), InputError);
}

TEST(Materials, LibraryIsFoundByNameAndAlias) {
  EXPECT_EQ(library_material("steel")->young, 210e9);
  EXPECT_EQ(library_material("Aluminum"), library_material("aluminium 6061"));
  EXPECT_EQ(library_material("nylon PA12"), library_material("pa-12"));
  EXPECT_EQ(library_material("unobtainium"), nullptr);
  for (const Material& material : material_library()) {
    EXPECT_GT(material.young, 0);
    EXPECT_GT(material.poisson, -1);
    EXPECT_LT(material.poisson, 0.5);
    EXPECT_GT(material.density, 0);
    EXPECT_FALSE(material.source.empty());
  }
}

TEST(Materials, EachPartNeedsOne) {
  Body body = testing::box_body();
  Scene scene;
  EXPECT_THROW((void)materials_of_parts(scene, body), InputError);
  body.parts[0].material = "steel";
  EXPECT_EQ(materials_of_parts(scene, body)[0].young, 210e9);
  scene.material = "copper";
  EXPECT_EQ(materials_of_parts(scene, body)[0].name, "copper");
  scene.parts["box"].material = "brass";
  EXPECT_EQ(materials_of_parts(scene, body)[0].name, "brass");
  scene.parts["box"].model = "springs";
  EXPECT_EQ(materials_of_parts(scene, body)[0].name, "brass");
  EXPECT_EQ(models_of_parts(scene, body)[0], Model::springs);
  scene.parts["box"].model = "paper";
  EXPECT_THROW((void)materials_of_parts(scene, body), InputError);
  scene.parts.clear();
  scene.parts["bxo"].material = "brass";
  try {
    (void)materials_of_parts(scene, body);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean \"box\"?"));
  }
}

TEST(Selection, NamesSidesRegionsAndTheirComplements) {
  const Body body = testing::box_body({.cells = {4, 2, 2}});
  EXPECT_EQ(resolve(select_by_name("xmin"), body).polygons, std::vector<std::uint32_t>{0});
  EXPECT_EQ(resolve(select_by_name("box/zmax"), body).polygons, std::vector<std::uint32_t>{5});
  EXPECT_EQ(resolve(select_by_name("box/2"), body).polygons, std::vector<std::uint32_t>{1});
  EXPECT_EQ(resolve(select_by_name("box/y1"), body).polygons, std::vector<std::uint32_t>{3});
  EXPECT_EQ(resolve(select_by_name("y1"), body).polygons, std::vector<std::uint32_t>{3});
  EXPECT_EQ(resolve(select_by_name("box"), body).elements.size(), body.element_count());
  const Selected several = resolve(parse_where("[\"xmin\", \"box/2\"]", ""), body);
  EXPECT_EQ(several.polygons, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(resolve(parse_where("{ not = \"xmin\" }", ""), body).polygons.size(), 5u);
  const Selected ball =
      resolve(parse_where("{ sphere = { centre = [0, 0, 0], radius = \"1.01 m\" } }", ""), body);
  EXPECT_EQ(ball.elements.size(), 4u);
  const Selected swept = resolve(
      parse_where(
          "{ sphere = { path = [[0, 0, 0], [0, \"1 m\", 0], [\"2 m\", \"1 m\", 0]], radius = \"0.1 m\" } }",
          ""),
      body);
  for (std::uint32_t e = 0; e < body.element_count(); ++e) {
    const Vec3& at = body.rest[e];
    const bool inside = at.z() == 0 && (at.x() == 0 ? at.y() <= 1 : at.y() == 1 && at.x() <= 2);
    EXPECT_EQ(std::count(swept.elements.begin(), swept.elements.end(), e), inside) << at.transpose();
  }
  const Selected box =
      resolve(parse_where("{ box = { min = [0, 0, 0], max = [\"1 m\", \"1 m\", 0] } }", ""), body);
  EXPECT_EQ(box.elements.size(), 4u);
}

TEST(Selection, NothingSelectedSaysWhatExists) {
  const Body body = testing::box_body();
  const auto message = [&](const std::string& text) -> std::string {
    try {
      (void)resolve(parse_where(text, "s.toml:3"), body);
    } catch (const InputError& error) {
      EXPECT_EQ(error.where(), "s.toml:3");
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message("box/7"), HasSubstr("faces 1 to 6"));
  EXPECT_THAT(message("bix/7"), HasSubstr("no part \"bix\""));
  EXPECT_THAT(message("xmim"), HasSubstr("did you mean \"xmin\"?"));
  EXPECT_THAT(message("qqqqqq"), HasSubstr("flexel info"));
}

}  // namespace
}  // namespace flexel::simulate
