// Rigid links and rigid parts of model `quadratic`: closed forms, balance, the same lever by model `cells`, and what is refused.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/sanitized.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

// MPa
std::string stuff(const std::string& model, double poisson = 0, double young = 1) {
  return fmt::format(
      "model = \"{}\"\nmaterial = \"gum\"\n[materials.gum]\nyoung = \"{} MPa\"\npoisson = {}\ndensity = "
      "\"1000 "
      "kg/m3\"\n",
      model, young, poisson);
}

std::string link_words(const Vec3& v, const char* unit) {
  return fmt::format("[\"{:.17g} {}\", \"{:.17g} {}\", \"{:.17g} {}\"]", v.x(), unit, v.y(), unit, v.z(),
                     unit);
}

std::string rigid_load(const std::string& rest, const std::string& where = "box/x1") {
  return "[[load]]\nwhere = \"" + where + "\"\nlink = \"rigid\"\n" + rest + "\n";
}

std::string torque(const Vec3& value) {
  return "torque = " + link_words(value, "N m") + "\n";
}
std::string force(const Vec3& value) {
  return "force = " + link_words(value, "N") + "\n";
}

SimulateResult run_linked(Body& body, const std::string& scene) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.estimate = false;
  return simulate(body, parse_scene(scene, "s.toml"), options, progress);
}

// 80 x 10 x 10 mm along the first axis of `axes`.
Body link_bar(const Mat3& axes = Mat3::Identity(), int across = 1) {
  return testing::box_body(
      {.cells = {8 * across, across, across}, .spacing = Vec3::Constant(0.01 / across), .axes = axes});
}

Mat3 turned() {
  return Eigen::AngleAxisd(0.6, Vec3(1, 2, 3).normalized()).toRotationMatrix();
}

constexpr const char* kLinkHeld = "[[fix]]\nwhere = \"box/x0\"\n";

// Without contraction across, a cantilever under an end moment is bent evenly: theta = M L / (E I), and its end goes theta L / 2; under a
// force the end turns by F L^2 / (2 E I).
TEST(QuadraticLinks, EndMomentAndForceBendACantilever) {
  const double stiffness = 1e6 * std::pow(0.01, 4) / 12, length = 0.08;
  for (const Mat3& axes : {Mat3(Mat3::Identity()), turned()}) {
    Body body = link_bar(axes);
    const double theta = 1e-5;
    const SimulateResult result =
        run_linked(body, stuff("quadratic") + kLinkHeld +
                             rigid_load(torque(axes * Vec3(0, theta * stiffness / length, 0))));
    ASSERT_EQ(result.loads.size(), 1u);
    EXPECT_LT((*result.loads[0].rotation - axes * Vec3(0, theta, 0)).norm(), 1e-5 * theta);
    EXPECT_LT((*result.loads[0].displacement - axes * Vec3(0, 0, -theta * length / 2)).norm(),
              1e-5 * theta * length);
    const double push = theta * stiffness / (length * length);
    Body pushed = link_bar(axes);
    const SimulateResult bent =
        run_linked(pushed, stuff("quadratic") + kLinkHeld + rigid_load(force(axes * Vec3(0, 0, push))));
    EXPECT_NEAR(bent.loads[0].rotation->dot(axes.col(1)), -theta / 2, 2e-3 * theta);
    EXPECT_LT(bent.imbalance.norm(), 1e-6 * push);
    EXPECT_LT(bent.moment_imbalance.norm(), 1e-6 * push * length);
  }
}

// What a force moves about an axis, a torque about it moves along the force (Betti 1872).
TEST(QuadraticLinks, AnswersAreReciprocal) {
  const std::string at = "at = [\"110 mm\", \"30 mm\", \"-10 mm\"]\n";
  Body pushed = link_bar(), twisted = link_bar();
  const AppliedLoad push =
      run_linked(pushed, stuff("quadratic", 0.3) + kLinkHeld + rigid_load(at + force({0, 0, 1e-7}))).loads[0];
  const AppliedLoad turn = run_linked(twisted, stuff("quadratic", 0.3) + kLinkHeld +
                                                   rigid_load(at + force({0, 0, 0}) + torque({0, 1e-7, 0})))
                               .loads[0];
  EXPECT_NEAR(turn.displacement->z() / push.rotation->y(), 1, 1e-5);
}

// A lever on the end of a bar: as by model `cells`, whose lattice is refined until it is near.
TEST(QuadraticLinks, LeverIsThatOfModelCells) {
  const std::string lever =
      rigid_load("at = [\"100 mm\", \"40 mm\", \"5 mm\"]\n" + force({1e-6, 2e-6, 3e-6}));
  Body coarse = link_bar(Mat3::Identity(), 3), fine = link_bar(Mat3::Identity(), 8);
  const AppliedLoad ours = run_linked(coarse, stuff("quadratic", 0.3) + kLinkHeld + lever).loads[0];
  const AppliedLoad theirs = run_linked(fine, stuff("cells", 0.3) + kLinkHeld + lever).loads[0];
  EXPECT_LT((*ours.displacement - *theirs.displacement).norm(), 0.02 * theirs.displacement->norm());
  EXPECT_LT((*ours.rotation - *theirs.rotation).norm(), 0.02 * theirs.rotation->norm());
}

// The couple turns with the end: a bar that it bends to a quarter of a circle.
TEST(QuadraticLinks, LargeRotation) {
  for (const Mat3& axes : {Mat3(Mat3::Identity()), turned()}) {
    Body body = link_bar(axes);
    const double quarter = std::numbers::pi / 2, length = 0.08;
    const SimulateResult result = run_linked(
        body, stuff("quadratic") + kLinkHeld +
                  rigid_load(torque(axes * Vec3(0, 1e6 * std::pow(0.01, 4) / 12 * quarter / length, 0))));
    const double way = length / quarter;
    EXPECT_LT((*result.loads[0].rotation - axes * Vec3(0, quarter, 0)).norm(), 0.01 * quarter);
    EXPECT_LT((*result.loads[0].displacement - axes * Vec3(way - length, 0, -way)).norm(), 0.01 * length);
    EXPECT_LT(result.moment_imbalance.norm(), 1e-5 * result.loads[0].moment.norm());
  }
}

// Far out under a force at a distance, two links at once and weight: loads and reactions balance where the part is.
TEST(QuadraticLinks, ReactionsBalance) {
  Body body = link_bar(turned());
  const SimulateResult result = run_linked(
      body,
      stuff("quadratic", 0.3) + kLinkHeld +
          rigid_load("at = [\"90 mm\", \"30 mm\", \"-20 mm\"]\n" + force({0, 0.01, -0.01})) +
          "[[load]]\nwhere = { sphere = { centre = " + link_words(turned() * Vec3(0.04, 0.005, 0.005), "m") +
          ", radius = \"8 mm\" } }\nlink = \"rigid\"\n" + torque({1e-4, 0, 0}) +
          "[gravity]\nacceleration = [0, 0, \"-9.81 m/s2\"]\n");
  double forces = 0, moments = 0;
  for (const Reaction& reaction : result.reactions) {
    forces += reaction.force.norm();
    moments += reaction.moment.norm();
  }
  EXPECT_GT(result.largest_displacement, 2e-3);
  EXPECT_LT(result.imbalance.norm(), 1e-5 * forces);
  EXPECT_LT(result.moment_imbalance.norm(), 1e-5 * moments);
}

// Euler's load is pi^2 E I / (4 L^2): the link is what buckles away.
TEST(QuadraticLinks, BucklingOfWhatALinkMovesIsFoundOut) {
  const double euler = std::pow(std::numbers::pi / 2 / 0.08, 2) * 1e6 * std::pow(0.01, 4) / 12;
  for (const double share : {0.8, 1.1}) {
    Body body = link_bar();
    Progress progress("test", Progress::Mode::quiet);
    SimulateOptions options;
    options.estimate = false;
    ::testing::internal::CaptureStderr();
    (void)simulate(
        body,
        parse_scene(stuff("quadratic") + kLinkHeld + rigid_load(force({-share * euler, 0, 0})), "s.toml"),
        options, progress);
    const std::string said = ::testing::internal::GetCapturedStderr();
    EXPECT_EQ(said.find("buckle") != std::string::npos, share > 1) << share << said;
  }
}

// 40 + 40 mm (or as many cells of 10 mm), bonded; the far half is rigid.
Body two_bars(const Mat3& axes = Mat3::Identity(), int far = 4) {
  const auto half = [&](const char* name, double from, int cells) {
    return testing::box_body({.cells = {cells, 1, 1},
                              .spacing = Vec3::Constant(0.01),
                              .origin = axes * Vec3(from, 0, 0),
                              .axes = axes,
                              .name = name});
  };
  Body body = half("near", 0, 4);
  append(body, half("far", 0.04, far));
  return body;
}

// Force and torque on a rigid part do to the rest what a rigid link on the rest's end does.
TEST(QuadraticLinks, ARigidPartIsALink) {
  for (const Mat3& axes : {Mat3(Mat3::Identity()), turned()})
    for (const double size : {1e-6, 4e-3}) {
      const std::string held = "[[fix]]\nwhere = \"near/x0\"\n";
      Body whole = two_bars(axes);
      const SimulateResult rigid =
          run_linked(whole, stuff("quadratic", 0.3) + "[parts.far]\nrigid = true\n" + held +
                                "[[load]]\nwhere = \"far/x1\"\n" + force(axes * Vec3(0, size, size)) +
                                "[[probe]]\nname = \"end\"\nwhere = \"far/x1\"\n");
      Body alone = testing::box_body(
          {.cells = {4, 1, 1}, .spacing = Vec3::Constant(0.01), .axes = axes, .name = "near"});
      const SimulateResult linked =
          run_linked(alone, stuff("quadratic", 0.3) + held +
                                rigid_load("at = " + link_words(axes * Vec3(0.08, 0.005, 0.005), "m") + "\n" +
                                               force(axes * Vec3(0, size, size)),
                                           "near/x1"));
      const Vec3 end = *linked.loads[0].displacement;
      EXPECT_LT((rigid.probes[0].displacement - end).norm(), 2e-3 * end.norm()) << size;
      EXPECT_LT(rigid.imbalance.norm(), 1e-5 * size);
      const auto far = std::find_if(rigid.loads.begin(), rigid.loads.end(),
                                    [](const AppliedLoad& load) { return load.name == "far"; });
      ASSERT_NE(far, rigid.loads.end());
      EXPECT_LT((*far->rotation - *linked.loads[0].rotation).norm(), 5e-3 * linked.loads[0].rotation->norm());
      // it stays as it is
      for (std::uint32_t a = whole.parts[1].element_begin; a < whole.parts[1].element_end; ++a) {
        const std::uint32_t b = whole.parts[1].element_begin;
        EXPECT_NEAR((whole.position[a] - whole.position[b]).norm(), (whole.rest[a] - whole.rest[b]).norm(),
                    1e-9);
      }
    }
}

// The forces of a couple sum up to nothing, and what is lacking is small beside the couple all the same.
TEST(QuadraticLinks, ACoupleTurnsARigidPart) {
  const std::string held = stuff("quadratic", 0.3) + "[[fix]]\nwhere = \"near/x0\"\n";
  const auto turned_by = [](const SimulateResult& result, const char* name) {
    return *std::find_if(result.loads.begin(), result.loads.end(), [&](const AppliedLoad& load) {
              return load.name == name;
            })->rotation;
  };
  for (const Vec3& couple : {Vec3(1e-7, 0, 0), Vec3(0, 1e-7, 2e-7)}) {
    Body whole = two_bars(),
         alone = testing::box_body({.cells = {4, 1, 1}, .spacing = Vec3::Constant(0.01), .name = "near"});
    const SimulateResult rigid = run_linked(
        whole, held + "[parts.far]\nrigid = true\n[[load]]\nwhere = \"far/y0\"\n" + torque(couple));
    const Vec3 end = *run_linked(alone, held + rigid_load(torque(couple), "near/x1")).loads[0].rotation;
    EXPECT_LT((turned_by(rigid, "far") - end).norm(), 5e-3 * end.norm());
  }
  Body led = two_bars();
  const SimulateResult twisted = run_linked(
      led,
      held +
          "[parts.far]\nrigid = true\n[[move]]\nwhere = \"far/x1\"\nrotation = { axis = [1, 0, 0], through = "
          "[0, \"5 mm\", \"5 mm\"], angle = \"0.01 rad\" }\n");
  EXPECT_NEAR(turned_by(twisted, "far").x(), 0.01, 1e-5);
}

// Steel on rubber: what holds the steel is 1e-10 of it. The rubber's end turns by F L (L / 2 + a) / (E I).
TEST(QuadraticLinks, ARigidPartOfSteelIsHeldByRubber) {
  const double length = 0.04, arm = 0.2, stiffness = 1e6 * std::pow(0.01, 4) / 12, push = 1e-7;
  Body body = two_bars(Mat3::Identity(), 20);
  const SimulateResult result =
      run_linked(body, stuff("quadratic") +
                           "[materials.steel]\nyoung = \"210 GPa\"\npoisson = 0.3\ndensity = \"7850 "
                           "kg/m3\"\n[parts.far]\nmaterial = \"steel\"\nrigid = true\n[[fix]]\nwhere = "
                           "\"near/x0\"\n[[load]]\nwhere = \"far/x1\"\n" +
                           force({0, 0, push}));
  const auto far = std::find_if(result.loads.begin(), result.loads.end(),
                                [](const AppliedLoad& load) { return load.name == "far"; });
  ASSERT_NE(far, result.loads.end());
  const double theta = push * length * (length / 2 + arm) / stiffness;
  EXPECT_LT((*far->rotation - Vec3(0, -theta, 0)).norm(), 5e-3 * theta);
  EXPECT_LT(result.imbalance.norm(), 1e-5 * push);
}

// A strip that stretches far more stiffly than it bends: what a link was answered with at one load step leads astray at the next.
TEST(QuadraticLinks, AStripThatStiffensTakesNoLoadStepsOfItsOwn) {
  if (sanitized()) GTEST_SKIP() << "a minute under the sanitizers; LargeRotation goes the same ways";
  constexpr int along = 40;
  std::array<Vec3, 2> sag;
  for (const int steps : {1, 3}) {
    Body body = testing::box_body({.cells = {along, 2, 1}, .spacing = Vec3(0.2 / along, 0.005, 0.002)});
    const SimulateResult result =
        run_linked(body, stuff("quadratic", 0.35, 3500) + kLinkHeld +
                             "[[fix]]\nwhere = \"box/x1\"\n[[load]]\nwhere = { box = { min = [\"94 mm\", "
                             "\"-1 mm\", \"-1 mm\"], max = [\"106 mm\", \"11 mm\", \"3 mm\"] } }\nlink = "
                             "\"rigid\"\n" +
                             force({0, 0, 50}) + fmt::format("[run]\nload_steps = {}\n", steps));
    sag[steps / 2] = *result.loads[0].displacement;
  }
  EXPECT_GT(sag[0].z(), 5e-3);
  EXPECT_LT((sag[0] - sag[1]).norm(), 1e-4 * sag[1].norm());
}

// Led by a face, a rigid part leads what it is bonded to: an even stretch.
TEST(QuadraticLinks, AMoveLeadsARigidPart) {
  Body body = two_bars();
  const SimulateResult result =
      run_linked(body, stuff("quadratic") +
                           "[parts.far]\nrigid = true\n[[fix]]\nwhere = \"near/x0\"\n[[move]]\nwhere = "
                           "\"far/x1\"\ndisplacement = [\"4 um\", 0, 0]\n");
  const double pull = 1e6 * 1e-4 * 1e-4;  // E A times the strain
  EXPECT_NEAR(result.reactions[1].force.x() / pull, 1, 5e-3);
  EXPECT_NEAR(result.reactions[0].force.x() / pull, -1, 5e-3);
}

std::string link_refusal(Body body, const std::string& scene) {
  try {
    (void)run_linked(body, scene);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(QuadraticLinks, RefusesWhatNothingHoldsAndWhatIsRigidAlready) {
  const std::string model = stuff("quadratic", 0.3), rigid = model + "[parts.far]\nrigid = true\n";
  const std::string held = "[[fix]]\nwhere = \"near/x0\"\n", load = force({0, 0, 1e-6});
  const std::string weight = "[gravity]\nacceleration = [0, 0, \"-9.81 m/s2\"]\n";
  for (const Mat3& axes : {Mat3(Mat3::Identity()), turned()})
    EXPECT_THAT(link_refusal(link_bar(axes), model + rigid_load(load)), HasSubstr("nothing holds"));
  EXPECT_THAT(
      link_refusal(link_bar(), model + "[[fix]]\nwhere = \"box/x0\"\naxes = \"yz\"\n" + rigid_load(load)),
      HasSubstr("is free to"));
  for (const double radius : {2., 6.})  // one element; two and what lies between them
    EXPECT_THAT(link_refusal(link_bar(),
                             model + kLinkHeld +
                                 fmt::format("[[load]]\nwhere = {{ sphere = {{ centre = [\"{} mm\", 0, 0], "
                                             "radius = \"{} mm\" }} }}\nlink = \"rigid\"\n",
                                             radius < 5 ? 40 : 45, radius) +
                                 load),
                HasSubstr(radius < 5 ? "more than one" : "on one line at this size"));
  EXPECT_THAT(link_refusal(two_bars(), rigid + held + rigid_load(load, "far/x1")),
              HasSubstr("which needs none"));
  EXPECT_THAT(link_refusal(two_bars(),
                           rigid + held +
                               "[[fix]]\nwhere = { sphere = { centre = [\"80 mm\", 0, 0], radius = \"2 mm\" "
                               "} }\n" +
                               weight),
              HasSubstr("holds a rigid part by its faces only"));
  EXPECT_THAT(link_refusal(two_bars(), rigid + "[parts.near]\nrigid = true\n" + held + weight),
              HasSubstr("are both rigid"));
  EXPECT_THAT(
      link_refusal(two_bars(), model + held + "[[manipulator]]\npart = \"far\"\npath = [{ time = 0 }]\n"),
      HasSubstr("manipulator"));
}

}  // namespace
}  // namespace flexel::simulate
