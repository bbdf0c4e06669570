// Bonds of model `quadratic`: parts in pieces behave as the whole part, whatever their lattices and materials.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

// About an axis along none of the lattice's.
Mat3 turned_by(double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3(1, 2, 3).normalized()).toRotationMatrix();
}

// A bar of 40 x 20 x 20 mm along the first axis of `axes`, cut across at 20 mm; its halves have so many cells of 20 mm. Faces of the first
// half are "near/x0" and so on.
Body cut_bar(int near, int far, const Mat3& axes = Mat3::Identity(), double gap = 0) {
  const auto half = [&](const char* name, int cells, double from) {
    return testing::box_body({.cells = {cells, cells, cells},
                              .spacing = Vec3::Constant(0.02 / cells),
                              .origin = axes * Vec3(from, 0, 0),
                              .axes = axes,
                              .name = name});
  };
  Body body = half("near", near, 0);
  append(body, half("far", far, 0.02 + gap));
  return body;
}

std::string words(const Vec3& v, const char* unit) {
  return fmt::format("[\"{:.17g} {}\", \"{:.17g} {}\", \"{:.17g} {}\"]", v.x(), unit, v.y(), unit, v.z(),
                     unit);
}

// `far` has so many times the stiffness of `near`, 1 MPa.
std::string materials(double stiffer = 1, double poisson = 0.3) {
  return fmt::format(
      "model = \"quadratic\"\nmaterial = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = {0}\n"
      "density = \"1000 kg/m3\"\n[materials.other]\nyoung = \"{1} MPa\"\npoisson = {0}\ndensity = \"1000 "
      "kg/m3\"\n"
      "[parts.far]\nmaterial = \"other\"\n[[probe]]\nname = \"end\"\nwhere = \"far/x1\"\n",
      poisson, stiffer);
}

std::string held_and_pulled(const Vec3& force) {
  return "[[fix]]\nwhere = \"near/x0\"\n[[load]]\nwhere = \"far/x1\"\nforce = " + words(force, "N") + "\n";
}

SimulateResult run_bonded(Body& body, const std::string& scene) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.estimate = false;
  return simulate(body, parse_scene(scene, "s.toml"), options, progress);
}

Vec3 tip(Body body, const std::string& scene) {
  return run_bonded(body, scene).probes[0].displacement;
}

// An even stress passes, through lattices that match, that do not, and that are turned against one another.
TEST(QuadraticBonds, PatchTest) {
  const double force = 2e-4, area = 4e-4;
  for (const auto& [near, far] : {std::pair{2, 2}, {2, 3}, {3, 1}})
    for (const double stiffer : {1., 100.}) {
      Body body = cut_bar(near, far);
      const std::string scene = materials(stiffer, 0) + held_and_pulled({force, 0, 0});
      const SimulateResult result = run_bonded(body, scene);
      const double exact = force / area / 1e6 * 0.02 * (1 + 1 / stiffer);
      EXPECT_NEAR(result.probes[0].displacement.x() / exact, 1, 1e-5) << near << far << stiffer;
      EXPECT_LT(result.imbalance.norm(), 1e-6 * force);
      ASSERT_TRUE(result.stress);
      EXPECT_NEAR(result.stress->value / (force / area), 1, 1e-3);
      ASSERT_EQ(result.bonds.size(), 1U);
      EXPECT_NEAR(result.bonds[0].area / area, 1, 1e-9);
    }
}

TEST(QuadraticBonds, ACutBarBendsAsTheWholeBar) {
  for (const double degrees : {0., 33.}) {
    const Mat3 axes = turned_by(degrees);
    const std::string scene = materials() + held_and_pulled(axes * Vec3(0, 0, 1e-3));
    Body whole = testing::box_body({.cells = {4, 2, 2}, .spacing = Vec3::Constant(0.01), .axes = axes});
    const SimulateResult one =
        run_bonded(whole,
                   "model = \"quadratic\"\nmaterial = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\n"
                   "poisson = 0.3\ndensity = \"1000 kg/m3\"\n[[probe]]\nname = \"end\"\nwhere = \"x1\"\n"
                   "[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = \"x1\"\nforce = " +
                       words(axes * Vec3(0, 0, 1e-3), "N") + "\n");
    const Vec3 exact = one.probes[0].displacement;
    for (const auto& [far, off] : {std::pair{2, 1e-3}, {3, 0.01}}) {
      Body cut = cut_bar(2, far, axes);
      const SimulateResult result = run_bonded(cut, scene);
      EXPECT_LT((result.probes[0].displacement - exact).norm(), off * exact.norm()) << degrees << far;
      EXPECT_LT(result.cg_iterations, 40) << degrees << far;  // hundreds where the blocks lack nodes across
    }
  }
}

// A far half that is led around takes the near one along without strain, also where its cells turn by more than a radian.
TEST(QuadraticBonds, ARigidMotionStrainsNothing) {
  Body body = cut_bar(1, 2);
  const SimulateResult result = run_bonded(
      body, materials(10) +
                "[[move]]\nwhere = \"far/x1\"\nrotation = { axis = [1, 2, 2], through = [\"10 mm\", 0, 0], "
                "angle = \"100 deg\" }\n");
  const Mat3 turn =
      Eigen::AngleAxisd(100 * std::numbers::pi / 180, Vec3(1, 2, 2).normalized()).toRotationMatrix();
  const Vec3 through(0.01, 0, 0);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    EXPECT_LT((body.position[e] - through - turn * (body.rest[e] - through)).norm(), 1e-6);
  EXPECT_LT(result.stress->value, 1e-4 * 1e6);
}

// The largest stress at the corner of two materials grows as cells get smaller: it has no bar.
TEST(QuadraticBonds, TheStressBesideABondHasNoErrorBar) {
  Body body = cut_bar(3, 3);
  Progress progress("test", Progress::Mode::quiet);
  const std::string scene =
      materials(100, 0.4) +
      "[[fix]]\nwhere = \"near/x0\"\naxes = \"x\"\n"
      "[[fix]]\nwhere = { sphere = { centre = [0, 0, 0], radius = \"1 mm\" } }\n"
      "[[fix]]\nwhere = { sphere = { centre = [0, \"20 mm\", 0], radius = \"1 mm\" } }\n"
      "axes = \"z\"\n[[load]]\nwhere = \"far/x1\"\nforce = [\"1e-4 N\", 0, 0]\n";
  const SimulateResult result = simulate(body, parse_scene(scene, "s.toml"), {}, progress);
  ASSERT_TRUE(result.stress);
  EXPECT_NEAR(result.stress->at.x(), 0.02, 0.007);
  EXPECT_EQ(result.stress->beside, "a bond");
}

// Large deflections: the cut bar goes where the whole one does.
TEST(QuadraticBonds, LargeDeflectionOfACutBar) {
  const std::string scene = materials() + held_and_pulled({0, 0, 2});
  const Vec3 matching = tip(cut_bar(2, 2), scene), uneven = tip(cut_bar(2, 3), scene);
  EXPECT_GT(matching.norm(), 2e-3);
  EXPECT_LT((uneven - matching).norm(), 0.01 * matching.norm());
}

// As in model `cells`: the gap of a fortieth of the length is bridged by what extrapolates both sides.
TEST(QuadraticBonds, NamedBondsReachOverAGap) {
  const std::string scene = materials(1, 0) + held_and_pulled({2e-4, 0, 0}),
                    bond = "[[bond]]\nparts = [\"near\", \"far\"]\n";
  const auto refusal = [](Body body, const std::string& text) -> std::string {
    try {
      (void)run_bonded(body, text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NEAR(tip(cut_bar(2, 2, Mat3::Identity(), 1e-3), scene + bond + "gap = \"1.1 mm\"\n").x() /
                  (2e-4 / 4e-4 / 1e6 * 0.04),
              1, 0.015 + 2.5 / 40);
  EXPECT_THAT(refusal(cut_bar(2, 2, Mat3::Identity(), 1e-3), scene + bond), HasSubstr("do not touch"));
  EXPECT_THAT(refusal(cut_bar(2, 2, Mat3::Identity(), 1e-3), scene), HasSubstr("nothing holds part"));
  EXPECT_THAT(refusal(cut_bar(2, 2), scene + "bond = false\n"), ::testing::Not(HasSubstr("accepted")));
}

}  // namespace
}  // namespace flexel::simulate
