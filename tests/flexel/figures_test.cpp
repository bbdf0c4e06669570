// One word, one value: the figures of one run in the summary, in the body and in the picture's legend; and
// that they are of the part, not of elements beside it that carry it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "flexel/picture/attribute.h"
#include "formats/lattice/fields.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "simulate/summary.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

constexpr double kLength = 0.04, kSide = 0.01;  // m

// A bar that lies askew in the world, so that its surface cuts cells everywhere. Its faces are "x0", "x1" and
// "sides".
Mat3 askew() {
  return (Eigen::AngleAxisd(0.4, Vec3(0, 0, 1)) * Eigen::AngleAxisd(0.3, Vec3(0, 1, 0))).toRotationMatrix();
}

Surface bar() {
  Surface surface;
  for (int c = 0; c < 8; ++c)
    surface.vertices.push_back(askew() * Vec3((c & 1) * kLength, (c >> 1 & 1) * kSide, (c >> 2) * kSide));
  const std::array<std::array<std::uint32_t, 4>, 6> quads = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  surface.polygon_offsets = {0};
  for (std::uint32_t f = 0; f < 6; ++f) {
    surface.polygon_vertices.insert(surface.polygon_vertices.end(), quads[f].begin(), quads[f].end());
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(std::min(f, 2u));
  }
  surface.faces = {{"x0", 0}, {"x1", 0}, {"sides", 0}};
  surface.parts = {{"bar"}};
  surface.sources.resize(1);
  surface.part_source = {0};
  return surface;
}

struct ModelCase {
  const char* model;
  Placement placement;
};

class Figures : public ::testing::TestWithParam<ModelCase> {
 protected:
  void SetUp() override {
    voxelize::VoxelizeOptions options;
    options.size = 0.0021;
    options.align = voxelize::Align::none;
    options.placement = GetParam().placement;
    body_ = voxelize::voxelize(bar(), options, quiet_).body;
  }

  simulate::SimulateResult run(const std::string& scene) {
    simulate::SimulateOptions options;
    options.estimate = false;
    return simulate::simulate(body_,
                              simulate::parse_scene("material = \"steel\"\n[parts.bar]\nmodel = \"" +
                                                        std::string(GetParam().model) + "\"\n" + scene,
                                                    "s.toml"),
                              options, quiet_);
  }

  Progress quiet_{"test", Progress::Mode::silent};
  Body body_;
};

TEST_P(Figures, SummaryBodyAndLegendHaveOneValue) {
  const simulate::SimulateResult result =
      run("[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = \"x1\"\nforce = [0, 0, \"-10 N\"]\n");
  const nlohmann::json summary =
      nlohmann::json::parse(summary_json(result, body_, std::vector<simulate::Material>(body_.parts.size())));
  const double moved = summary["largest_displacement"];
  EXPECT_NEAR(moved / *picture::largest_in_matter(body_, "displacement"), 1, 1e-9);
  EXPECT_NEAR(moved / largest_displacement(body_).value(), 1, 1e-9);
  EXPECT_GT(largest_strain(body_), 0);
  EXPECT_EQ(*picture::largest_in_matter(body_, "strain"), largest_strain(body_));
  if (GetParam().placement == Placement::centre) {
    EXPECT_FALSE(summary.contains("largest_von_mises"));
    return;
  }
  const std::vector<double>& column = body_.element_columns.at("von_mises").values;
  EXPECT_EQ(*std::max_element(column.begin(), column.end()), summary["largest_von_mises"]);
  EXPECT_EQ(*picture::largest_in_matter(body_, "von_mises"), summary["largest_von_mises"]);
  const Vec3 at = askew().transpose() * result.stress->at;
  EXPECT_TRUE((at.array() > -1e-9).all() && at.x() < kLength + 1e-9 &&
              std::max(at.y(), at.z()) < kSide + 1e-9)
      << at.transpose();
  // The surface is coloured by values between those of elements: no vertex has more.
  const std::vector<double> vertices = picture::at_vertices(
      body_, *picture::body_attribute(body_, "von_mises"), std::vector<std::uint32_t>(8, 0));
  EXPECT_LE(*std::max_element(vertices.begin(), vertices.end()),
            summary["largest_von_mises"].get<double>() * (1 + 1e-9));
  EXPECT_FALSE(body_.cell_columns.contains("von_mises"));
}

// A small rotation led at one end turns the bar as a whole: the farthest corner of the part moves by angle x
// arm, elements of cut cells beyond it by more.
TEST_P(Figures, TheLargestDisplacementIsOfThePart) {
  const simulate::SimulateResult result = run(
      "[[move]]\nwhere = \"x0\"\nrotation = { axis = [0, 0, 1], through = [0, 0, 0], angle = \"1 mrad\" }\n");
  double farthest = 0;
  const bool centre = GetParam().placement == Placement::centre;
  for (const Vec3& x : centre ? body_.rest : body_.surface.vertices)
    farthest = std::max(farthest, std::hypot(x.x(), x.y()));
  EXPECT_NEAR(result.largest_displacement / (2 * std::sin(0.0005) * farthest), 1, 2e-3);
  double of_elements = 0;
  for (std::size_t e = 0; e < body_.element_count(); ++e)
    of_elements = std::max(of_elements, (body_.position[e] - body_.rest[e]).norm());
  if (!centre) {
    EXPECT_GT(of_elements, 1.01 * result.largest_displacement);
  }
}

INSTANTIATE_TEST_SUITE_P(OfEveryModel, Figures,
                         ::testing::Values(ModelCase{"cells", Placement::corner},
                                           ModelCase{"springs", Placement::corner},
                                           ModelCase{"paper", Placement::centre}),
                         [](const auto& each) { return std::string(each.param.model); });

// Both ends of the bar are held, and with them all of its vertices; no cell is whole. It moves where it has
// neither.
TEST(FiguresOfDisplacement, ThePartMovesWhereItHasNoVertices) {
  for (const bool quadratic : {false, true}) {
    voxelize::VoxelizeOptions options;
    options.size = 0.012;
    options.align = voxelize::Align::none;
    options.moments = quadratic;
    Progress quiet("test", Progress::Mode::silent);
    Body body = voxelize::voxelize(bar(), options, quiet).body;
    const std::string model = quadratic ? "model = \"quadratic\"\n" : "";
    simulate::SimulateOptions run;
    run.estimate = false;
    const simulate::SimulateResult result = simulate::simulate(
        body,
        simulate::parse_scene(model + "material = \"steel\"\n[[fix]]\nwhere = [\"x0\", \"x1\"]\n"
                                      "[[load]]\nwhere = \"sides\"\nforce = [0, 0, \"-10 N\"]\n",
                              "s.toml"),
        run, quiet);
    double most = 0;
    constexpr int kSteps = 40;
    for (std::uint32_t p = 2; p < 6; ++p)
      for (int i = 0; i <= kSteps; ++i)
        for (int j = 0; j <= kSteps; ++j) {
          const auto corners = body.surface.polygon(p);
          const std::vector<Vec3>& at = body.surface.vertices;
          const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
          const Vec3 point = (1 - u) * ((1 - v) * at[corners[0]] + v * at[corners[3]]) +
                             u * ((1 - v) * at[corners[1]] + v * at[corners[2]]);
          most = std::max(most, displacement_on_surface(body, p, point)->norm());
        }
    EXPECT_GT(most, 1e-9);
    EXPECT_GT(result.largest_displacement, 0.95 * most) << model;
    EXPECT_LT(result.largest_displacement, 1.05 * most) << model;
    const LargestDisplacement surface = largest_displacement_of_surface(body);
    constexpr double kRounding = 1e-6;  // nanometres are left of positions
    EXPECT_NEAR(surface.value() / result.largest_displacement, 1, kRounding);
    EXPECT_NEAR((*displacement_on_surface(body, surface.polygon, surface.at) - surface.displacement).norm(),
                0, kRounding * surface.value());
  }
}

// Away from the ends tension is the same everywhere, and so is the stress, at elements beside the part as
// well.
TEST(FiguresOfStress, UniformTensionIsUniform) {
  voxelize::VoxelizeOptions options;
  options.size = 0.0021;
  options.align = voxelize::Align::none;
  Progress quiet("test", Progress::Mode::silent);
  Body body = voxelize::voxelize(bar(), options, quiet).body;
  simulate::Scene scene = simulate::parse_scene(
      "material = \"m\"\n[materials.m]\nyoung = \"200 GPa\"\npoisson = 0.0\ndensity = \"1 kg/m3\"\n"
      "[[fix]]\nwhere = \"x0\"\n[[load]]\nwhere = \"x1\"\npressure = \"-1 MPa\"\n",
      "s.toml");
  simulate::SimulateOptions run;
  run.estimate = false;
  const simulate::SimulateResult result = simulate::simulate(body, scene, run, quiet);
  EXPECT_NEAR(result.stress->value, 1e6, 0.25e6);
  const std::vector<double>& column = body.element_columns.at("von_mises").values;
  int judged = 0;
  double sum = 0;
  for (std::size_t e = 0; e < column.size(); ++e) {
    const double along = (askew().transpose() * body.rest[e]).x() / kLength;
    if (std::abs(along - 0.5) > 0.25) continue;  // from the ends, where cells are pulled through cut faces
    EXPECT_NEAR(column[e], 1e6, 0.2e6)
        << along;  // cells that the surface cuts are that good (docs/theory/stress.md)
    sum += column[e];
    ++judged;
  }
  EXPECT_GT(judged, 100);
  EXPECT_NEAR(sum / judged, 1e6, 0.05e6);
}

TEST(FiguresOfStress, AnInsideOutGradientHasNoStrain) {
  EXPECT_TRUE(std::isnan(equivalent_strain(Vec3(-1, 1, 1).asDiagonal())));
  EXPECT_NEAR(equivalent_strain(Vec3(2, 1, 1).asDiagonal()), 2.0 / 3 * std::log(2.0), 1e-12);
}

}  // namespace
}  // namespace flexel::commands
