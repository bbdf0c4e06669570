// Friction and damping of the library's materials, where a scene asks for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "tests/simulate/contact_case.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::block;
using ::testing::HasSubstr;
using testing::kSide;
using testing::refusal;

// s, tau of the one part of a block, as the scene's [damping] has it.
double time_constant(const std::string& text) {
  const Body body = block("a", {1, 1, 1});
  const Scene scene = parse_scene(text, "s.toml");
  const Problem problem{body, materials_of_parts(scene, body), {}, {Model::cells}};
  KernelEffects plan;
  Damping::make(scene.get<Damping>(), problem)->configure_kernel(plan);
  return plan.damping.at(0);
}

TEST(LibraryFigures, DampingIsThatOfTheMaterialAtThePeriod) {
  const std::string period = "[damping]\nperiod = \"8 ms\"\n", steel = "material = \"steel\"\n",
                    own =
                        "material = \"mine\"\n[materials.mine]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = "
                        "\"1000 kg/m3\"\n";
  EXPECT_DOUBLE_EQ(time_constant(steel + period),
                   library_material("steel")->damping * 8e-3 / std::numbers::pi);
  EXPECT_DOUBLE_EQ(time_constant(steel + period + "ratio = 0.05\n"), 0.05 * 8e-3 / std::numbers::pi);
  EXPECT_DOUBLE_EQ(time_constant(own + "damping = 0.03\n" + period), 0.03 * 8e-3 / std::numbers::pi);
  EXPECT_THAT(
      refusal(block("a", {1, 1, 1}), parse_scene(own + period + "[run]\ntime = \"1 ms\"\n", "s.toml")),
      HasSubstr("part \"a\": mine has no damping ratio"));
}

TEST(LibraryFigures, DampingSaysOneThing) {
  const auto said = [](const std::string& keys) {
    try {
      (void)parse_scene("[damping]\n" + keys, "s.toml");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(said("period = \"8 ms\"\ntime = \"1 ms\"\n"), HasSubstr("give one"));
  EXPECT_THAT(said("time = \"1 ms\"\nratio = 0.1\n"), HasSubstr("needs \"period\""));
  EXPECT_THAT(said("ratio = 0.1\n"), HasSubstr("\"time\""));
  EXPECT_THAT(said("period = \"0 s\"\n"), HasSubstr("above 0"));
  EXPECT_THAT(said("period = \"1 s\"\nratio = -1\n"), HasSubstr("0 or more"));
}

// To the bit what the library's figure does as a number.
TEST(LibraryFigures, FrictionIsThatOfTheMaterial) {
  const auto slid = [](const std::string& friction) {
    const Scene scene = parse_scene(
        "material = \"steel\"\n[contact]\nfriction = " + friction +
            "\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[gravity]\nacceleration = [0, 0, \"-100 "
            "m/s2\"]\n"
            "[[velocity]]\nwhere = \"a\"\nvelocity = [\"0.1 m/s\", 0, 0]\n[run]\ntime = \"2 ms\"\n",
        "s.toml");
    return testing::run_timed(block("a", {2, 2, 2}), scene).body;
  };
  const Body by_name = slid("\"material\""), by_number = slid("0.2"), without = slid("0");
  EXPECT_EQ(library_material("steel")->friction, 0.2);
  EXPECT_EQ(by_name.position, by_number.position);
  EXPECT_GT(without.position[0].x() - by_name.position[0].x(), 1e-2 * (without.position[0].x()));
}

TEST(LibraryFigures, AMaterialWithoutFrictionIsRefusedByName) {
  const std::string asked = "[contact]\nfriction = \"material\"\n[run]\ntime = \"1 ms\"\n";
  EXPECT_THAT(refusal(block("a", {1, 1, 1}), parse_scene("material = \"PLA\"\n" + asked, "s.toml")),
              HasSubstr("PLA of part \"a\" has none"));
  EXPECT_THROW((void)parse_scene("[contact]\nfriction = \"wood\"\n", "s.toml"), InputError);
}

}  // namespace
}  // namespace flexel::simulate
