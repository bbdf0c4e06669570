// How well the mapping follows a known motion of all elements: exactly for rigid and affine ones, with the
// order of convergence of the method for bending and twisting.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/parallel.h"
#include "bodies.h"
#include "mapping/methods/apply.h"
#include "mapping/methods/bind.h"
#include "mapping/methods/blend.h"
#include "mapping/report/report.h"
#include "motions.h"
#include "tests/sanitized.h"

namespace flexel::mapping {
namespace {

using test::bend;
using test::largest_error;
using test::map_quietly;
using test::rms_error;
using test::round_bar;
using test::stretch;
using test::twist;

class Order : public testing::TestWithParam<Placement> {};

struct Case {
  const char* name;
  test::Field field;
};

// By method, as test::kEveryMethod.
constexpr std::array<double, 4> kOrders = {1, 2, 2, 3};

// (along, around)
std::pair<int, int> vertices_of_bar() {
  return less_if_sanitized(std::pair(128, 48), std::pair(32, 16), "a twelfth of the vertices");
}

TEST_P(Order, IsThatOfTheMethod) {
  const auto [along, around] = vertices_of_bar();
  Body coarse = round_bar(8, GetParam(), along, around), fine = round_bar(16, GetParam(), along, around);
  for (const Case& c : {Case{"bend", bend}, Case{"twist", twist}}) {
    test::deform(coarse, c.field);
    test::deform(fine, c.field);
    for (std::size_t m = 0; m < kOrders.size(); ++m) {
      const MapMethod method = test::kEveryMethod[m];
      EXPECT_NEAR(std::log2(rms_error(coarse, map_quietly(coarse, method).displacement, c.field) /
                            rms_error(fine, map_quietly(fine, method).displacement, c.field)),
                  kOrders[m], 0.35)
          << c.name << ", " << name_of(method);
    }
  }
}

TEST_P(Order, OnAKnotIsThatOfTheMethod) {
  Body coarse = test::knot(6, GetParam()), fine = test::knot(12, GetParam());
  test::deform(coarse, twist);
  test::deform(fine, twist);
  for (std::size_t m = 0; m < kOrders.size(); ++m) {
    const MapMethod method = test::kEveryMethod[m];
    EXPECT_NEAR(std::log2(rms_error(coarse, map_quietly(coarse, method).displacement, twist) /
                          rms_error(fine, map_quietly(fine, method).displacement, twist)),
                kOrders[m], 0.35)
        << name_of(method);
  }
}

// Voxel centres, h = 1/16 (`convergence` prints these): by method, root mean square errors and normal jumps
// in degrees. Corners lie outside and do not extrapolate, so they are better.
TEST_P(Order, ErrorsAreThoseOfTheStudy) {
  if (sanitized()) GTEST_SKIP() << "OnAKnotIsThatOfTheMethod goes the same ways through memory";
  struct Bounds {
    double bend, twist, stretch, bend_jump, twist_jump;
  };
  constexpr std::array<Bounds, 4> kBounds = {{{4e-3, 1e-2, 3e-2, 16, 34},
                                              {4.5e-4, 1.1e-3, 1e-12, 0.9, 3},
                                              {4e-4, 4.2e-4, 1e-12, 0.12, 0.5},
                                              {1.4e-5, 6.5e-5, 1e-12, 0.012, 0.05}}};
  Body body = round_bar(16, GetParam());
  for (std::size_t m = 0; m < kBounds.size(); ++m) {
    const auto expect = [&](const test::Field& field, double error, double jump) {
      test::deform(body, field);
      const std::vector<Vec3> mapped = map_quietly(body, test::kEveryMethod[m]).displacement;
      EXPECT_LT(rms_error(body, mapped, field), error) << name_of(test::kEveryMethod[m]);
      EXPECT_LT(test::normal_jump(body, mapped, field), jump) << name_of(test::kEveryMethod[m]);
    };
    expect(bend, kBounds[m].bend, kBounds[m].bend_jump);
    expect(twist, kBounds[m].twist, kBounds[m].twist_jump);
    expect(stretch, kBounds[m].stretch, 50);
  }
}

TEST_P(Order, EveryVertexOfTheBarHasFourElements) {
  const Body body = round_bar(8, GetParam());
  const MapReport found = report(body, map_quietly(body, &kAffine));
  EXPECT_EQ(found.kinds[0], found.vertices);
  if (GetParam() == Placement::corner) {
    EXPECT_EQ(found.widened, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Placements, Order, testing::Values(Placement::corner, Placement::centre),
                         [](const auto& with) {
                           return with.param == Placement::corner ? "corner" : "centre";
                         });

TEST(Exactness, UndeformedIsExactlyUndeformed) {
  const auto [along, around] = vertices_of_bar();
  for (const Placement placement : {Placement::corner, Placement::centre})
    for (const MapMethod method : test::kEveryMethod) {
      const Body body = round_bar(6, placement, along, around);
      const MapResult result = map_quietly(body, method);
      for (const Vec3& displacement : result.displacement) EXPECT_EQ(displacement, Vec3::Zero().eval());
      EXPECT_LT(result.rest_residual, 1e-13);
      EXPECT_EQ(report(body, result).voronoi_cell_left, 0u);
    }
}

TEST(Exactness, VerticesOfUnmovedElementsStayExactly) {
  Body body = test::block(12, 4, 4, 0.1, Placement::corner, 24);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] > 8) body.position[e] += Vec3(0.01, 0.02, 0.03);
  for (const MapMethod method : test::kEveryMethod) {
    const MapResult result = map_quietly(body, method);
    for (std::size_t v = 0; v < body.surface.vertices.size(); ++v)
      if (body.surface.vertices[v].x() < 0.5) {  // farther than any method looks
        EXPECT_EQ(result.displacement[v], Vec3::Zero().eval());
      } else if (body.surface.vertices[v].x() > 0.85) {
        EXPECT_NE(result.displacement[v], Vec3::Zero().eval());
      }
  }
}

// Rigid motions by all methods, affine maps (a reflection too) by all but gram-schmidt, within 1e-9 of the
// diagonal, near and far away.
TEST(Exactness, FollowsRigidAndAffineMotionsNearAndFar) {
  for (const double away : {0.0, 1e4}) {
    for (const Placement placement : {Placement::corner, Placement::centre}) {
      Body body = round_bar(4, placement);
      const Vec3 shift = away * Vec3(1, -2, 3);
      for (Vec3& x : body.rest) x += shift;
      for (Vec3& x : body.surface.vertices) x += shift;
      body.parts[0].lattice.origin += shift;
      const double diagonal = bounding_box(body.surface.vertices).diagonal();
      for (const double angle : {0.0, 0.3, 2.0, 3.1}) {
        const Mat3 turn = test::rotation(angle, Vec3(1, 2, 3));
        const Vec3 move(0.3, -7, 12);
        const auto rigid = [&](const Vec3& x) -> Vec3 { return turn * (x - shift) + move; };
        test::deform(body, rigid);
        EXPECT_LT(largest_error(body, map_quietly(body, &kGramSchmidt).displacement, rigid), 1e-9 * diagonal);
        EXPECT_LT(largest_error(body, map_quietly(body, &kAffine).displacement, rigid), 1e-9 * diagonal);
        Mat3 shear;
        shear << 1.7, 0.4, -0.2, 0.1, 0.6, 0.3, 0, -0.5, 1.2;
        const auto affine = [&](const Vec3& x) -> Vec3 { return turn * (shear * (x - shift)) + move; };
        test::deform(body, affine);
        for (const MapMethod method : {&kAffine, &kBlended, &kSmooth})
          EXPECT_LT(largest_error(body, map_quietly(body, method).displacement, affine), 1e-9 * diagonal);
      }
    }
  }
}

// Turning the whole world before or after the mapping is the same.
TEST(Exactness, DoesNotDependOnTheWorldsAxes) {
  const Mat3 turn = test::rotation(1.1, Vec3(-1, 0.4, 0.2));
  for (const MapMethod method : test::kEveryMethod) {
    Body body = round_bar(6, Placement::centre);
    test::deform(body, bend);
    const MapResult here = map_quietly(body, method);
    Body turned = body;
    for (Vec3& x : turned.rest) x = turn * x;
    for (Vec3& x : turned.position) x = turn * x;
    for (Vec3& x : turned.surface.vertices) x = turn * x;
    turned.parts[0].lattice.axes = turn * body.parts[0].lattice.axes;
    turned.parts[0].lattice.origin = turn * body.parts[0].lattice.origin;
    const MapResult there = map_quietly(turned, method);
    double largest = 0;
    for (std::size_t v = 0; v < here.displacement.size(); ++v)
      largest = std::max(largest, (turn * here.displacement[v] - there.displacement[v]).norm());
    EXPECT_LT(largest, method == &kSmooth ? 1e-11 : 1e-12);  // its fit has 10 unknowns
  }
}

TEST(Exactness, AnyNumberOfThreadsGivesTheSameBits) {
  Body body = round_bar(8, Placement::centre);
  test::deform(body, twist);
  for (const MapMethod method : test::kEveryMethod) {
    const auto with_threads = [&](int threads) {
      const ThreadLimit limit(threads);
      return map_quietly(body, method);
    };
    const MapResult one = with_threads(1), four = with_threads(4);
    EXPECT_EQ(one.displacement, four.displacement);
    EXPECT_EQ(one.flags, four.flags);
    EXPECT_EQ(one.frame, four.frame);
    EXPECT_EQ(one.rest_residual, four.rest_residual);
  }
}

TEST(Exactness, KeptWeightsGiveTheSameBitsAsThoseFoundAgain) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = round_bar(8, placement);
    test::deform(body, bend);
    const Binding once = bind(body, &kBlended, 1), often = bind(body, &kBlended, 2);
    EXPECT_TRUE(blend_of(once).weights.empty());
    EXPECT_FALSE(blend_of(often).weights.empty());
    EXPECT_EQ(apply(once, body, body.position), apply(often, body, body.position));
  }
}

}  // namespace
}  // namespace flexel::mapping
