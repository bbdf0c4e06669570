// Scenes that would do nothing, or something else than they say: refused or told in one line.
#include "simulate/scene/scene_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "simulate/probes/report.h"
#include "simulate/result/result.h"
#include "simulate/scene/strength.h"
#include "simulate/summary.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::refusal;

std::string parse_refusal(const std::string& text) {
  try {
    (void)parse_scene(text, "s.toml");
  } catch (const InputError& error) {
    return std::string(error.where()) + ": " + error.what();
  }
  return "accepted";
}

// What a run says on stderr.
std::string told(Body body, const Scene& scene) {
  ::testing::internal::CaptureStderr();
  try {
    (void)testing::simulate_quietly(body, scene);
  } catch (const InputError& error) {
    return ::testing::internal::GetCapturedStderr() + "refused: " + error.what();
  }
  return ::testing::internal::GetCapturedStderr();
}

Scene bar(const std::string& more) {
  return parse_scene("material = \"steel\"\n[[fix]]\nwhere = \"xmin\"\n" + more, "s.toml");
}

Body small() {
  return box_body({.cells = {4, 2, 2}, .spacing = Vec3::Constant(0.01)});
}

const std::string kPush = "[[load]]\nwhere = \"xmax\"\nforce = [\"0 N\", \"0 N\", \"-1 N\"]\n";

TEST(NumbersOfAScene, AreFiniteAndWithinTheRange) {
  const std::string head = "material = \"steel\"\n[[fix]]\nwhere = \"xmin\"\n";
  for (const char* text :
       {"[[load]]\nwhere = \"xmax\"\nforce = [\"0 N\", \"0 N\", \"1 N\"]\ntime = [\"0 s\", \"1 s\"]\n"
        "factor = [0, nan]\n",
        "[[load]]\nwhere = \"xmax\"\nforce = [\"0 N\", \"0 N\", \"1 N\"]\ntime = [\"0 s\", \"1 s\"]\n"
        "factor = [0, inf]\n",
        "[[load]]\nwhere = \"xmax\"\nforce = [\"0 N\", \"0 N\", \"-1e155 N\"]\n",
        "[[load]]\nwhere = \"xmax\"\npressure = \"1e200 Pa\"\n",
        "[[load]]\nwhere = \"xmax\"\ntorque = [\"0 N m\", \"1e200 N m\", 0]\n",
        "[[load]]\nwhere = \"xmax\"\nforce = [\"0 N\", \"0 N\", \"1 N\"]\nat = [\"1e300 m\", 0, 0]\n",
        "[[move]]\nwhere = \"xmax\"\ndisplacement = [\"1e300 m\", 0, 0]\n",
        "[gravity]\nacceleration = [0, 0, \"-1e200 m/s2\"]\n", "[gravity]\nacceleration = [0, 0, inf]\n",
        "[[load]]\nwhere = { half_space = { point = [0, 0, 0], normal = [1e200, 0, 0] } }\n"
        "force = [\"0 N\", \"0 N\", \"1 N\"]\n",
        "[materials.m]\nyoung = \"1e-310 Pa\"\npoisson = 0.3\ndensity = \"1 kg/m3\"\n",
        "[[load]]\nwhere = \"xmax\"\nforce = [\"0 N\", \"0 N\", \"1e-170 N\"]\n"})
    EXPECT_THAT(parse_refusal(head + text), ::testing::AllOf(HasSubstr("s.toml:"), HasSubstr("1e35")))
        << text;
}

// Within the range a load may still be absurd: no equilibrium is claimed.
TEST(NumbersOfAScene, ALoadBeyondAllStiffnessHasNoEquilibrium) {
  for (const char* force : {"1e30 N", "1e35 N"}) {
    Body body = small();
    EXPECT_THROW((void)testing::simulate_quietly(body, bar("[[load]]\nwhere = \"xmax\"\nforce = [\"-" +
                                                           std::string(force) + "\", 0, 0]\n")),
                 DivergedError)
        << force;
  }
}

TEST(Courses, AreRefusedAtEquilibrium) {
  const std::string course = "time = [\"0 s\", \"2 s\"]\nfactor = [0, 0]\n";
  const std::string load = refusal(small(), bar(kPush + course));
  EXPECT_THAT(load, ::testing::AllOf(HasSubstr("load \"xmax\""), HasSubstr("[run] time = \"2 s\"")));
  EXPECT_THAT(refusal(small(), bar("[[move]]\nwhere = \"xmax\"\ndisplacement = [\"1 um\", 0, 0]\n" + course)),
              HasSubstr("move \"xmax\""));
  EXPECT_THAT(
      refusal(small(), parse_scene("contact = true\nmaterial = \"steel\"\n[[fix]]\nwhere = \"xmin\"\n" +
                                       kPush + course,
                                   "s.toml")),
      HasSubstr("load \"xmax\""));
  EXPECT_EQ(refusal(small(), bar(kPush)), "accepted");
}

const std::string kSoft = "[materials.STEEL]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"7850 kg/m3\"\n";

TEST(MaterialNames, TheScenesOwnGoFirstInAnyCase) {
  const Scene scene = parse_scene("material = \"Steel\"\n" + kSoft, "s.toml");
  EXPECT_EQ(materials_of_parts(scene, small()).front().young, 1e6);
  EXPECT_THAT(
      parse_refusal(kSoft + "[materials.steel]\nyoung = \"2 MPa\"\npoisson = 0.3\ndensity = \"1 kg/m3\"\n"),
      HasSubstr("are one name"));
}

TEST(MaterialNames, ADefinitionThatNothingUsesIsTold) {
  const std::string unused = "[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"930 kg/m3\"\n";
  EXPECT_THAT(told(small(), bar(kPush + unused)), HasSubstr("[materials.gum] is used by no part"));
  EXPECT_THAT(told(small(), bar(kPush + kSoft)), Not(HasSubstr("used by no part")));
}

// Faces 1 to 6 of the box are x0, x1, y0, y1, z0, z1 (polygons 0 to 5).
class NamesOfFaces : public ::testing::Test {
 protected:
  Body body_ = small();
  [[nodiscard]] std::string of(const std::string& name) const {
    try {
      const Selected found = resolve(select_by_name(name, "s.toml:3"), body_);
      return ::testing::PrintToString(found.polygons);
    } catch (const InputError& error) {
      return error.what();
    }
  }
};

TEST_F(NamesOfFaces, ANumberThatIsAlsoANameIsRefusedUnlessItSaysWhich) {
  body_.surface.faces[4].name = "1";
  EXPECT_THAT(of("box/1"),
              ::testing::AllOf(HasSubstr("two things"), HasSubstr("\"box/#1\""), HasSubstr("\"box/=1\"")));
  EXPECT_EQ(of("box/#1"), "{ 0 }");
  EXPECT_EQ(of("box/=1"), "{ 4 }");
  EXPECT_EQ(of("1"), "{ 4 }");
  EXPECT_EQ(of("box/2"), "{ 1 }");
  body_.surface.faces[4].name = "5";  // number 5 itself
  EXPECT_EQ(of("box/5"), "{ 4 }");
}

TEST_F(NamesOfFaces, ASideThatIsAlsoAGroupIsRefusedUnlessItSaysWhich) {
  body_.surface.faces[3].name = "xmin";
  for (const std::string before : {"", "box/"}) {
    EXPECT_THAT(of(before + "xmin"), HasSubstr("two things"));
    EXPECT_EQ(of(before + "#xmin"), "{ 0 }");
    EXPECT_EQ(of(before + "=xmin"), "{ 3 }");
  }
}

TEST_F(NamesOfFaces, AnEmptyNameSelectsNothing) {
  for (SurfaceFace& face : body_.surface.faces) face.name.clear();
  EXPECT_THAT(of("box/"), HasSubstr("names no face"));
  EXPECT_THAT(of("box/="), HasSubstr("nothing is called"));
  EXPECT_THAT(of("="), HasSubstr("nothing is called"));
}

TEST_F(NamesOfFaces, APartCalledLikeASideIsRefusedUnlessItSaysWhich) {
  body_.parts[0].name = body_.surface.parts[0].name = "zmax";
  EXPECT_THAT(of("zmax"), HasSubstr("two things"));
  EXPECT_EQ(of("#zmax"), "{ 5 }");
  EXPECT_EQ(resolve(select_by_name("=zmax"), body_).elements.size(), body_.element_count());
}

TEST(HeldLoads, ALoadOnAHeldFaceIsRefused) {
  EXPECT_THAT(refusal(small(), bar("[[load]]\nwhere = \"xmin\"\nforce = [0, 0, \"-1 N\"]\n")),
              HasSubstr("does nothing"));
  EXPECT_THAT(refusal(small(), bar("[[load]]\nwhere = \"box/x0\"\npressure = \"1 Pa\"\n")),
              HasSubstr("does nothing"));
  EXPECT_THAT(
      refusal(small(),
              bar("[[fix]]\nwhere = { box = { min = [0, 0, 0], max = [\"1 mm\", \"1 m\", \"1 m\"] } }\n"
                  "[[load]]\nwhere = { box = { min = [0, 0, 0], max = [\"1 mm\", \"1 m\", \"1 m\"] } }\n"
                  "force = [0, 0, \"-1 N\"]\n")),
      HasSubstr("does nothing"));
  EXPECT_THAT(
      refusal(small(), parse_scene("material = \"steel\"\n[[fix]]\nwhere = { box = { min = [0, 0, 0], max = "
                                   "[\"1 mm\", \"1 m\", \"1 m\"] } }\n[[load]]\nwhere = \"xmin\"\n"
                                   "force = [0, 0, \"-1 N\"]\n",
                                   "s.toml")),
      HasSubstr("does nothing"));
}

TEST(HeldLoads, AMoveOfAFaceWhoseElementsAreHeldIsRefused) {
  const std::string head =
      "material = \"steel\"\n[[fix]]\nwhere = { box = { min = [0, 0, 0], max = [\"1 mm\", \"1 m\", \"1 m\"] "
      "} }\n";
  const std::string move = "[[move]]\nwhere = \"xmin\"\ndisplacement = [\"1 um\", 0, 0]\n";
  EXPECT_THAT(refusal(small(), parse_scene(head + move, "s.toml")), HasSubstr("holds 100 % of the place"));
  EXPECT_EQ(refusal(small(),
                    parse_scene(head + "axes = \"yz\"\n" + move + "[[fix]]\nwhere = \"xmax\"\naxes = \"x\"\n",
                                "s.toml")),
            "accepted");
}

// A face that slides on its plane takes a force along it.
TEST(HeldLoads, AxesThatAreFreeTakeTheirPart) {
  const std::string fixes =
      "material = \"steel\"\n[[fix]]\nwhere = \"xmin\"\n[[fix]]\nwhere = \"zmax\"\naxes = "
      "\"z\"\n[[load]]\nwhere = \"zmax\"\n";
  EXPECT_THAT(told(small(), parse_scene(fixes + "force = [\"1 N\", 0, 0]\n", "s.toml")), IsEmpty());
  EXPECT_THAT(told(small(), parse_scene(fixes + "force = [\"1 N\", 0, \"-1 N\"]\n", "s.toml")),
              HasSubstr("50 % of load \"zmax\" goes straight into a support"));
  EXPECT_THAT(refusal(small(), parse_scene(fixes + "force = [0, 0, \"-1 N\"]\n", "s.toml")),
              HasSubstr("does nothing"));
}

TEST(HeldLoads, APushBesideTheSupportIsNotTold) {
  EXPECT_THAT(told(small(), bar("[[load]]\nwhere = \"zmax\"\nforce = [0, 0, \"-1 N\"]\n")), IsEmpty());
}

// A box whose top rises by 45 degrees along x: its zmax is the slanted face, reached at one edge.
Body wedge() {
  Body body = box_body({.cells = {4, 2, 4}, .spacing = Vec3::Constant(0.01)});
  for (Vec3& vertex : body.surface.vertices)
    if (vertex.z() > 0.03 && vertex.x() < 0.01) vertex.z() = 0.001;
  return body;
}

// Plane strain: what turns about z goes nowhere along z, where all is held.
TEST(HeldLoads, ATurnAboutTheHeldAxisIsNotRefused) {
  const std::string strain = "[[fix]]\nwhere = \"box\"\naxes = \"z\"\n";
  EXPECT_THAT(
      told(small(), bar(strain + "[[move]]\nwhere = \"xmax\"\nrotation = { axis = [0, 0, 1], "
                                 "through = [\"40 mm\", \"10 mm\", \"0 mm\"], angle = \"1 deg\" }\n")),
      Not(HasSubstr("refused")));
  EXPECT_THAT(
      told(small(), bar(strain + "[[load]]\nwhere = \"xmax\"\ntorque = [\"0 N m\", \"0 N m\", \"1 N m\"]\n")),
      Not(HasSubstr("straight into")));
}

// A pressure has no torque of its own that could be lost.
TEST(Torques, APressureThatTurnsIsNotTold) {
  const std::string soft =
      "material = \"jelly\"\n[materials.jelly]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 "
      "kg/m3\"\n[[fix]]\nwhere = \"xmin\"\n";
  const Scene scene =
      parse_scene(soft + "[[load]]\nwhere = [\"xmax\", \"zmax\"]\npressure = \"30 kPa\"\n", "s.toml");
  EXPECT_THAT(told(box_body({.cells = {8, 2, 2}, .spacing = Vec3::Constant(0.01)}), scene),
              Not(HasSubstr("link = ")));
}

TEST(Sides, APressureOnASideThatLooksElsewhereIsTold) {
  EXPECT_THAT(told(wedge(), bar("[[load]]\nwhere = \"zmax\"\npressure = \"1 Pa\"\n")),
              HasSubstr("44 degrees"));
  EXPECT_THAT(told(small(), bar("[[load]]\nwhere = \"zmax\"\npressure = \"1 Pa\"\n")), IsEmpty());
}

TEST(Sides, HaveAnAxisOfTheirOwn) {
  const Body body = wedge();
  EXPECT_EQ(*side_axis(select_by_name("zmax"), body), Vec3::UnitZ());
  EXPECT_EQ(*side_axis(select_by_name("box/xmin"), body), -Vec3::UnitX());
  EXPECT_FALSE(side_axis(select_by_name("box/z1"), body));
  EXPECT_FALSE(side_axis(select_by_name("=zmax"), body));
}

// A cantilever of length L and stiffness E I that an end moment M bends rolls up to an arc of angle M L / (E
// I): what falls short of it has to be told.
TEST(Torques, ThatTurnWhatTheyActOnAreTold) {
  const int thick = 2, slender = 20;
  const double side = 1.0 / slender, bending = testing::kGumYoung * std::pow(side, 4) / 12;
  for (const double angle : {0.05, 1.0}) {  // rad
    Body body = box_body({.cells = {slender * thick, thick, thick}, .spacing = Vec3::Constant(side / thick)});
    Scene scene = testing::gum_scene(0);
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("xmin")));
    Load load = make_push(select_by_name("xmax"), Vec3::Zero());
    load.force.reset();
    load.torque = Vec3(0, -angle * bending, 0);
    load.name = "end";
    scene.get<Loads>().loads.push_back(load);
    Probe tip;
    tip.where = select_by_name("xmax");
    scene.probes.push_back(tip);
    const SimulateResult result = testing::simulate_quietly(body, scene);
    const double height = (1 - std::cos(angle)) / angle;  // of the arc's end, whose length is 1
    const double found = result.probes[0].displacement.z();
    if (angle < 0.1) {
      EXPECT_NEAR(found / height, 1, 0.03);
      EXPECT_THAT(warnings_of(result), IsEmpty());
    } else {
      EXPECT_GT(std::abs(found / height - 1), 0.05);
      ASSERT_EQ(warnings_of(result).size(), 1u);
      EXPECT_THAT(warnings_of(result)[0], ::testing::AllOf(HasSubstr("load \"end\""), HasSubstr("degrees"),
                                                           HasSubstr("% of its torque is left")));
      EXPECT_THAT(summary_json(result, body, known_materials(scene, body)),
                  HasSubstr("% of its torque is left"));
    }
  }
}

}  // namespace
}  // namespace flexel::simulate
