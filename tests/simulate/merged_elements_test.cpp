// 2 x 2 x 2 elements as one: what stays, what it makes of parameters, and what is refused.
#include "simulate/paper/merged_elements.h"

#include <gmock/gmock.h>

#include "base/error.h"
#include "simulate/input/materials.h"
#include "simulate/matter/masses.h"
#include "simulate/models/paper_model.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

using testing::centre_body;
using testing::CentreOptions;
using ::testing::HasSubstr;

// An odd box with elements missing, factors on everything, moved and moving.
Body unlike_body() {
  CentreOptions options;
  options.voxels = {7, 4, 5};
  options.spacing = 1e-2;
  options.origin = Vec3(0.3, -0.2, 0.1);
  options.inside = [](int i, int j, int k) { return i + j + k > 1 && !(i > 4 && k > 3); };
  Body body = centre_body(options);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<double> density, velocity;
  for (Vec3& x : body.position) {
    density.push_back(0.5 * any(random));
    for (int axis = 0; axis < 3; ++axis) {
      velocity.push_back(any(random));
      x[axis] += 1e-3 * any(random);
    }
  }
  body.element_columns["density_change"] = {1, density};
  body.element_columns["velocity"] = {3, velocity};
  return body;
}

struct MergedMomentum {
  double mass = 0;
  Vec3 of = Vec3::Zero();  // sum of m v
};
MergedMomentum merged_momentum(const Body& body) {
  const Problem problem = testing::problem_of(body, testing::kCauchyGum, Model::paper);
  const std::vector<double> mass = lumped_masses(problem);
  MergedMomentum sum;
  for (std::size_t e = 0; e < mass.size(); ++e) {
    sum.mass += mass[e];
    sum.of += mass[e] * Eigen::Map<const Vec3>(&body.element_columns.at("velocity").values[3 * e]);
  }
  return sum;
}

TEST(MergedElements, MassAndMomentumAreThose) {
  const Body fine = unlike_body(), coarse = merged_elements(fine);
  EXPECT_LT(coarse.element_count(), fine.element_count() / 4);
  const MergedMomentum before = merged_momentum(fine), after = merged_momentum(coarse);
  EXPECT_NEAR(after.mass, before.mass, 1e-14 * before.mass);
  EXPECT_LT((after.of - before.of).norm(), 1e-14 * before.mass);
}

// Also where groups lack elements, whose middle is not theirs then: a body that was turned is not strained.
TEST(MergedElements, AnAffineMotionStaysThatMotion) {
  Body fine = unlike_body();
  Mat3 way;
  way << 0.1, -1.1, 0, 0.9, 0, 0.2, 0, 0.1, 1;
  for (std::size_t e = 0; e < fine.element_count(); ++e)
    fine.position[e] = way * fine.rest[e] + Vec3(1, 2, 3);
  std::vector<double> settled;
  for (std::size_t e = 0; e < fine.element_count(); ++e)
    for (int axis = 0; axis < 3; ++axis) settled.push_back(fine.position[e][axis] - fine.rest[e][axis]);
  fine.element_columns["settled"] = {3, settled};
  const Body coarse = merged_elements(fine);
  const std::vector<double>& led = coarse.element_columns.at("settled").values;
  for (std::size_t e = 0; e < coarse.element_count(); ++e) {
    EXPECT_LT((coarse.position[e] - way * coarse.rest[e] - Vec3(1, 2, 3)).norm(), 1e-12);
    EXPECT_LT((coarse.rest[e] + Eigen::Map<const Vec3>(&led[3 * e]) - coarse.position[e]).norm(), 1e-12);
  }
}

// Every element within its coarse one, whatever the lowest index.
TEST(MergedElements, ElementsRestInTheMiddleOfTheirGroup) {
  Body fine = unlike_body();
  for (Index3& at : fine.lattice_index) at[1] -= 3;
  fine.parts[0].lattice.origin += 3 * fine.parts[0].lattice.spacing.y() * fine.parts[0].lattice.axes.col(1);
  const Body coarse = merged_elements(fine);
  for (const Vec3& x : fine.rest) {
    double nearest = 1;
    for (const Vec3& middle : coarse.rest) nearest = std::min(nearest, (x - middle).cwiseAbs().maxCoeff());
    EXPECT_NEAR(nearest, 5e-3, 1e-12);
  }
}

// A block in which every group is whole has no factors; what it had everywhere it has everywhere.
TEST(MergedElements, OneFactorStaysThatFactor) {
  CentreOptions options;
  options.voxels = {4, 6, 2};
  Body fine = centre_body(options);
  EXPECT_TRUE(merged_elements(fine).element_columns.empty());
  for (const char* name : {"stiffness_change", "damping_change", "density_change", "strength_change",
                           "friction_change", "radius_change", "yield_change"})
    fine.element_columns[name] = {1, std::vector<double>(fine.element_count(), 0.25)};
  for (const char* name : {"connection_stiffness_change", "connection_damping_change",
                           "connection_strength_change", "connection_friction_change", "connection_rest"})
    fine.element_columns[name] = {13, std::vector<double>(13 * fine.element_count(), 0.25)};
  const Body coarse = merged_elements(fine);
  EXPECT_EQ(coarse.element_columns.size(), fine.element_columns.size());
  EXPECT_EQ(coarse.element_count(), 6u);
  for (const auto& [name, column] : coarse.element_columns) {
    const double wanted = name == "connection_rest" ? 0.5 : 0.25;
    for (std::size_t i = 0; i < column.values.size(); ++i) {
      const bool is_there = column.components == 1 || (coarse.connections[i / 13] >> i % 13 & 1u);
      EXPECT_NEAR(column.values[i], is_there ? wanted : 0, 1e-15) << name;
    }
  }
}

// A seam of a tenth of k and half of t between two groups: (1/2 + 10 + 1/2) / 2 of its compliance, and that t.
TEST(MergedElements, ASeamIsInSeriesAndBreaksFirst) {
  CentreOptions options;
  options.voxels = {4, 2, 2};
  Body fine = centre_body(options);
  Column stiffness{13, std::vector<double>(13 * fine.element_count(), 0)}, strength = stiffness;
  for (std::uint32_t e = 0; e < fine.element_count(); ++e)
    if (fine.lattice_index[e][0] == 1) {
      stiffness.values[13 * e] = -0.9;
      strength.values[13 * e] = -0.5;
    }
  fine.element_columns["connection_stiffness_change"] = stiffness;
  fine.element_columns["connection_strength_change"] = strength;
  const Body coarse = merged_elements(fine);
  ASSERT_EQ(coarse.element_count(), 2u);
  EXPECT_NEAR(1 + coarse.element_columns.at("connection_stiffness_change").values[0], 2 / 11.0, 1e-12);
  EXPECT_NEAR(coarse.element_columns.at("connection_strength_change").values[0], -0.5, 1e-15);
}

// Bars that hang on their elements' layers: within 10 % of the fine one drawn, and nearer the finer it is.
TEST(MergedElements, ADrawnBarIsAsStiff) {
  const auto energy = [](const Body& body) {
    const Problem problem = testing::problem_of(body, testing::kCauchyGum, Model::paper);
    const PaperModel model(problem);
    State state = testing::at_rest(body);
    for (std::size_t e = 0; e < body.element_count(); ++e)
      state.displacement[e].x() = 1e-4 * body.rest[e].x();
    return model.energy(state);
  };
  double last = 1;
  for (const int n : {4, 8, 16}) {
    CentreOptions options;
    options.voxels = {2 * n, n, n};
    options.spacing = 0.08 / n;
    const Body fine = centre_body(options);
    const double off = std::abs(energy(merged_elements(fine)) / energy(fine) - 1);
    EXPECT_LT(off, 0.65 * last) << n;
    last = off;
  }
  EXPECT_LT(last, 0.15);
}

TEST(MergedElements, ACrackBetweenGroupsStaysAndOneWithinIsRefused) {
  const auto cracked = [](int layer) {
    CentreOptions options;
    options.voxels = {8, 2, 2};
    Body body = centre_body(options);
    for (std::uint32_t e = 0; e < body.element_count(); ++e)
      for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
        const int from = body.lattice_index[e][0], to = from + half_neighbourhood[bit][0];
        if (std::min(from, to) == layer && from != to) body.connections[e] &= ~(1u << bit);
      }
    return body;
  };
  const Body coarse = merged_elements(cracked(3));
  ASSERT_EQ(coarse.element_count(), 4u);
  EXPECT_EQ(coarse.connections, (std::vector<std::uint32_t>{1, 0, 1, 0}));
  try {
    (void)merged_elements(cracked(2));
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("would join them"));
  }
}

TEST(MergedElements, WhatOneElementCannotHaveIsRefused) {
  const auto message = [](const Body& body) -> std::string {
    try {
      (void)merged_elements(body);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  Body body = centre_body({});
  EXPECT_EQ(message(body), "");
  body.notes["fused"] = "1 0 0:1 1:-1 \n";
  EXPECT_THAT(message(body), HasSubstr("\"fused\""));
  body = centre_body({});
  body.element_columns["colour"] = {1, std::vector<double>(body.element_count(), 0)};
  EXPECT_THAT(message(body), HasSubstr("\"colour\""));
  EXPECT_THAT(message(testing::small_box()), HasSubstr("has cells"));
}

}  // namespace
}  // namespace flexel::simulate
