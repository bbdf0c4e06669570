// The largest stress looked at closer: what must come out whatever the cells, what one fine lattice says, and what has no limit.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <thread>

#include "base/error.h"
#include "base/stop.h"
#include "formats/lattice/quadratic_field.h"
#include "simulate/matter/voxel_pieces.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/sanitized.h"
#include "tests/voxelize/shapes.h"
#include "voxelize/voxelize_box.h"

namespace flexel {
namespace {

using ::testing::HasSubstr;
using voxelize::shapes::Mesh;

constexpr const char* kSteel =
    "material = \"s\"\nmodel = \"quadratic\"\n[materials.s]\nyoung = \"200 GPa\"\npoisson = 0.3\n"
    "density = \"7800 kg/m3\"\n";
constexpr const char* kQuarter =
    "[[fix]]\nwhere = \"xmin\"\naxes = \"x\"\n[[fix]]\nwhere = \"ymin\"\naxes = \"y\"\n[[fix]]\nwhere = "
    "\"zmin\"\naxes = \"z\"\n";
constexpr const char* kDrawn = "[[load]]\nwhere = \"xmax\"\npressure = \"-10 MPa\"\n";

// Measured: 1.2e-4 on the finer cells, 2.9e-4 of a run itself (1e-3 in Quadratic.PatchTest), of what keeps cells of slivers regular.
constexpr double kBesideSlivers = 5e-4;

struct Ran {
  Body body;
  simulate::SimulateResult result;
};

// `before_box`: called before each box of a closer look is cut out.
Ran ran(
    const Mesh& mesh, double size, const std::string& scene, bool closer,
    const std::function<void()>& before_box = [] {}) {
  Progress progress("test", Progress::Mode::quiet);
  voxelize::VoxelizeOptions how;
  how.size = size;
  how.align = voxelize::Align::none;
  how.moments = true;
  how.max_memory = 1e12;
  Ran made;
  made.body = voxelize::voxelize(voxelize::shapes::surface(mesh), how, progress).body;
  simulate::SimulateOptions options;
  const voxelize::BoxVoxelizer boxes(made.body.surface, {});
  if (closer)
    options.cut_box = [&](const simulate::LatticeBox& box) {
      before_box();
      return boxes(box.lattice, box.lower, box.upper);
    };
  made.result =
      simulate::simulate(made.body, simulate::parse_scene(kSteel + scene, "s.toml"), options, progress);
  return made;
}

void wait_for_a_limit() {
  while (!stop_is_due()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

// A quarter of a square plate with a round hole; m.
Mesh plate_with_hole(double radius, double side, double thickness, std::uint32_t steps) {
  std::vector<std::array<double, 2>> outline;
  std::vector<std::array<std::uint32_t, 3>> caps;
  const auto angle = [&](std::uint32_t k) { return 0.5 * std::numbers::pi * k / steps; };
  for (std::uint32_t k = 0; k <= steps; ++k) {
    const double scale = side / std::max(std::cos(angle(k)), std::sin(angle(k)));
    outline.push_back({scale * std::cos(angle(k)), scale * std::sin(angle(k))});
  }
  for (std::uint32_t k = steps + 1; k-- > 0;)
    outline.push_back({radius * std::cos(angle(k)), radius * std::sin(angle(k))});
  const auto inner = [&](std::uint32_t k) { return 2 * steps + 1 - k; };
  for (std::uint32_t k = 0; k < steps; ++k) {
    caps.push_back({inner(k), k, k + 1});
    caps.push_back({inner(k), k + 1, inner(k + 1)});
  }
  for (auto& [x, y] : outline) {
    if (std::abs(x) < 1e-12) x = 0;
    if (std::abs(y) < 1e-12) y = 0;
  }
  return voxelize::shapes::prism(outline, caps, 0, thickness);
}

// The prism from z = 0 to `thickness` between two curves of as many points, m.
Mesh prism_between(const std::vector<std::array<double, 2>>& lower,
                   const std::vector<std::array<double, 2>>& upper, double thickness) {
  std::vector<std::array<double, 2>> outline = lower;
  outline.insert(outline.end(), upper.rbegin(), upper.rend());
  std::vector<std::array<std::uint32_t, 3>> caps;
  const auto last = static_cast<std::uint32_t>(outline.size()) - 1;
  for (std::uint32_t k = 0; k + 1 < lower.size(); ++k) {
    caps.push_back({k, k + 1, last - k - 1});
    caps.push_back({k, last - k - 1, last - k});
  }
  return voxelize::shapes::prism(outline, caps, 0, thickness);
}

// Half of a bar along x, 0.16 x 0.03 m, whose upper side has round notches: x of the middle, radius and depth of each; m.
Mesh notched_bar(const std::vector<Vec3>& notches, double thickness) {
  constexpr double kLength = 0.16, kHeight = 0.03;
  constexpr std::uint32_t kSteps = 96;  // of a notch
  std::vector<std::array<double, 2>> upper = {{0, kHeight}};
  for (const Vec3& notch : notches) {
    const double radius = notch[1], most = std::acos(1 - notch[2] / radius);
    for (std::uint32_t k = 0; k <= kSteps; ++k) {
      const double angle = most * (2.0 * k / kSteps - 1);
      upper.push_back(
          {notch[0] + radius * std::sin(angle), kHeight + radius - notch[2] - radius * std::cos(angle)});
    }
  }
  upper.push_back({kLength, kHeight});
  std::vector<std::array<double, 2>> lower;
  for (const auto& each : upper) lower.push_back({each[0], 0});
  return prism_between(lower, upper, thickness);
}

// A quarter of a strip along x, 0.4 m long, 0.08 m wide, with an elliptic hole (24 mm across, 20 mm along) in its middle, that wide arcs of
// radius 80 mm narrow to `width` on each side of y = 0; m.
Mesh narrowed_strip(double width) {
  constexpr std::uint32_t kSteps = 40;  // of the hole, and of the arc
  constexpr double kSide = 0.04, kRadius = 0.08, kLength = 0.2, kEnd = 0.123;
  const double most = std::acos((kRadius - (kSide - width)) / kRadius);
  std::vector<std::array<double, 2>> lower, upper;
  for (std::uint32_t k = 0; k <= kSteps; ++k) {
    const double share = static_cast<double>(k) / kSteps, angle = 0.5 * std::numbers::pi * (1 - share);
    lower.push_back({0.01 * std::cos(angle), k == kSteps ? 0 : 0.012 * std::sin(angle)});
    upper.push_back({(kEnd - kRadius * std::sin(most)) * share, kSide});
  }
  lower.front()[0] = 0;
  for (std::uint32_t k = 1; k <= kSteps; ++k) {
    const double share = static_cast<double>(k) / kSteps, angle = most * (1 - share);
    lower.push_back({0.01 + (kEnd - 0.01) * share, 0});
    upper.push_back({kEnd - kRadius * std::sin(angle), width + kRadius * (1 - std::cos(angle))});
  }
  lower.push_back({kLength, 0});
  upper.push_back({kLength, width});
  return prism_between(lower, upper, 0.0044);
}

// The largest of what travels with the body is the summary's.
void expect_one_figure(const Ran& run) {
  const std::vector<double>& elements = run.body.element_columns.at("von_mises").values;
  const std::vector<double>& vertices = run.body.surface.vertex_columns.at("von_mises").values;
  EXPECT_DOUBLE_EQ(*std::max_element(elements.begin(), elements.end()), run.result.stress->value);
  EXPECT_DOUBLE_EQ(*std::max_element(vertices.begin(), vertices.end()), run.result.stress->value);
}

// A linear field is one of cells of any size: nothing changes.
constexpr const char* kSameWays = "MirroredPlacesAgree goes the same ways through memory";

TEST(LocalStress, AnEvenStressStaysAsItIs) {
  const Mesh bar = voxelize::shapes::box(Vec3(0, 0, 0), Vec3(0.1, 0.0367, 0.0283));
  const Ran run = ran(bar, 0.0071, std::string(kQuarter) + kDrawn, true);
  EXPECT_EQ(run.result.no_local_stress, "");
  ASSERT_TRUE(run.result.local_stress);
  for (const double value : run.result.local_stress->values) EXPECT_NEAR(value / 10e6, 1, kBesideSlivers);
  EXPECT_NEAR(run.result.stress->value / 10e6, 1, kBesideSlivers);
  expect_one_figure(run);
}

// Supports that lie on the face of a box (three whole cells) are not lost: an even plane strain stays one.
TEST(LocalStress, SupportsOnAFaceOfTheBoxHold) {
  const Mesh bar = voxelize::shapes::box(Vec3(0, 0, 0), Vec3(0.1, 0.0367, 0.0213));
  const Ran run =
      ran(bar, 0.0071, std::string(kQuarter) + kDrawn + "[[fix]]\nwhere = \"zmax\"\naxes = \"z\"\n", true);
  EXPECT_EQ(run.result.no_local_stress, "");
  ASSERT_TRUE(run.result.local_stress);
  const double even = 10e6 * std::sqrt(1 - 0.3 + 0.09);
  for (const double value : run.result.local_stress->values) EXPECT_NEAR(value / even, 1, kBesideSlivers);
}

// A hole whose radius is 1.2 cells: its peak is a fifth off; looked at closer it is what a lattice four times as fine says.
TEST(LocalStress, IsWhatAFineLatticeSays) {
  if (sanitized()) GTEST_SKIP() << kSameWays;
  const Mesh plate = plate_with_hole(0.006, 0.03, 0.004, 48);
  const std::string scene = std::string(kQuarter) + kDrawn;
  const Ran rough = ran(plate, 0.005, scene, false), local = ran(plate, 0.005, scene, true),
            fine = ran(plate, 0.00125, scene, false);
  EXPECT_EQ(local.result.no_local_stress, "");
  ASSERT_TRUE(local.result.local_stress);
  const double value = local.result.stress->value, truth = fine.result.stress->value;
  EXPECT_GT(std::abs(rough.result.stress->value / truth - 1), 0.05);
  ASSERT_TRUE(local.result.error_bars.von_mises);
  ASSERT_TRUE(local.result.error_bars.von_mises->bar);
  const double bar = local.result.error_bars.von_mises->bar->half_width;
  EXPECT_LT(bar / value, 0.05);
  EXPECT_NEAR(value, truth, bar + fine.result.error_bars.von_mises->bar->half_width);
  EXPECT_NEAR(value / truth, 1, 0.03);
  EXPECT_EQ(local.result.error_bars.von_mises->value[0], value);
  EXPECT_LT(std::abs(local.result.stress->at.x()), 0.002);  // beside the hole, across the load
  expect_one_figure(local);
  // what moves stays as it was
  EXPECT_EQ(local.body.cell_columns.at(kQuadraticColumn).values,
            rough.body.cell_columns.at(kQuadraticColumn).values);
}

// Two places of equal stress, mirrored: both are found, and none is larger than the other by more than the bar.
TEST(LocalStress, MirroredPlacesAgree) {
  const Mesh plate = plate_with_hole(0.006, 0.03, 0.004, 48);
  const std::string scene =
      std::string(kQuarter) + "[[load]]\nwhere = [\"xmax\", \"ymax\"]\npressure = \"-10 MPa\"\n";
  const Ran run = ran(plate, 0.005, scene, true);
  ASSERT_TRUE(run.result.local_stress);
  ASSERT_TRUE(run.result.local_stress->bar);
  const std::vector<double>& vertices = run.body.surface.vertex_columns.at("von_mises").values;
  double at_x = 0, at_y = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vec3& at = run.body.surface.vertices[v];
    if (std::abs(at.head<2>().norm() - 0.006) > 1e-9) continue;
    double& most = at.x() > at.y() ? at_x : at_y;
    most = std::max(most, vertices[v]);
  }
  EXPECT_NEAR(std::max(at_x, at_y), run.result.stress->value, 1e-6 * at_x);
  expect_one_figure(run);
}

// At a re-entrant edge the stress has no limit, and a closer look gives it none.
TEST(LocalStress, HasNoBarAtAReEntrantEdge) {
  const Mesh angle =
      voxelize::shapes::prism({{0, 0}, {0.06, 0}, {0.06, 0.02}, {0.02, 0.02}, {0.02, 0.06}, {0, 0.06}},
                              {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}, 0, 0.01);
  const Ran run =
      ran(angle, 0.0043,
          "[[fix]]\nwhere = \"ymax\"\n[[load]]\nwhere = \"xmax\"\nforce = [0, \"-100 N\", 0]\n", true);
  EXPECT_THAT(run.result.stress->beside, HasSubstr("re-entrant edge"));
  ASSERT_TRUE(run.result.error_bars.von_mises);
  EXPECT_FALSE(run.result.error_bars.von_mises->bar);
  if (run.result.no_local_stress.empty()) {
    EXPECT_LT(run.result.local_stress->stress.value, run.result.stress->value);
    EXPECT_GT((run.result.local_stress->stress.at - run.result.stress->at).norm(), 0.0043);
  }
}

// The clamp has no limit; away from it a bar has what beam theory says.
TEST(LocalStress, AwayFromAClampIsWhatBeamTheorySays) {
  const Mesh bar = voxelize::shapes::box(Vec3(0, 0, 0), Vec3(0.2, 0.02, 0.02));
  const Ran run =
      ran(bar, 0.01, "[[fix]]\nwhere = \"xmin\"\n[[load]]\nwhere = \"xmax\"\nforce = [0, 0, \"-1000 N\"]\n",
          true);
  EXPECT_EQ(run.result.stress->beside, "a support");
  EXPECT_FALSE(run.result.error_bars.von_mises->bar);
  ASSERT_TRUE(run.result.local_stress);
  const simulate::LocalStress& away = *run.result.local_stress;
  ASSERT_TRUE(away.bar);
  EXPECT_GT(away.stress.at.x(), 0.0199);
  EXPECT_LT(away.stress.at.x(), 0.0251);
  const double theory = 1000 * (0.2 - away.stress.at.x()) * 0.01 / (std::pow(0.02, 4) / 12);
  EXPECT_NEAR(away.stress.value / theory, 1, 0.01);
  const std::vector<double>& elements = run.body.element_columns.at("von_mises").values;
  EXPECT_DOUBLE_EQ(*std::max_element(elements.begin(), elements.end()), run.result.stress->value);
}

// Part of a force that is spread over a face, and part of a support, lie in the box.
TEST(LocalStress, LoadsAndSupportsAreSharesOfTheWhole) {
  const Mesh bar = voxelize::shapes::box(Vec3(0, 0, 0), Vec3(0.02, 0.06, 0.06));
  const std::string scene = std::string(kQuarter) + "[[load]]\nwhere = \"xmax\"\nforce = [\"36 kN\", 0, 0]\n";
  const Ran run = ran(bar, 0.0071, scene, true);
  EXPECT_EQ(run.result.no_local_stress, "");
  ASSERT_TRUE(run.result.local_stress);
  for (const double value : run.result.local_stress->values) EXPECT_NEAR(value / 10e6, 1, kBesideSlivers);
}

// A notch of a sixth of a cell, which the run hardly sees, has a larger stress (Kt = 3.065 of the semicircular one) than the wide one
// that it finds.
TEST(LocalStress, FindsANotchThatTheRunDoesNotSee) {
  if (sanitized()) GTEST_SKIP() << kSameWays;
  const Mesh bar = notched_bar({Vec3(0.05, 0.016, 0.004), Vec3(0.12, 0.0008, 0.0008)}, 0.004);
  // in plane strain the von Mises stress of a free surface is sqrt(1 - nu + nu^2) of the one along it
  const std::string scene = std::string(kQuarter) + kDrawn + "[[fix]]\nwhere = \"zmax\"\naxes = \"z\"\n";
  const double truth = 3.065 * 10e6 * std::sqrt(1 - 0.3 + 0.09);
  const Ran rough = ran(bar, 0.0051, scene, false), local = ran(bar, 0.0051, scene, true);
  EXPECT_LT(std::abs(rough.result.stress->at.x() - 0.05), 0.01);
  EXPECT_LT(std::abs(local.result.stress->at.x() - 0.12), 0.001);
  EXPECT_NEAR(local.result.stress->value / truth, 1, 0.03);
  ASSERT_TRUE(local.result.local_stress->bar);
  EXPECT_NEAR(local.result.stress->value, truth, local.result.local_stress->bar->half_width);
  expect_one_figure(local);
}

// A wide notch that the run has right, and one with a radius of a cell, which it has a third too low: there the largest stress is. Where time ends the
// look after the first place, the bar says what may be at the other.
TEST(LocalStress, FindsANotchThatTheRunHasTooLow) {
  if (sanitized()) GTEST_SKIP() << kSameWays;
  constexpr double kTruth = 19.77e6;  // Pa, as cells of 4.1 and 3.1 mm find it
  constexpr int kBoxesOfFirst = 4;
  const Mesh bar = notched_bar({Vec3(0.05, 0.016, 0.004), Vec3(0.118, 0.00525, 0.002)}, 0.004);
  const std::string scene = std::string(kQuarter) + kDrawn + "[[fix]]\nwhere = \"zmax\"\naxes = \"z\"\n";
  const Ran found = ran(bar, 0.0051, scene, true);
  int boxes = 0;
  const Ran stopped = ran(bar, 0.0051, scene, true, [&] {
    if (++boxes > kBoxesOfFirst) throw TimeoutError("stopped by --timeout");
  });
  for (const Ran* each : {&found, &stopped}) {
    ASSERT_TRUE(each->result.local_stress);
    ASSERT_TRUE(each->result.local_stress->bar);
    EXPECT_NEAR(each->result.stress->value, kTruth, each->result.local_stress->bar->half_width);
    expect_one_figure(*each);
  }
  EXPECT_LT(std::abs(found.result.stress->at.x() - 0.118), 0.002);
  EXPECT_LT(found.result.local_stress->bar->half_width, 0.05 * kTruth);
  EXPECT_EQ(stopped.result.local_stress->places, 1);
  EXPECT_LT(stopped.result.stress->value, 0.95 * kTruth);
}

// Half of the time that is left is for what comes after the look.
TEST(LocalStress, LeavesHalfOfTheTime) {
  if (sanitized()) GTEST_SKIP() << "its time limit is for programs of usual speed";
  const Mesh bar = voxelize::shapes::box(Vec3(0, 0, 0), Vec3(0.1, 0.0367, 0.0283));
  const std::string scene = std::string(kQuarter) + kDrawn;
  const Ran alone = ran(bar, 0.0142, scene, false);
  const StopAfter limit(8, "--timeout");  // s; the run takes a tenth of one
  const Ran run = ran(bar, 0.0142, scene, true, wait_for_a_limit);
  EXPECT_FALSE(limit.passed());
  EXPECT_FALSE(run.result.local_stress);
  EXPECT_EQ(run.result.no_local_stress, "it did not end in half of the time that was left");
  EXPECT_EQ(run.result.stress->value, alone.result.stress->value);
  ASSERT_TRUE(run.result.error_bars.von_mises->bar);
  EXPECT_EQ(run.result.error_bars.von_mises->bar->half_width,
            alone.result.error_bars.von_mises->bar->half_width);
}

// The run has a stress at the hole 7 % too large, and above that of the arcs, which it has as they are: there the largest stress is.
TEST(LocalStress, APlaceThatTheRunHadRightCountsAsItIs) {
  if (sanitized()) GTEST_SKIP() << kSameWays;
  const std::string scene =
      "[[fix]]\nwhere = \"xmin\"\naxes = \"x\"\n[[fix]]\nwhere = \"ymin\"\naxes = \"y\"\n"
      "[[fix]]\nwhere = [\"zmin\", \"zmax\"]\naxes = \"z\"\n" +
      std::string(kDrawn);
  const Mesh strip = narrowed_strip(0.0102);
  const Ran rough = ran(strip, 0.0044, scene, false), local = ran(strip, 0.0044, scene, true);
  ASSERT_TRUE(local.result.local_stress);
  ASSERT_TRUE(local.result.local_stress->bar);
  EXPECT_LT(rough.result.stress->at.x(), 0.01);
  EXPECT_NEAR(local.result.stress->at.x(), 0.119, 0.01);
  EXPECT_NEAR(local.result.stress->value, 9.5e6, local.result.local_stress->bar->half_width);
  EXPECT_LT(local.result.local_stress->bar->half_width, 0.05 * local.result.stress->value);
  expect_one_figure(local);
}

TEST(LocalStress, RefusesByName) {
  const Mesh bar = voxelize::shapes::box(Vec3(0, 0, 0), Vec3(0.1, 0.02, 0.02));
  const auto refused = [&](const std::string& scene) {
    try {
      (void)ran(bar, 0.01, scene, true);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  const std::string held = "[[fix]]\nwhere = \"xmin\"\n";
  EXPECT_THAT(refused(held + "[[load]]\nwhere = \"xmax\"\nforce = [0, 0, \"-1 N\"]\nlink = \"rigid\"\n"),
              HasSubstr("closer look at the largest stress does not take rigid links"));
  EXPECT_THAT(refused(held + "[[load]]\nwhere = \"xmax\"\nforce = [0, 0, \"-1 N\"]\nfollower = true\n"),
              HasSubstr("does not take loads that follow"));
}

}  // namespace
}  // namespace flexel
