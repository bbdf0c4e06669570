// The paper's beam (Jansson and Vergeest, section 5): 2 x 0.7 x 0.5 m, E = 12.1e5 Pa, clamped at x = 0, a
// transverse force spread over the end at x = 2.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulate/scene.h"
#include "simulate/simulate.h"
#include "tests/simulate/box_body.h"

namespace flexel {
namespace {

using testing::box_body;

constexpr double kForce = 1e-3;  // N: the linear regime

Body beam(int n) {
  testing::BoxOptions options;
  options.cells = {4 * n, static_cast<int>(std::lround(1.4 * n)), n};
  options.spacing = Vec3(2.0 / options.cells[0], 0.7 / options.cells[1], 0.5 / options.cells[2]);
  return box_body(options);
}

Scene cantilever(double poisson, const Vec3& force) {
  Scene scene;
  scene.materials["gum"] = {"gum", 12.1e5, poisson, 580, "test"};
  scene.material = "gum";
  scene.get<Ties>().ties.push_back(make_fix(select_by_name("xmin")));
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), force));
  Probe tip;
  tip.name = "tip";
  tip.where = select_by_name("xmax");
  scene.probes.push_back(tip);
  return scene;
}

SimulateResult run(Body& body, const Scene& scene, int threads = 0) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.threads = threads;
  return simulate(body, scene, options, progress);
}

TEST(Beam, Prints) {
  for (const double poisson : {0.25, 0.3})
    for (const int axis : {1, 2})
      for (const int n : {2, 4, 8}) {
        Body body = beam(n);
        const SimulateResult r = run(body, cantilever(poisson, kForce * Vec3::Unit(axis)));
        fmt::print("nu {} axis {} n {} tip/F {:.8e} newton {} cg {} res {:.1e} {:.3f} s imbalance {:.1e}\n",
                   poisson, axis, n, r.probes[0].displacement[axis] / kForce, r.newton_iterations,
                   r.cg_iterations, r.relative_residual, r.seconds, r.imbalance.norm() / kForce);
      }
}

}  // namespace
}  // namespace flexel
