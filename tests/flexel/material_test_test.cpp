// The models measured as a material tester would.
#include "flexel/measure/material_test.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexel::commands {
namespace {

simulate::Material metal(double poisson) {
  return {"metal", 200e9, poisson, 7800, "test"};
}

TEST(Measure, CellsAreTheMaterialInEveryDirection) {
  for (const double poisson : {-0.3, 0.0, 0.3, 0.45})
    for (const commands::MeasuredDirection& each :
         measure_inside(simulate::Model::cells, simulate::HookeConstant::paper, metal(poisson), 0.002)) {
      EXPECT_NEAR(each.young / 200e9, 1, 1e-5);
      EXPECT_NEAR(each.poisson, poisson, 1e-5);
      EXPECT_NEAR(each.shear / (100e9 / (1 + poisson)), 1, 1e-5);
    }
}

TEST(Measure, SpringsAreTheMaterialAtAQuarter) {
  for (const commands::MeasuredDirection& each :
       measure_inside(simulate::Model::springs, simulate::HookeConstant::paper, metal(0.25), 0.002)) {
    EXPECT_NEAR(each.young / 200e9, 1, 1e-5);
    EXPECT_NEAR(each.poisson, 0.25, 1e-5);
    EXPECT_NEAR(each.shear / 80e9, 1, 1e-5);
  }
}

// 3.33, 6.22 and 8.77 E along [100], [110] and [111].
TEST(Measure, ThePapersLatticeIsStiffAndUneven) {
  const auto found =
      measure_inside(simulate::Model::paper, simulate::HookeConstant::paper, metal(0.25), 0.002);
  EXPECT_NEAR(found[0].young / 200e9, 3.33, 0.01);
  EXPECT_NEAR(found[1].young / 200e9, 6.22, 0.01);
  EXPECT_NEAR(found[3].young / 200e9, 8.77, 0.01);
}

TEST(Measure, BarsThatStrainEvenlyAreTheMaterial) {
  for (const auto& [model, poisson] : {std::pair{simulate::Model::cells, 0.3},
                                       {simulate::Model::cells, 0.45},
                                       {simulate::Model::springs, 0.25}})
    for (const int n : {2, 4}) {
      const commands::MeasuredBar bar =
          measure_bar(model, simulate::HookeConstant::paper, metal(poisson), 0.002, n);
      EXPECT_NEAR(bar.tension / 200e9, 1, 1e-4);
      EXPECT_NEAR(bar.poisson, poisson, 1e-4);
      // Sheared springs pull unevenly on the corners of a cell; neighbours cancel that but at free edges.
      EXPECT_NEAR(bar.shear / (100e9 / (1 + poisson)), 1,
                  model == simulate::Model::cells ? 1e-4 : 0.03 / (n * n * n));
    }
}

// A cell holds the change of strain inside it by its hourglass modes: pure bending of `cells` exactly, else off by the square
// of the spacing.
TEST(Measure, BentAndTwistedBarsConvergeToTheMaterial) {
  for (const auto& [model, poisson] :
       {std::pair{simulate::Model::cells, 0.3}, {simulate::Model::springs, 0.25}}) {
    const commands::MeasuredBar coarse =
        measure_bar(model, simulate::HookeConstant::paper, metal(poisson), 0.002, 4);
    const commands::MeasuredBar fine =
        measure_bar(model, simulate::HookeConstant::paper, metal(poisson), 0.002, 8);
    const double shear = 100e9 / (1 + poisson);
    if (model == simulate::Model::cells)
      EXPECT_NEAR(coarse.bending / 200e9, 1, 1e-4);
    else
      EXPECT_NEAR((coarse.bending / 200e9 - 1) / (fine.bending / 200e9 - 1), 4, 0.5);
    EXPECT_NEAR((coarse.torsion / shear - 1) / (fine.torsion / shear - 1), 4, 0.5);
    const commands::MeasuredBar limit = limit_of(coarse, fine);
    EXPECT_NEAR(limit.bending / 200e9, 1, 0.002);
    EXPECT_NEAR(limit.torsion / shear, 1, 0.005);
  }
}

}  // namespace
}  // namespace flexel::commands
