// How well the mapping follows a known motion of all elements: exactly for rigid and affine ones, with the
// order of convergence of the method for bending and twisting.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodies.h"
#include "formats/parallel.h"
#include "mapping/bind.h"
#include "motions.h"

namespace flexel {
namespace {

Progress& silent() {
  static Progress progress("test", Progress::Mode::quiet);
  return progress;
}

MapResult map(const Body& body, MapMethod method) {
  return map_surface(body, {method}, silent());
}

using test::bend;
using test::largest_error;
using test::rms_error;
using test::round_bar;
using test::stretch;
using test::twist;

class Order : public testing::TestWithParam<Placement> {};

TEST_P(Order, AffineIsSecondAndGramSchmidtFirst) {
  struct Case {
    const char* name;
    test::Field field;
  };
  Body coarse = round_bar(8, GetParam()), fine = round_bar(16, GetParam());
  for (const Case& c : {Case{"bend", bend}, Case{"twist", twist}}) {
    test::deform(coarse, c.field);
    test::deform(fine, c.field);
    const auto order = [&](MapMethod method) {
      return std::log2(rms_error(coarse, map(coarse, method).displacement, c.field) /
                       rms_error(fine, map(fine, method).displacement, c.field));
    };
    EXPECT_NEAR(order(MapMethod::affine), 2, 0.35) << c.name;
    EXPECT_NEAR(order(MapMethod::gram_schmidt), 1, 0.35) << c.name;
  }
}

TEST_P(Order, ErrorsAreThoseOfTheStudy) {
  // Voxel centres, h = 1/16: bend 3.3e-3 and 3.9e-4, twist 8.1e-3 and 9.2e-4, stretch 2.6e-2 and none.
  // Corners lie outside and do not extrapolate, so they are better.
  Body body = round_bar(16, GetParam());
  const auto error = [&](const test::Field& field, MapMethod method) {
    test::deform(body, field);
    return rms_error(body, map(body, method).displacement, field);
  };
  EXPECT_LT(error(bend, MapMethod::affine), 4.5e-4);
  EXPECT_LT(error(bend, MapMethod::gram_schmidt), 4e-3);
  EXPECT_LT(error(twist, MapMethod::affine), 1.1e-3);
  EXPECT_LT(error(twist, MapMethod::gram_schmidt), 1e-2);
  EXPECT_LT(error(stretch, MapMethod::affine), 1e-12);
  EXPECT_LT(error(stretch, MapMethod::gram_schmidt), 3e-2);
}

TEST_P(Order, EveryVertexOfTheBarHasFourElements) {
  const Body body = round_bar(8, GetParam());
  const MapReport found = report(body, map(body, MapMethod::affine));
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
  for (const Placement placement : {Placement::corner, Placement::centre})
    for (const MapMethod method : {MapMethod::affine, MapMethod::gram_schmidt}) {
      const Body body = round_bar(6, placement);
      const MapResult result = map(body, method);
      for (const Vec3& displacement : result.displacement) EXPECT_EQ(displacement, Vec3::Zero().eval());
      EXPECT_LT(result.rest_residual, 1e-13);
      EXPECT_EQ(report(body, result).voronoi_cell_left, 0u);
    }
}

TEST(Exactness, VerticesOfUnmovedElementsStayExactly) {
  Body body = test::block(8, 4, 4, 0.1, Placement::corner, 16);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] > 4) body.position[e] += Vec3(0.01, 0.02, 0.03);
  for (const MapMethod method : {MapMethod::affine, MapMethod::gram_schmidt}) {
    const MapResult result = map(body, method);
    for (std::size_t v = 0; v < body.surface.vertices.size(); ++v)
      if (body.surface.vertices[v].x() < 0.4) {
        EXPECT_EQ(result.displacement[v], Vec3::Zero().eval());
      }
  }
}

// Rigid motions (a reflection too) by gram-schmidt, affine maps by affine, within 1e-9 of the diagonal, near
// and far away.
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
        EXPECT_LT(largest_error(body, map(body, MapMethod::gram_schmidt).displacement, rigid),
                  1e-9 * diagonal);
        EXPECT_LT(largest_error(body, map(body, MapMethod::affine).displacement, rigid), 1e-9 * diagonal);
        Mat3 shear;
        shear << 1.7, 0.4, -0.2, 0.1, 0.6, 0.3, 0, -0.5, 1.2;
        const auto affine = [&](const Vec3& x) -> Vec3 { return turn * (shear * (x - shift)) + move; };
        test::deform(body, affine);
        EXPECT_LT(largest_error(body, map(body, MapMethod::affine).displacement, affine), 1e-9 * diagonal);
      }
    }
  }
}

// Turning the whole world before or after the mapping is the same.
TEST(Exactness, DoesNotDependOnTheWorldsAxes) {
  const Mat3 turn = test::rotation(1.1, Vec3(-1, 0.4, 0.2));
  for (const MapMethod method : {MapMethod::affine, MapMethod::gram_schmidt}) {
    Body body = round_bar(6, Placement::centre);
    test::deform(body, bend);
    const MapResult here = map(body, method);
    Body turned = body;
    for (Vec3& x : turned.rest) x = turn * x;
    for (Vec3& x : turned.position) x = turn * x;
    for (Vec3& x : turned.surface.vertices) x = turn * x;
    turned.parts[0].lattice.axes = turn * body.parts[0].lattice.axes;
    turned.parts[0].lattice.origin = turn * body.parts[0].lattice.origin;
    const MapResult there = map(turned, method);
    double largest = 0;
    for (std::size_t v = 0; v < here.displacement.size(); ++v)
      largest = std::max(largest, (turn * here.displacement[v] - there.displacement[v]).norm());
    EXPECT_LT(largest, 1e-12);
  }
}

TEST(Exactness, AnyNumberOfThreadsGivesTheSameBits) {
  Body body = round_bar(8, Placement::centre);
  test::deform(body, twist);
  const auto with_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    return map(body, MapMethod::gram_schmidt);
  };
  const MapResult one = with_threads(1), four = with_threads(4);
  EXPECT_EQ(one.displacement, four.displacement);
  EXPECT_EQ(one.flags, four.flags);
  EXPECT_EQ(one.frame, four.frame);
  EXPECT_EQ(one.rest_residual, four.rest_residual);
}

}  // namespace
}  // namespace flexel
