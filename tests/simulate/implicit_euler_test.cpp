// Implicit steps: the damping matrix against the kernel's damping, and whole runs against analytic answers.
#include "simulate/time/implicit_euler.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "formats/error.h"
#include "simulate/time/damping_matrix.h"
#include "simulate/time/history.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel {
namespace {

using std::numbers::pi;
using testing::box_body;
using testing::BoxOptions;

// Sheared, squeezed, turned cells of partial fill on a turned lattice: C v is what the kernel brakes with.
TEST(DampingMatrix, IsTheKernelsDamping) {
  for (const Model model : {Model::cells, Model::springs}) {
    BoxOptions options;
    options.cells = {3, 2, 2};
    options.spacing = model == Model::springs ? Vec3(0.01, 0.01, 0.01) : Vec3(0.01, 0.012, 0.009);
    options.axes = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
    options.fill = [](int i, int j, int k) { return (i + j + k) % 2 == 0 ? 0.3 : 1.0; };
    const Body body = box_body(options);
    const Setting setting = testing::setting_of(body, {"gum", 1e6, 0.25, 1000, "test"}, model);
    const StepPlan plan{{3e-4}};
    Stepper stepper(setting, plan, true, "");
    State state = testing::at_rest(body);
    state.displacement = testing::random_displacements(body, 0.002, 1);
    state.velocity = testing::random_displacements(body, 1, 2);
    const std::vector<Vec3> velocity = state.velocity;
    const StiffnessPattern pattern =
        stiffness_pattern(body, active_cells(setting), connection_rows({}, body.element_count()));
    BlockMatrix matrix = pattern.matrix;
    set_damping(setting, pattern.stencil, plan.damping, state.displacement, matrix);
    std::vector<Vec3> pulled(body.element_count());
    multiply(matrix, velocity, pulled);
    (void)stepper.advance(state, {}, {0, 0, false});
    double largest = 0;
    for (const Vec3& force : stepper.damping_force()) largest = std::max(largest, force.norm());
    EXPECT_GT(largest, 0);
    for (std::size_t e = 0; e < pulled.size(); ++e)
      EXPECT_LT((pulled[e] + stepper.damping_force()[e]).norm(), 1e-11 * largest) << e;
  }
}

}  // namespace
}  // namespace flexel
