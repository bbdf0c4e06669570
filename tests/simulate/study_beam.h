// The cantilever of the accuracy study (Jansson and Vergeest, section 5): 2 x 0.7 x 0.5 m, E = 12.1e5 Pa,
// held at one end, a small force across the other; n cubes through the 0.5 m. The 0.7 m are as many whole
// cubes as fit best, and the reference has that width too.
#pragma once
#include <cmath>

#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate::testing {

constexpr double kStudyYoung = 12.1e5, kStudyPoisson = 0.25, kStudyForce = 1e-3;
inline const Material kStudyGum{"gum", kStudyYoung, kStudyPoisson, 580, "Jansson and Vergeest, section 5"};

inline double study_width(int n) {
  return static_cast<double>(std::lround(1.4 * n)) * 0.5 / n;
}

// Deflection of the cantilever 2 x `width` x 0.5 m per newton [m/N]: Timoshenko's beam, times what C3D20R
// runs of CalculiX, extrapolated, differ from it (between two widths linearly).
inline double study_reference(double width) {
  const double widths[] = {.5, .66666667, .6875, .7, .70833333, .75};
  const double ratios[] = {.98949, .98669, .98632, .98610, .98595, .98522};
  double ratio = ratios[5];
  for (int i = 4; i >= 0; --i)
    if (width <= widths[i + 1] + 1e-9)
      ratio = ratios[i] + (ratios[i + 1] - ratios[i]) * (width - widths[i]) / (widths[i + 1] - widths[i]);
  const double inertia = width * std::pow(0.5, 3) / 12, shear = kStudyYoung / 2 / (1 + kStudyPoisson);
  const double factor = 10 * (1 + kStudyPoisson) / (12 + 11 * kStudyPoisson);
  return ratio * (8 / (3 * kStudyYoung * inertia) + 2 / (factor * shear * width * 0.5));
}

// Elements at the corners of 4n x (1.4n) x n cubes: the plane x = 0 is held, the end at x = 2 m is loaded.
inline Body corner_beam(int n) {
  BoxOptions options;
  options.cells = {4 * n, static_cast<int>(std::lround(1.4 * n)), n};
  options.spacing = Vec3::Constant(0.5 / n);
  return box_body(options);
}

// Elements at the centres of the cubes, and one layer more in front of x = 0, which is held: the held layer
// and the loaded one are 2 m apart.
inline Body centre_beam(int n) {
  CentreOptions options;
  options.voxels = {4 * n + 1, static_cast<int>(std::lround(1.4 * n)), n};
  options.spacing = 0.5 / n;
  options.origin = Vec3(-options.spacing, 0, 0);
  return centre_body(options);
}

inline Selection half_space(const Vec3& point, const Vec3& normal) {
  Selection selection;
  selection.kind = Selection::Kind::half_space;
  selection.point = point;
  selection.normal = normal;
  return selection;
}

// What the beam is made of, and its first layer held.
inline Scene held_beam(const std::string& model, const std::string& hooke = "") {
  Scene scene;
  scene.materials["gum"] = kStudyGum;
  scene.material = "gum";
  scene.parts["box"].model = model;
  scene.parts["box"].hooke = hooke;
  scene.get<Supports>().ties.push_back(make_fix(half_space(Vec3(1e-6, 0, 0), -Vec3::UnitX())));
  return scene;
}

// 100 (u / u_reference - 1) of the loaded end: above 0 is too soft.
inline double tip_error(Body body, Scene scene, Selection loaded, int n) {
  scene.get<Loads>().loads.push_back(make_push(loaded, Vec3(0, 0, kStudyForce)));
  Probe tip;
  tip.where = std::move(loaded);
  scene.probes.push_back(tip);
  const double compliance = simulate_quietly(body, scene).probes[0].displacement.z() / kStudyForce;
  return 100 * (compliance / study_reference(study_width(n)) - 1);
}

inline double cells_error(int n) {
  return tip_error(corner_beam(n), held_beam("cells"), select_by_name("box/x1"), n);
}

inline double springs_error(int n) {
  return tip_error(corner_beam(n), held_beam("springs"), select_by_name("box/x1"), n);
}

inline double paper_error(int n, const std::string& hooke) {
  const double last = 2 - 0.5 / n;
  return tip_error(centre_beam(n), held_beam("paper", hooke), half_space(Vec3(last, 0, 0), Vec3::UnitX()), n);
}

}  // namespace flexel::simulate::testing
