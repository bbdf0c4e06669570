// Whole runs of the elastic laws against closed forms: at equilibrium, in time, and what is refused.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/math/dense.h"
#include "simulate/laws/elasticity.h"
#include "simulate/models/cells.h"
#include "tests/simulate/law_materials.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

constexpr const char* kGrain = R"(
material = "grain"
[materials.grain]
law = "orthotropic"
young = ["2 MPa", "0.4 MPa", "0.2 MPa"]
poisson = [0.37, 0.42, 0.47]
shear = ["0.3 MPa", "0.28 MPa", "0.1 MPa"]
density = "500 kg/m3"
)";
constexpr const char* kElastomer = R"(
material = "elastomer"
[materials.elastomer]
law = "mooney-rivlin"
c10 = "0.15 MPa"
c01 = "0.05 MPa"
bulk = "1.6 MPa"
density = "1000 kg/m3"
)";

constexpr const char* kChains = R"(
material = "chains"
[materials.chains]
law = "arruda-boyce"
mu = "0.3 MPa"
lambda_m = 2
bulk = "1.6 MPa"
density = "1000 kg/m3"
)";

// The elements at x = 0 stay in their plane, exactly, the corner at the origin where it is, and the bar does not turn about its length: an
// even stress along x meets all of it.
constexpr const char* kDrawnBar = R"(
[[fix]]
where = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["1 mm", "21 mm", "21 mm"] } }
axes = "x"
[[fix]]
where = { sphere = { centre = [0, 0, 0], radius = "1 mm" } }
[[fix]]
where = { sphere = { centre = [0, "20 mm", 0], radius = "1 mm" } }
axes = "z"
[[probe]]
name = "end"
where = "x1"
)";

// 40 x 20 x 20 mm.
Body long_bar() {
  return testing::box_body({.cells = {4, 2, 2}, .spacing = Vec3::Constant(0.01)});
}

constexpr double kArea = 4e-4;  // m^2
constexpr double kLength = 0.04;

SimulateResult at_equilibrium(Body& body, const std::string& scene) {
  Progress progress("test", Progress::Mode::quiet);
  return simulate(body, parse_scene(scene, "s.toml"), {}, progress);
}

std::string drawn_by(double force) {
  return fmt::format("[[load]]\nwhere = \"x1\"\nforce = [\"{} N\", 0, 0]\n", force);
}

// Drawn askew to its fibres a bar shears too (Lekhnitskii 1963): strain = compliance times stress, all over.
TEST(LawRuns, OrthotropicBarDrawnAskew) {
  const double angle = std::numbers::pi / 6;
  const std::string axes = fmt::format("[parts.box]\naxes = [[{0}, {1}, 0], [{2}, {0}, 0]]\n",
                                       std::cos(angle), std::sin(angle), -std::sin(angle));
  Body body = long_bar();
  const double force = 0.004;  // 10 Pa
  const SimulateResult result = at_equilibrium(body, kGrain + axes + kDrawnBar + drawn_by(force));
  Material material = testing::orthotropic_material();
  material.axes = Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix();
  const Mat6 compliance = inverse_6(moduli_at_rest(law_of(material)));
  const Vec3 moved = result.probes[0].displacement;
  const double strain = force / kArea * compliance(0, 0);
  EXPECT_NEAR(moved.x() / (strain * kLength), 1, 1e-3);  // the law is not linear: strains of 1e-5
  const double across = force / kArea * (compliance(3, 0) * kLength + compliance(1, 0) * 0.01);
  EXPECT_NEAR(moved.y() / across, 1, 1e-3);
  EXPECT_GT(std::abs(compliance(3, 0)), compliance(0, 0) / 4) << "it shears";
  ASSERT_TRUE(result.stress);
  EXPECT_NEAR(result.stress->value / (force / kArea), 1, 1e-3);
}

// Of a law whose strengths differ along and across the grain no share of one yield stress is told.
TEST(LawRuns, AnOrthotropicYieldIsNoLimitOfVonMises) {
  std::string grain = kGrain;
  grain.insert(grain.find("density"), "yield = \"1 kPa\"\n");
  Body body = long_bar();
  const SimulateResult result = at_equilibrium(body, grain + kDrawnBar + drawn_by(0.004));
  ASSERT_TRUE(result.stress);
  EXPECT_FALSE(result.stress->yield_share.has_value());
}

// Drawn along x to a stretch, free across.
struct Drawn {
  double stress = 0, energy = 0;  // nominal, Pa; J/m^3
};

Drawn drawn_to(const Law& law, double stretch) {
  double low = 0.5, high = 1.5;
  Mat3 h = Mat3::Zero();
  for (int i = 0; i < 200; ++i) {
    const double across = 0.5 * (low + high);
    h.diagonal() = Vec3(stretch - 1, across - 1, across - 1);
    (first_stress(law, h)(1, 1) > 0 ? high : low) = across;
  }
  return {first_stress(law, h)(0, 0), energy_density(law, h)};
}

void expect_drawn(const char* material, const Law& law, double stretch) {
  Body body = long_bar();
  const Drawn drawn = drawn_to(law, stretch);
  const SimulateResult result =
      at_equilibrium(body, std::string(material) + kDrawnBar + drawn_by(kArea * drawn.stress));
  EXPECT_NEAR(1 + result.probes[0].displacement.x() / kLength, stretch, 1e-6);
  EXPECT_NEAR(result.elastic_energy / (drawn.energy * kArea * kLength), 1, 1e-5);
}

TEST(LawRuns, MooneyRivlinBarDrawn) {
  for (const double stretch : {1.1, 1.5, 2.0})
    expect_drawn(kElastomer, law_of(testing::mooney_rivlin_material()), stretch);
}

// Far beyond the stretch of 3.37 at which chains of matter that keeps its volume end: this swells.
TEST(LawRuns, ArrudaBoyceBarDrawn) {
  const Law law = law_of(testing::arruda_boyce_material());
  for (const double stretch : {1.1, 2.0, 3.0, 4.0}) expect_drawn(kChains, law, stretch);
}

// Cells that are led all around cannot swell, so their chains end at a stretch of 6.3, and a line says so.
TEST(LawRuns, NothingIsDrawnBeyondTheLengthOfItsChains) {
  for (const char* method : {"symplectic", "implicit"}) {
    try {
      (void)testing::run_timed(
          testing::box_body({.cells = {1, 2, 2}, .spacing = Vec3::Constant(0.01)}),
          parse_scene(
              std::string(kChains) +
                  "[[fix]]\nwhere = \"x0\"\n[[move]]\nwhere = \"x1\"\ndisplacement = [\"70 mm\", 0, 0]\n"
                  "[run]\ntime = \"50 ms\"\nmethod = \"" +
                  method + "\"\n[damping]\ntime = \"2 ms\"\n",
              "s.toml"));
      ADD_FAILURE() << method;
    } catch (const DivergedError& error) {
      EXPECT_THAT(error.what(), HasSubstr("lambda_m")) << method;
    }
  }
}

// Said where a run finds no equilibrium: of matter that keeps its volume the chains end at 3.37.
TEST(LawRuns, ChainsNearTheirEndAreTold) {
  const Body body = long_bar();
  const Problem problem = testing::problem_of(body, testing::arruda_boyce_material(), Model::cells);
  const Stencil none;
  for (const double stretch : {1.0, 2.9, 3.2}) {
    State state{std::vector<Vec3>(body.element_count())};
    const Vec3 f(stretch, 1 / std::sqrt(stretch), 1 / std::sqrt(stretch));
    for (std::size_t e = 0; e < body.element_count(); ++e)
      state.displacement[e] = body.rest[e].cwiseProduct(f - Vec3::Ones());
    const DrawnChains drawn = Cells(problem, none).drawn_chains(state);
    EXPECT_NEAR(drawn.share, std::sqrt((stretch * stretch + 2 / stretch) / 12), 1e-9);
    EXPECT_EQ(said_of_chains(drawn, body).empty(), stretch < 3) << stretch;
  }
  EXPECT_THAT(said_of_chains({0.95, 0}, body),
              HasSubstr("drawn to 95 % of their length, where they end (lambda_m)"));
}

// Thrown as far as its chains let it, and back: they stop it, and its energy stays. It is thrown
// faster than its waves go, so a shorter step than the run's own is asked for.
TEST(LawRuns, ChainsStopWhatIsThrown) {
  const testing::TimedCase made = testing::run_timed(
      long_bar(),
      parse_scene(std::string(kChains) + kDrawnBar +
                      "[[velocity]]\nwhere = { half_space = { point = [\"5 mm\", 0, 0], normal = [1, 0, 0] } "
                      "}\nvelocity = [\"30 m/s\", 0, 0]\n[run]\ntime = \"4 ms\"\nstep = \"0.5 us\"\n",
                  "s.toml"));
  testing::expect_books_close(made.result);
  const std::vector<double>& x = made.history.column("end x");
  EXPECT_GT(*std::max_element(x.begin(), x.end()), 0.9 * kLength);
  EXPECT_LT(*std::max_element(x.begin(), x.end()), 1.5 * kLength);
}

// What swings with damping comes to rest where equilibrium is, far from small strains.
TEST(LawRuns, InTimeEndsAtEquilibrium) {
  for (const std::string& material : {std::string(kElastomer), std::string(kChains), std::string(kGrain)}) {
    const std::string held = R"(
[[fix]]
where = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["1 mm", "21 mm", "21 mm"] } }
[[load]]
where = "x1"
force = ["20 N", 0, "-6 N"]
[[probe]]
name = "end"
where = "x1"
)";
    Body body = long_bar();
    const Vec3 still = at_equilibrium(body, material + held).probes[0].displacement;
    EXPECT_GT(still.norm(), 0.1 * kLength);
    for (const std::string method : {"symplectic", "implicit"}) {
      const std::string timed =
          fmt::format("[run]\ntime = \"0.15 s\"\nmethod = \"{}\"\n{}[damping]\ntime = \"3 ms\"\n", method,
                      method == "implicit" ? "step = \"0.5 ms\"\n" : "");
      const testing::TimedCase made =
          testing::run_timed(long_bar(), parse_scene(material + held + timed, "s.toml"));
      EXPECT_LT((made.result.probes[0].displacement - still).norm(), 1e-3 * still.norm())
          << material << method;
      testing::expect_books_close(made.result);
    }
  }
}

// Its bulk modulus, 125 times its shear modulus, does not slow what keeps its volume.
TEST(LawRuns, NearlyIncompressibleMatterCreepsInItsDampingTime) {
  Material rubber = testing::mooney_rivlin_material();
  rubber.bulk = 50e6;
  set_isotropic_constants(rubber);
  std::string material = kElastomer;
  material.replace(material.find("1.6 MPa"), 7, "50 MPa");
  const double force = kArea * drawn_to(law_of(rubber), 1.5).stress;
  const testing::TimedCase made = testing::run_timed(
      long_bar(), parse_scene(material + kDrawnBar + drawn_by(force) +
                                  "[run]\ntime = \"20 ms\"\nmethod = \"implicit\"\nstep = \"0.2 ms\"\n"
                                  "[damping]\ntime = \"2 ms\"\n",
                              "s.toml"));
  const double way = made.result.probes[0].displacement.x() / (0.5 * kLength);
  EXPECT_GT(way, 0.97);
  EXPECT_LT(way, 1);
  testing::expect_books_close(made.result);
}

// A free bar that is thrown and wrung keeps its momenta and, undamped, its energy.
TEST(LawRuns, FreeMotionKeepsMomentaAndEnergy) {
  for (const std::string& material : {std::string(kElastomer), std::string(kChains), std::string(kGrain)}) {
    const std::string scene =
        material +
        "[[velocity]]\nwhere = { half_space = { point = [\"35 mm\", 0, 0], normal = [1, 0, 0] } }\nvelocity "
        "= [\"2 m/s\", \"3 m/s\", 0]\nspin = { axis = [1, 0, 0], "
        "through = [0, \"10 mm\", \"10 mm\"], angle_per_second = \"200 rad\" }\n"
        "[run]\ntime = \"20 ms\"\nstep = \"10 us\"\nmethod = \"verlet\"\n";
    const testing::TimedCase made = testing::run_timed(long_bar(), parse_scene(scene, "s.toml"));
    testing::expect_momenta_kept(made.history, 1e-9);
    testing::expect_books_close(made.result);
    const std::vector<double> kinetic = made.history.column("kinetic");
    EXPECT_LT(*std::min_element(kinetic.begin(), kinetic.end()), 0.8 * kinetic[0]) << "it swings";
  }
}

TEST(LawRuns, WhatIsNoMaterialIsRefused) {
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  EXPECT_THAT(testing::refusal(with(kGrain, "orthotropic", "ortotropic")),
              HasSubstr("no law \"ortotropic\"; did you mean \"orthotropic\"?"));
  EXPECT_THAT(testing::refusal(with(kGrain, "0.37", "2.5")), HasSubstr("no stable material"));
  EXPECT_THAT(testing::refusal(with(kGrain, "\"0.28 MPa\"", "\"0 MPa\"")),
              HasSubstr("\"shear\" needs to be above 0"));
  EXPECT_THAT(testing::refusal(with(kElastomer, "c01 = \"0.05 MPa\"\n", "")), HasSubstr("c01"));
  EXPECT_THAT(testing::refusal(with(kElastomer, "1.6 MPa", "0 MPa")),
              HasSubstr("\"bulk\" needs to be above 0"));
  EXPECT_THAT(testing::refusal(with(kChains, "lambda_m = 2", "lambda_m = 1")), HasSubstr("\"lambda_m\""));
  EXPECT_THAT(testing::refusal(with(kChains, "lambda_m = 2\n", "")), HasSubstr("lambda_m"));
  EXPECT_THAT(testing::refusal(with(kChains, "0.3 MPa", "0 MPa")), HasSubstr("\"mu\" needs to be above 0"));
  EXPECT_THAT(testing::refusal(with(kChains, "1.6 MPa", "9 GPa")), HasSubstr("10000 times"));
  EXPECT_THAT(testing::refusal(with(kElastomer, "c10 =", "young = \"1 MPa\"\nc10 =")), HasSubstr("young"));
}

TEST(LawRuns, WhatALawCannotDoIsRefusedByName) {
  for (const char* model : {"springs", "paper"})
    EXPECT_THAT(testing::refusal(std::string(kChains) + "[parts.box]\nmodel = \"" + model + "\"\n"),
                HasSubstr(model));
  const std::string grain = kGrain, run = "[[fix]]\nwhere = \"x0\"\n";
  EXPECT_THAT(testing::refusal(grain + "[parts.box]\nmodel = \"springs\"\n" + run),
              HasSubstr("needs model \"cells\", not \"springs\""));
  EXPECT_THAT(testing::refusal("infill = \"20 %\"\n" + grain + run), HasSubstr("takes no infill"));
  EXPECT_THAT(testing::refusal(grain + "[run]\nrenormalise = true\n" + run),
              HasSubstr("cannot be renormalised"));
  EXPECT_THAT(testing::refusal(grain + "[plasticity]\nyield = \"1 MPa\"\n[run]\ntime = \"1 ms\"\n" + run),
              HasSubstr("plasticity is for law \"neo-hooke\""));
  EXPECT_THAT(testing::refusal(grain + "[fracture]\nstrength = \"1 MPa\"\n[run]\ntime = \"1 ms\"\n" + run),
              HasSubstr("fracture is for law \"neo-hooke\""));
  EXPECT_THAT(
      testing::refusal(std::string(kElastomer) + "[parts.box]\naxes = [[1, 0, 0], [0, 1, 0]]\n" + run),
      HasSubstr("\"axes\" belong to a material with law = \"orthotropic\""));
  EXPECT_THAT(testing::refusal(grain + "[parts.box]\naxes = [[1, 0, 0], [1, 1, 0]]\n" + run),
              HasSubstr("right angle"));
}

}  // namespace
}  // namespace flexel::simulate
