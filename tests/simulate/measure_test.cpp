// The models measured as a material tester would.
#include "simulate/measure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexel {
namespace {

Material metal(double poisson) {
  return {"metal", 200e9, poisson, 7800, "test"};
}

TEST(Measure, CellsAreTheMaterialInEveryDirection) {
  for (const double poisson : {-0.3, 0.0, 0.3, 0.45})
    for (const MeasuredDirection& each :
         measure_inside(Model::cells, HookeConstant::paper, metal(poisson), 0.002)) {
      EXPECT_NEAR(each.young / 200e9, 1, 1e-5);
      EXPECT_NEAR(each.poisson, poisson, 1e-5);
      EXPECT_NEAR(each.shear / (100e9 / (1 + poisson)), 1, 1e-5);
    }
}

TEST(Measure, SpringsAreTheMaterialAtAQuarter) {
  for (const MeasuredDirection& each :
       measure_inside(Model::springs, HookeConstant::paper, metal(0.25), 0.002)) {
    EXPECT_NEAR(each.young / 200e9, 1, 1e-5);
    EXPECT_NEAR(each.poisson, 0.25, 1e-5);
    EXPECT_NEAR(each.shear / 80e9, 1, 1e-5);
  }
}

// 3.33, 6.22 and 8.77 E along [100], [110] and [111].
TEST(Measure, ThePapersLatticeIsStiffAndUneven) {
  const auto found = measure_inside(Model::paper, HookeConstant::paper, metal(0.25), 0.002);
  EXPECT_NEAR(found[0].young / 200e9, 3.33, 0.01);
  EXPECT_NEAR(found[1].young / 200e9, 6.22, 0.01);
  EXPECT_NEAR(found[3].young / 200e9, 8.77, 0.01);
}

TEST(Measure, BarsConvergeToTheMaterial) {
  const MeasuredBar cells = measure_bar(Model::cells, HookeConstant::paper, metal(0.3), 0.002, 8);
  EXPECT_NEAR(cells.tension / 200e9, 1, 1e-4);
  EXPECT_NEAR(cells.poisson, 0.3, 1e-4);
  EXPECT_NEAR(cells.bending / 200e9, 1, 0.01);
  // A cell holds a twist by its hourglass modes: stiffer by the square of the spacing.
  const MeasuredBar coarse = measure_bar(Model::cells, HookeConstant::paper, metal(0.3), 0.002, 4);
  const double error = cells.torsion / (100e9 / 1.3) - 1, coarse_error = coarse.torsion / (100e9 / 1.3) - 1;
  EXPECT_LT(std::abs(error), 0.04);
  EXPECT_NEAR(coarse_error / error, 4, 0.5);
  const MeasuredBar springs = measure_bar(Model::springs, HookeConstant::paper, metal(0.25), 0.002, 4);
  EXPECT_NEAR(springs.tension / 200e9, 1, 1e-4);
  EXPECT_NEAR(springs.poisson, 0.25, 1e-4);
}

}  // namespace
}  // namespace flexel
