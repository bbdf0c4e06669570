// Stresses against uniform fields, beam theory, Saint-Venant's torsion and Kirsch's plate.
#include "simulate/matter/stress.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;

constexpr double kMetalYoung = 200e9;

Scene metal_scene(double poisson) {
  Scene scene;
  scene.materials["metal"] = {"metal", kMetalYoung, poisson, 7800, "test"};
  scene.materials["metal"].yield = 250e6;
  scene.material = "metal";
  return scene;
}

SimulateResult solve_stresses(Body& body, const Scene& scene) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.estimate = false;
  return simulate(body, scene, options, progress);
}

Problem metal_setting(const Body& body, Model model = Model::cells) {
  return {body,
          {{"metal", kMetalYoung, 0.25, 7800, "test"}},
          std::vector<std::uint8_t>(body.cell_count(), 0),
          {model},
          {},
          {}};
}

State affine_state(const Body& body, const Mat3& gradient) {
  State state;
  for (const Vec3& at : body.rest) state.displacement.push_back(gradient * at);
  return state;
}

Mat3 matrix(const SymmetricStress& s) {
  Mat3 m;
  m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
  return m;
}

BoxOptions turned_graded_box() {
  BoxOptions options;
  options.cells = {3, 4, 2};
  options.spacing = Vec3(0.002, 0.0023, 0.0019);
  options.axes = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  options.fill = [](int i, int j, int k) { return 0.2 + 0.1 * ((i + 2 * j + 3 * k) % 8); };
  return options;
}

TEST(Stress, UniformFieldIsExactInCellsAndElements) {
  const Body body = box_body(turned_graded_box());
  const Mat3 strain = (Mat3() << 3, 1, 0, 1, -2, 2, 0, 2, 1).finished() * 1e-7;
  const Stresses found = stresses(metal_setting(body), affine_state(body, strain));
  const double mu = kMetalYoung / 2.5, lambda = kMetalYoung * 0.25 / (1.25 * 0.5);
  const Mat3 wanted = 2 * mu * strain + lambda * strain.trace() * Mat3::Identity();
  for (const SymmetricStress& each : found.cell)
    EXPECT_LT((matrix(each) - wanted).norm(), 2e-6 * wanted.norm());
  for (const SymmetricStress& each : found.element)
    EXPECT_LT((matrix(each) - wanted).norm(), 2e-6 * wanted.norm());
}

TEST(Stress, TurnsWithTheBody) {
  for (const Model model : {Model::cells, Model::springs}) {
    BoxOptions options = turned_graded_box();
    options.spacing = Vec3::Constant(0.002);
    const Body body = box_body(options);
    const Mat3 stretch = (Mat3() << 1.1, 0.05, 0, 0.05, 0.9, 0.02, 0, 0.02, 1).finished();
    const Mat3 turn = Eigen::AngleAxisd(1.3, Vec3(3, -1, 2).normalized()).toRotationMatrix();
    const Problem problem = metal_setting(body, model);
    const SymmetricStress before = stresses(problem, affine_state(body, stretch - Mat3::Identity())).cell[0];
    const SymmetricStress after =
        stresses(problem, affine_state(body, turn * stretch - Mat3::Identity())).cell[0];
    EXPECT_LT((matrix(after) - turn * matrix(before) * turn.transpose()).norm(), 1e-9 * before.norm());
  }
}

// Springs resist also where their cell has no shape: nothing in a file may then be no number.
TEST(Stress, OfPinchedAndFoldedSpringsIsANumber) {
  const Body body = box_body({{1, 1, 1}, Vec3::Constant(0.1)});
  State pinched{std::vector<Vec3>(8, Vec3::Zero())};
  pinched.displacement[1] = body.rest[0] - body.rest[1];
  EXPECT_TRUE(matrix(stresses(metal_setting(body, Model::springs), pinched).cell[0]).allFinite());
  State folded = pinched;
  for (std::size_t e = 0; e < 8; ++e) folded.displacement[e] = Vec3(0, 0, -2 * body.rest[e].z());
  EXPECT_EQ(matrix(stresses(metal_setting(body, Model::springs), folded).cell[0]), Mat3::Zero());
}

// The virial of an isotropic lattice of springs is Hooke's law with Poisson's ratio 1/4.
TEST(Stress, SpringsFollowHookesLaw) {
  const Body body = box_body({.cells = {2, 2, 2}, .spacing = Vec3::Constant(0.01)});
  const Mat3 strain = (Mat3() << 3, 1, 0, 1, -2, 2, 0, 2, 1).finished() * 1e-7;
  const Mat3 found =
      matrix(stresses(metal_setting(body, Model::springs), affine_state(body, strain)).cell[0]);
  const Mat3 wanted = 2 * kMetalYoung / 2.5 * (strain + 0.5 * strain.trace() * Mat3::Identity());
  EXPECT_LT((found - wanted).norm(), 1e-5 * wanted.norm());
}

TEST(Stress, PrincipalAndVonMisesOfKnownStates) {
  SymmetricStress shear = SymmetricStress::Zero();
  shear[3] = 2;
  EXPECT_NEAR(von_mises(shear), 2 * std::sqrt(3.0), 1e-14);
  EXPECT_LT((principal_stresses(shear) - Vec3(2, 0, -2)).norm(), 1e-14);
  SymmetricStress pressure = SymmetricStress::Zero();
  pressure.head<3>().setConstant(-5);
  EXPECT_EQ(von_mises(pressure), 0);
}

TEST(Stress, BendingAtEightCells) {
  constexpr int n = 8;
  const double h = 0.01 / n, length = 4 * n * h, side = n * h;
  Body body = box_body({.cells = {4 * n, n, n}, .spacing = Vec3::Constant(h)});
  Scene scene = metal_scene(0.3);
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("xmin")));
  scene.get<Loads>().loads.push_back(make_push(select_by_name("xmax"), Vec3(0, 0, 10)));
  const SimulateResult result = solve_stresses(body, scene);
  const double inertia = std::pow(side, 4) / 12;
  const auto bending = [&](const Vec3& at) {
    return 10 * (length - at.x()) * std::abs(at.z() - side / 2) / inertia;
  };
  const std::vector<double>& mises = body.cell_columns.at("cell_von_mises").values;
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    const Index3& at = body.lattice_index[body.cell_elements[c][0]];
    if (at[0] != 2 * n || (at[2] > 1 && at[2] < n - 2)) continue;
    const double wanted = bending(h * (Vec3(at[0], at[1], at[2]) + Vec3::Constant(0.5)));
    EXPECT_NEAR(mises[c] / wanted, 1, 0.05) << at[1] << " " << at[2];
  }
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    if (const Index3& at = body.lattice_index[e]; at[0] == 2 * n && at[2] % n == 0) {
      EXPECT_NEAR(body.element_columns.at("von_mises").values[e] / bending(body.rest[e]), 1, 0.05);
    }
  }
  ASSERT_TRUE(result.stress);
  EXPECT_LT(result.stress->at.x(), h);  // at the support
  EXPECT_GT(result.stress->value, bending(Vec3(0, 0, 0)) * 0.95);
  EXPECT_NEAR(*result.stress->yield_share, result.stress->value / 250e6, 1e-12);
}

// Prandtl's stress function of a square bar, shear over G and the twist per length (Timoshenko and Goodier
// 1970, section 109). y, z from the middle, in sides.
double torsion_shear(double y, double z) {
  double along_y = 0, along_z = 0;
  for (int n = 1; n < 80; n += 2) {
    const double sign = n % 4 == 1 ? 1 : -1, k = n * M_PI, scale = sign * 8 / (M_PI * M_PI * n * n);
    along_y -= scale * std::sinh(k * z) / std::cosh(k / 2) * std::cos(k * y);
    along_z += scale * (1 - std::cosh(k * z) / std::cosh(k / 2)) * std::sin(k * y);
  }
  return std::hypot(along_y, along_z);
}

TEST(Stress, TorsionAtEightCells) {
  constexpr int n = 8;
  const double h = 0.01 / n, side = n * h;
  Body body = box_body({.cells = {3 * n, n, n}, .spacing = Vec3::Constant(h)});
  Scene scene = metal_scene(0.3);
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("xmin")));
  Tie turn = make_move(select_by_name("xmax"), Vec3::Zero());
  turn.motion = {Vec3::Zero(), Vec3::UnitX(), Vec3(0, side / 2, side / 2), 1e-4};
  scene.get<Supports>().ties.push_back(turn);
  (void)solve_stresses(body, scene);
  // The twist per length in the middle, from two elements on the axis' height at one side.
  const auto angle_at = [&](int i) {
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      if (body.lattice_index[e] == Index3{i, n, n / 2})
        return (body.position[e].z() - body.rest[e].z()) / (side / 2);
    }
    return 0.0;
  };
  const double twist = (angle_at(3 * n / 2 + 1) - angle_at(3 * n / 2 - 1)) / (2 * h);
  const double scale = std::sqrt(3.0) * kMetalYoung / 2.6 * twist * side;
  const auto wanted = [&](double y, double z) { return scale * torsion_shear(y / n - 0.5, z / n - 0.5); };
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    const Index3& at = body.lattice_index[body.cell_elements[c][0]];
    if (at[0] == 3 * n / 2 && at[1] == n / 2 && (at[2] < 2 || at[2] > n - 3)) {
      EXPECT_NEAR(body.cell_columns.at("cell_von_mises").values[c] / wanted(at[1] + 0.5, at[2] + 0.5), 1,
                  0.05);
    }
  }
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    if (const Index3& at = body.lattice_index[e]; at[0] == 3 * n / 2 && at[1] == n / 2 && at[2] == n) {
      EXPECT_NEAR(body.element_columns.at("von_mises").values[e] / wanted(at[1], at[2]), 1, 0.05);
    }
  }
}

// A quarter of a plate ten times as wide as its hole, 8 cells across the hole's radius, drawn along x. Kirsch
// 1898; the plate's width raises the stress beside the hole by 1 % (Howland 1930).
TEST(Stress, HoopStressBesideAHole) {
  constexpr int n = 8, wide = 10 * n;
  const double h = 0.001, stress = 1e6;
  const auto fill = [](int i, int j, int) {
    int outside = 0;
    for (int s = 0; s < 256; ++s)
      outside += std::hypot(i + (s % 16 + 0.5) / 16, j + (s / 16 + 0.5) / 16) > n ? 1 : 0;
    return outside < 4 ? 0 : outside / 256.0;
  };
  Body body = box_body({.cells = {wide, wide, 1}, .spacing = Vec3::Constant(h), .fill = fill});
  Scene scene = metal_scene(0.3);
  for (const auto& [side, axis] : {std::pair{"xmin", 0}, {"ymin", 1}, {"zmin", 2}}) {
    Tie tie = make_fix(select_by_name(side));
    tie.axes = {axis == 0, axis == 1, axis == 2};
    scene.get<Supports>().ties.push_back(tie);
  }
  scene.get<Loads>().loads.push_back(make_pressure(select_by_name("xmax"), -stress));
  (void)solve_stresses(body, scene);
  const auto hoop = [&](double r, double angle) {
    const double a = n / r;
    return stress / 2 * (1 + a * a - (1 + 3 * std::pow(a, 4)) * std::cos(2 * angle));
  };
  int judged = 0;
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    const Index3& at = body.lattice_index[body.cell_elements[c][0]];
    const double x = at[0] + 0.5, y = at[1] + 0.5, r = std::hypot(x, y), angle = std::atan2(y, x);
    if (r < n + 0.75 || r > n + 1.75 || angle < M_PI / 3) continue;
    // Largest principal stress: the hoop stress there, to the second order of the shear beside it.
    EXPECT_NEAR(body.cell_columns.at("cell_principal_stress").values[3 * c] / hoop(r, angle), 1, 0.1)
        << r << " " << angle;
    ++judged;
  }
  EXPECT_GE(judged, 5);
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    if (body.lattice_index[e] == Index3{0, n + 1, 0}) {
      EXPECT_NEAR(body.element_columns.at("principal_stress").values[3 * e] / hoop(n + 1, M_PI / 2), 1, 0.1);
    }
  }
}

// Without lateral contraction the stress of a drawn bar is the same everywhere, on every lattice.
TEST(Stress, OfADrawnBarHasANarrowErrorBar) {
  Body body = box_body({.cells = {16, 8, 8}, .spacing = Vec3::Constant(0.001)});
  Scene scene = metal_scene(0);
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("xmin")));
  scene.get<Loads>().loads.push_back(make_pressure(select_by_name("xmax"), -1e6));
  const SimulateResult result = testing::simulate_quietly(body, scene);
  ASSERT_TRUE(result.error_bars.von_mises.has_value()) << result.error_bars.note;
  const StressBar& found = *result.error_bars.von_mises;
  ASSERT_TRUE(found.bar.has_value()) << found.value[2] << " " << found.value[1] << " " << found.value[0];
  EXPECT_NEAR(found.value[0], 1e6, 0.01e6);
  EXPECT_LE(found.bar->half_width, 0.01e6);
}

}  // namespace
}  // namespace flexel::simulate
