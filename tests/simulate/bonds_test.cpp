// Parts that touch: a bar in two pieces behaves as the whole bar.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/gravity.h"
#include "simulate/matter/interface_points.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/scene/strength.h"
#include "simulate/summary.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/scene_case.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;
using ::testing::HasSubstr;
using testing::refusal;
using testing::simulate_quietly;

// A bar 2 x 0.5 x 0.5 m, whole or cut at x = 1, the far half `n` cells thick, `gap` away.
Body bonded_bar(bool whole, int n = 4, double gap = 0) {
  BoxOptions near;
  near.name = "near";
  near.cells = {whole ? 16 : 8, 4, 4};
  near.spacing = Vec3::Constant(0.125);
  Body body = box_body(near);
  if (whole) return body;
  BoxOptions far;
  far.name = "far";
  far.cells = {2 * n, n, n};
  far.spacing = Vec3::Constant(0.5 / n);
  far.origin = Vec3(1 + gap, 0, 0);
  append(body, box_body(far));
  return body;
}

Scene pulled_scene(const Vec3& force) {
  Scene scene;
  scene.materials["gum"] = {"gum", 12.1e5, 0.3, 580, "test"};
  scene.material = "gum";
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("xmin")));
  scene.get<Loads>().loads.push_back(make_push(select_by_name("xmax"), force));
  Probe tip;
  tip.where = select_by_name("xmax");
  scene.probes.push_back(tip);
  return scene;
}

Vec3 tip_of(Body body, const Scene& scene) {
  return simulate_quietly(body, scene).probes[0].displacement;
}

Vec3 pulled_tip(Body body, const Vec3& force) {
  return tip_of(std::move(body), pulled_scene(force));
}

TEST(Bonds, CutBarIsTheWholeBar) {
  for (const Vec3& force : {Vec3(1e-3, 0, 0), Vec3(0, 0, 1e-3)}) {
    const Vec3 whole = pulled_tip(bonded_bar(true), force);
    EXPECT_LT((pulled_tip(bonded_bar(false), force) - whole).norm(), 0.005 * whole.norm());
    EXPECT_LT((pulled_tip(bonded_bar(false, 5), force) - whole).norm(), 0.015 * whole.norm());
    EXPECT_LT((pulled_tip(bonded_bar(false, 3), force) - whole).norm(), 0.015 * whole.norm());
  }
}

TEST(Bonds, LargeDeflectionOfACutBar) {
  const Vec3 force(0, 0, 400);
  const Vec3 whole = pulled_tip(bonded_bar(true), force);
  EXPECT_GT(whole.norm(), 0.08);
  EXPECT_LT((pulled_tip(bonded_bar(false, 5), force) - whole).norm(), 0.015 * whole.norm());
}

// Let go under its weight, the cut bar swings as far as the whole one.
TEST(Bonds, ACutBarSwingsAsTheWholeBar) {
  const auto swing = [](const Body& body) {
    Scene scene = pulled_scene(Vec3::Zero());
    scene.get<Loads>().loads.clear();
    scene.get<Gravity>().acceleration = Vec3(0, 0, -0.5);
    scene.run.time = 0.2;
    return testing::run_timed(body, scene);
  };
  const testing::TimedCase whole = swing(bonded_bar(true));
  for (const int n : {4, 5, 3}) {
    const testing::TimedCase cut = swing(bonded_bar(false, n));
    EXPECT_NEAR(cut.result.probes[0].displacement.z(), whole.result.probes[0].displacement.z(),
                0.03 * std::abs(whole.result.probes[0].displacement.z()))
        << n;
    testing::expect_books_close(cut.result);
    if (n == 4) {
      EXPECT_GT(cut.result.timed->step, whole.result.timed->step / 1.8);
    }
  }
}

// [[bond]]: also over a gap, which makes the bar longer by a fortieth (and its bending by a thirteenth).
TEST(Bonds, NamedBondsHold) {
  const Vec3 force(0, 0, 1e-3);
  const Vec3 whole = pulled_tip(bonded_bar(true), force);
  Scene scene = pulled_scene(force);
  scene.get<Bonds>().bond = false;
  scene.get<Bonds>().named = {{{"far", "near"}, 0.06, "s.toml:3"}};
  for (const double gap : {0.0, 0.05}) {
    Body body = bonded_bar(false, 5, gap);
    const Vec3 bonded = simulate_quietly(body, scene).probes[0].displacement;
    EXPECT_LT((bonded - whole).norm(), (0.015 + 2.5 * gap) * whole.norm()) << gap;
  }
  EXPECT_THAT(refusal(bonded_bar(false, 5, 0.07), scene), HasSubstr("do not touch"));
  scene.get<Bonds>().named[0].gap = 0.1;
  EXPECT_THAT(refusal(bonded_bar(false, 5, 0.05), scene), HasSubstr("half a spacing"));
  scene.get<Bonds>().named[0].parts[0] = "fat";
  EXPECT_THAT(refusal(bonded_bar(false, 5), scene), HasSubstr("did you mean \"far\""));
}

TEST(Bonds, PartsOfDifferentModelsAreBonded) {
  Scene scene = pulled_scene(Vec3(1e-3, 0, 0));
  scene.materials["gum"].poisson = 0.25;
  const auto pulled = [&](const std::string& model) {
    Scene own = parse_scene("[parts.far]\nmodel = \"" + model + "\"\n", "s.toml");
    scene.parts = own.parts;
    return tip_of(bonded_bar(false, 4), scene);
  };
  const double cells = pulled("cells").x();
  EXPECT_NEAR(pulled("springs").x(), cells, 0.02 * cells);
}

// In a timed run with contact the bonded faces do not press each other as well.
TEST(Bonds, NamedBondsBesideContact) {
  Scene scene = pulled_scene(Vec3::Zero());
  scene.get<Loads>().loads.clear();
  scene.get<Gravity>().acceleration = Vec3(0, 0, -0.5);
  scene.run.time = 0.2;
  scene.get<Bonds>().bond = true;
  const Vec3 bonded = testing::run_timed(bonded_bar(false, 5), scene).result.probes[0].displacement;
  scene.get<Bonds>().bond = false;
  scene.get<Bonds>().named = {{{"near", "far"}, 0, "s.toml:3"}};
  scene.get<Contact>().on = true;
  scene.get<Contact>().bonded = {{"near", "far"}};
  const Vec3 both = testing::run_timed(bonded_bar(false, 5), scene).result.probes[0].displacement;
  EXPECT_LT(bonded.z(), -1e-3);
  EXPECT_NEAR(both.z(), bonded.z(), 1e-6 * std::abs(bonded.z()));
}

TEST(Bonds, SaysWhoIsBondedOverWhatArea) {
  Body body = bonded_bar(false, 5);
  const Scene scene = pulled_scene(Vec3(0, 0, 1));
  const SimulateResult result = simulate_quietly(body, scene);
  ASSERT_EQ(result.bonds.size(), 1u);
  EXPECT_EQ(result.bonds[0].parts, (std::array<std::string, 2>{"near", "far"}));
  EXPECT_NEAR(result.bonds[0].area, 0.25, 1e-12);
  EXPECT_LT((result.reactions[0].force + Vec3(0, 0, 1)).norm(), 1e-6);
  const std::string json = summary_json(result, body, known_materials(scene, body));
  EXPECT_THAT(json, HasSubstr("\"bonds\""));
}

// A rotation of everything costs nothing, whatever the lattices: the bond does not see it.
TEST(Bonds, RotationOfBondedPartsIsFree) {
  Body body = bonded_bar(false, 3);
  Scene scene = pulled_scene(Vec3::Zero());
  scene.get<Loads>().loads.clear();
  scene.get<Supports>().ties.clear();
  Tie tie = make_move(select_by_name("near/xmin"), Vec3::Zero());
  tie.motion.axis = Vec3(1, 2, 3).normalized();
  tie.motion.angle = 1;
  scene.get<Supports>().ties.push_back(tie);
  const SimulateResult result = simulate_quietly(body, scene);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    EXPECT_LT((body.position[e] - body.rest[e] - tie.motion.displacement(body.rest[e], 1)).norm(), 1e-6);
  EXPECT_LT(result.elastic_energy, 1e-6);
}

TEST(Bonds, OnlyPartsThatTouchAreBonded) {
  EXPECT_TRUE(touching_points({bonded_bar(true), {}, {}}).empty());
  EXPECT_FALSE(
      touching_points({bonded_bar(false, 4, 0.0005), {}, {}}).empty());  // under a hundredth of the spacing
  EXPECT_TRUE(touching_points({bonded_bar(false, 4, 0.002), {}, {}}).empty());
  EXPECT_THAT(refusal(bonded_bar(false, 4, 0.002), pulled_scene(Vec3(0, 0, 1))),
              HasSubstr("nothing holds part \"far\""));
}

TEST(Bonds, CanBeLeftOut) {
  Scene scene = pulled_scene(Vec3(0, 0, 1));
  scene.get<Bonds>().bond = false;
  EXPECT_THAT(refusal(bonded_bar(false), scene), HasSubstr("nothing holds part \"far\""));
  EXPECT_FALSE(parse_scene("bond = false\n", "s.toml").get<Bonds>().bond);
  EXPECT_TRUE(parse_scene("", "s.toml").get<Bonds>().bond);
  EXPECT_THROW((void)parse_scene("contact = true\nbond = true\n", "s.toml"), InputError);
  EXPECT_THROW((void)parse_scene("bond = 1\n", "s.toml"), InputError);
  const Scene named = parse_scene(
      "contact = true\n[[bond]]\nparts = [\"a\", \"b\"]\n[[bond]]\nparts = [\"b\", \"c\"]\ngap = \"1 mm\"\n",
      "s.toml");
  EXPECT_FALSE(named.get<Bonds>().bond);
  ASSERT_EQ(named.get<Bonds>().named.size(), 2u);
  EXPECT_EQ(named.get<Bonds>().named[1].gap, 1e-3);
  EXPECT_EQ(named.get<Contact>().bonded.size(), 2u);
  EXPECT_TRUE(parse_scene("[[bond]]\nparts = [\"a\", \"b\"]\n", "s.toml").get<Bonds>().bond);
  EXPECT_THROW((void)parse_scene("[[bond]]\nparts = [\"a\"]\n", "s.toml"), InputError);
  EXPECT_THROW((void)parse_scene("[[bond]]\nparts = [\"a\", \"a\"]\n", "s.toml"), InputError);
  EXPECT_THROW((void)parse_scene("contact = true\n[[bond]]\nwith = 1\n", "s.toml"), InputError);
}

}  // namespace
}  // namespace flexel::simulate
