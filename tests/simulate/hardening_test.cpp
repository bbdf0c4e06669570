// Voce's law by what a tensile test tells, and which materials of the library have it.
#include "simulate/input/hardening.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.h"
#include "simulate/effects/plasticity.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// The largest load of a bar over its first section [Pa], and the engineering strain there, step by step along the law.
struct LargestLoad {
  double load = 0, strain = 0;
};

LargestLoad largest_load(double yield, const VoceHardening& voce, double young) {
  LargestLoad largest;
  for (double a = 0; a < 0.6; a += 1e-5) {
    const double stress = yield + voce.saturation * (1 - std::exp(-voce.rate * a));
    const double strain = std::expm1(a + stress / young), load = stress / (1 + strain);
    if (load > largest.load) largest = {load, strain};
  }
  return largest;
}

TEST(Hardening, TheLargestLoadIsTheStrengthAtTheUniformElongation) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(0, 1);
  int found = 0;
  for (int trial = 0; trial < 80; ++trial) {
    const double young = 1e9 * std::pow(400, share(random)),
                 yield = young * std::pow(10, -2 - 2 * share(random));
    const double strength = yield * (1 + 2 * share(random)), elongation = 0.01 + 0.5 * share(random);
    const std::optional<VoceHardening> voce = voce_hardening(yield, strength, elongation, young);
    if (!voce) continue;
    ++found;
    const LargestLoad largest = largest_load(yield, *voce, young);
    EXPECT_NEAR(largest.load, strength, 1e-6 * strength) << yield << " " << strength << " " << elongation;
    EXPECT_NEAR(largest.strain, elongation, 5e-3 * elongation)
        << yield << " " << strength << " " << elongation;
  }
  EXPECT_GT(found, 40);
}

// A bar that bears its largest load as it begins to flow does not harden.
TEST(Hardening, ThereIsNoneUpToAStrengthBelowTheYieldStress) {
  EXPECT_FALSE(voce_hardening(300e6, 200e6, 0.2, 200e9));
  EXPECT_FALSE(voce_hardening(300e6, 300e6, 0.2, 200e9));
  EXPECT_FALSE(voce_hardening(300e6, 400e6, 0.001, 200e9)) << "less than its elastic strain";
  EXPECT_FALSE(voce_hardening(300e6, 400e6, 0, 200e9));
  EXPECT_FALSE(voce_hardening(1e4, 1.5e5, 9, 1e6)) << "a true stress above the modulus";
  EXPECT_TRUE(voce_hardening(300e6, 400e6, 0.2, 200e9));
}

TEST(Hardening, EveryMetalOfTheLibraryThatFlowsHardens) {
  int harden = 0;
  for (const Material& each : material_library()) {
    if (!(each.yield > 0)) {
      EXPECT_EQ(each.uniform_elongation, 0) << each.name;
      EXPECT_EQ(each.hardening, 0) << each.name;
      continue;
    }
    if (each.young < 20e9) continue;  // plastics
    ++harden;
    const std::optional<VoceHardening> voce = voce_hardening(each);
    ASSERT_TRUE(voce) << each.name;
    EXPECT_LE(each.uniform_elongation, each.elongation) << each.name;
    const LargestLoad largest = largest_load(each.yield, *voce, each.young);
    EXPECT_NEAR(largest.load, each.strength, 1e-6 * each.strength) << each.name;
    EXPECT_THAT(each.source, HasSubstr("uniform elongation: ")) << each.name;
  }
  EXPECT_EQ(harden, 13);
}

// What the law's first slope has to be near, of structural steel: E / 100 (EN 1993-1-5, C.6).
TEST(Hardening, StructuralSteelBeginsNearAHundredthOfItsModulus) {
  for (const char* name : {"steel", "steel S355"}) {
    const Material& steel = *library_material(name);
    const VoceHardening voce = *voce_hardening(steel);
    EXPECT_NEAR(voce.saturation * voce.rate, steel.young / 100, 0.4 * steel.young / 100) << name;
  }
}

// What [plasticity] makes of a bar of the scene; the message where it is refused.
PlasticFlow flow_of_scene(const std::string& text) {
  const Body body = testing::box_body();
  const Scene scene = parse_scene(text, "bar.toml");
  const Problem problem = testing::problem_of(body, materials_of_parts(scene, body).at(0));
  KernelEffects plan;
  Plasticity::make(scene.get<Plasticity>(), problem)->configure_kernel(plan);
  return plan.plasticity.at(0);
}

std::string flow_refusal(const std::string& text) {
  try {
    (void)flow_of_scene(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

const std::string kRun = "[run]\ntime = \"1 ms\"\n";

TEST(Hardening, AScenesPlasticityTakesTheLibrarysLaw) {
  const Material& steel = *library_material("steel");
  const PlasticFlow flow = flow_of_scene("material = \"steel\"\n[plasticity]\n" + kRun);
  EXPECT_EQ(flow.yield, steel.yield);
  EXPECT_EQ(flow.saturation, voce_hardening(steel)->saturation);
  EXPECT_EQ(flow.rate, voce_hardening(steel)->rate);
  const PlasticFlow own = flow_of_scene("material = \"steel\"\n[plasticity]\nyield = \"200 MPa\"\n" + kRun);
  EXPECT_EQ(own.saturation, voce_hardening(200e6, 360e6, steel.uniform_elongation, 210e9)->saturation);
  for (const char* hardening : {"0 Pa", "1 GPa"}) {
    const PlasticFlow linear = flow_of_scene(
        std::string("material = \"steel\"\n[plasticity]\nhardening = \"") + hardening + "\"\n" + kRun);
    EXPECT_EQ(linear.saturation, 0) << hardening;
    EXPECT_EQ(linear.hardening, hardening[0] == '1' ? 1e9 : 0);
  }
  EXPECT_EQ(flow_of_scene("material = \"polycarbonate\"\n[plasticity]\n" + kRun).hardening, 78e6);
  EXPECT_THAT(flow_refusal("material = \"steel\"\n[plasticity]\nyield = \"450 MPa\"\n" + kRun),
              AllOf(HasSubstr("360 MPa"), HasSubstr("hardening = \"0 Pa\"")));
}

TEST(Hardening, AMaterialOfTheSceneHasItByItsTensileTest) {
  const std::string metal =
      "material = \"metal\"\n[plasticity]\n[run]\ntime = \"1 ms\"\n[materials.metal]\nyoung = \"200 "
      "GPa\"\npoisson = 0.3\ndensity = \"7850 kg/m3\"\n";
  const std::string yield = "yield = \"300 MPa\"\n", strength = "strength = \"400 MPa\"\n",
                    elongation = "uniform_elongation = 0.2\n";
  EXPECT_EQ(flow_of_scene(metal + yield + strength + elongation).rate,
            voce_hardening(300e6, 400e6, 0.2, 200e9)->rate);
  EXPECT_EQ(flow_of_scene(metal + yield + strength).saturation, 0);
  EXPECT_THAT(flow_refusal(metal + yield + elongation), HasSubstr("needs \"yield\" and \"strength\""));
  EXPECT_THAT(flow_refusal(metal + strength + elongation), HasSubstr("needs \"yield\" and \"strength\""));
  EXPECT_THAT(flow_refusal(metal + yield + strength + elongation + "hardening = \"1 GPa\"\n"),
              HasSubstr("two laws"));
  EXPECT_THAT(flow_refusal(metal + yield + strength + "uniform_elongation = 0\n"), HasSubstr("above 0"));
  EXPECT_THAT(flow_refusal(metal + yield + strength + "uniform_elongation = 0.001\n"),
              HasSubstr("no hardening leads from"));
}

}  // namespace
}  // namespace flexel::simulate
