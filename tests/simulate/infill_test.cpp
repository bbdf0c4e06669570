// Prints that are not solid: the effective figures, the walls' share, and the scene's keys.
#include "simulate/input/infill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

std::string message_of(const std::string& scene) {
  try {
    (void)parse_scene(scene, "print.toml");
  } catch (const InputError& error) {
    return std::string(error.where()) + ": " + error.what();
  }
  return "";
}

TEST(Infill, OpenCellsWithoutWalls) {
  const Material solid = *library_material("PLA");
  const Material sparse = with_infill(solid, 0.2, 0);
  EXPECT_NEAR(sparse.young / solid.young, 0.04, 1e-12);  // Gibson and Ashby: 0.2^2
  EXPECT_NEAR(sparse.strength / solid.strength, 0.3 * std::pow(0.2, 1.5), 1e-12);
  EXPECT_NEAR(sparse.layer_strength / solid.layer_strength, 0.3 * std::pow(0.2, 1.5), 1e-12);
  EXPECT_NEAR(sparse.density / solid.density, 0.2, 1e-12);
  EXPECT_EQ(sparse.poisson, solid.poisson);
}

TEST(Infill, RunsIntoTheSolid) {
  const Material solid = *library_material("PETG");
  EXPECT_EQ(with_infill(solid, 1, 0).young, solid.young);
  EXPECT_EQ(with_infill(solid, 1, 0).infill, 1);
  EXPECT_NEAR(with_infill(solid, 0.5, 1).strength, solid.strength, 1e-6);
  double before = 0;
  for (double infill = 0.05; infill < 1; infill += 0.01) {
    const Material print = with_infill(solid, infill, 0.1);
    EXPECT_GT(print.strength, before);
    before = print.strength;
  }
}

TEST(Infill, SceneAndPartsNameIt) {
  Body body = testing::box_body();
  const std::string part = body.parts[0].name;
  const double solid = library_material("PLA")->young;
  EXPECT_NEAR(materials_of_parts(parse_scene("material = \"PLA\"\ninfill = \"20 %\"\n", "s"), body)[0].young,
              0.04 * solid, 1);
  EXPECT_NEAR(
      materials_of_parts(
          parse_scene("material = \"PLA\"\ninfill = 0.5\n[parts.\"" + part + "\"]\ninfill = 0.2\n", "s"),
          body)[0]
          .young,
      0.04 * solid, 1);
  // the infill is that of the scene's material, not of another one that the part names
  const std::string steel =
      "material = \"PLA\"\ninfill = 0.2\n[parts.\"" + part + "\"]\nmaterial = \"steel\"\n";
  EXPECT_THROW((void)materials_of_parts(parse_scene(steel, "s"), body), InputError);
  body.parts.push_back(body.parts[0]);
  body.parts.back().name = "other";
  const std::vector<Material> materials = materials_of_parts(parse_scene(steel, "s"), body);
  EXPECT_EQ(materials[0].young, 210e9);
  EXPECT_NEAR(materials[1].young, 0.04 * solid, 1);
}

TEST(Infill, RefusesWhatIsNone) {
  EXPECT_THAT(message_of("infill = 0\n"),
              HasSubstr("print.toml:1: an infill of 0 % needs to lie between 5 %"));
  EXPECT_THAT(message_of("\ninfill = 20\n"), HasSubstr("print.toml:2: an infill of 2000 %"));
  EXPECT_THAT(message_of("shell = \"1 mm\"\n"), HasSubstr("give infill = \"20 %\" too"));
  EXPECT_THAT(message_of("infill = 0.2\nshell = \"-1 mm\"\n"),
              HasSubstr("print.toml:1: the shell needs to be thicker"));
}

TEST(Infill, WallsOfASquareBar) {
  // 10 mm square, long: a shell of 1 mm leaves 8 x 8 of 10 x 10
  Body body;
  body.parts.resize(1);
  Surface& surface = body.surface;
  surface.parts.resize(1);
  surface.faces.resize(1);
  const double a = 0.01, length = 1;
  for (int c = 0; c < 8; ++c) surface.vertices.emplace_back(c & 1 ? length : 0, c & 2 ? a : 0, c & 4 ? a : 0);
  surface.polygon_offsets = {0, 4, 8, 12, 16};
  surface.polygon_vertices = {0, 1, 3, 2, 4, 5, 7, 6, 0, 1, 5, 4, 2, 3, 7, 6};  // its four long sides
  surface.polygon_face.assign(4, 0);
  body.parts[0].surface_volume = a * a * length;
  EXPECT_NEAR(wall_share(1e-3, body.parts[0], surface, 0, "--shell"), 0.36, 1e-12);
  EXPECT_EQ(wall_share(1, body.parts[0], surface, 0, "--shell"), 1);
  body.parts[0].surface_volume = 0;
  EXPECT_THROW((void)wall_share(1e-3, body.parts[0], surface, 0, "--shell"), InputError);
}

}  // namespace
}  // namespace flexel::simulate
