// The deformation as a map of all space: what vertices follow near the part, smooth everywhere.
#include "mapping/space/space_field.h"

#include <gtest/gtest.h>

#include <random>

#include "base/error.h"
#include "formats/lattice/quadratic_field.h"
#include "mapping/methods/apply.h"
#include "mapping/methods/bind.h"
#include "motions.h"
#include "tests/sanitized.h"

namespace flexel::mapping {
namespace {

constexpr double kFieldSpacing = 0.2;

Vec3 bent_by_wave(const Vec3& p) {
  return {p.x() + 0.1 * std::sin(3 * p.y()), p.y() + 0.2 * std::cos(2 * p.x()) * p.z(),
          p.z() * (1 + 0.2 * std::sin(p.x()))};
}

// An angle of two bars: between them is space that no element is near.
Body angle_body() {
  Lattice lattice;
  lattice.spacing = Vec3::Constant(kFieldSpacing);
  Body body = test::make_body(
      lattice, {0, 0, 0}, {16, 16, 2},
      [&](const Vec3& p) { return lattice.to_lattice(p).x() < 2 || lattice.to_lattice(p).y() < 2; },
      Placement::corner);
  test::deform(body, bent_by_wave);
  return body;
}

// The nodes between the elements follow bent_by_wave() too.
void add_quadratic(Body& body) {
  Column column{3 * static_cast<int>(kBetweenNodes), {}};
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    const Vec3 low = body.rest[body.cell_elements[c][0]];
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      if (corner_of_node(n) < 8) continue;
      const Vec3 at = low + kFieldSpacing / 2 *
                                Vec3(static_cast<double>(n % 3), static_cast<double>(n / 3 % 3),
                                     static_cast<double>(n / 9));
      const Vec3 u = bent_by_wave(at) - at;
      column.values.insert(column.values.end(), {u.x(), u.y(), u.z()});
    }
  }
  body.cell_columns[kQuadraticColumn] = column;
}

// Largest change of the second differences of phi along a line, from one to the next; `points` of them.
double roughness(const SpaceField& field, const Vec3& from, const Vec3& to, int points) {
  SpaceField::Probe probe(field);
  const Vec3 step = (to - from) / points;
  const double h = 0.02 * kFieldSpacing;
  const Vec3 along = h * step.normalized();
  Vec3 before = Vec3::Zero();
  double largest = 0;
  for (int i = 0; i <= points; ++i) {
    const Vec3 x = from + i * step;
    const Vec3 second = (probe.at(x + along, 0) - 2 * probe.at(x, 0) + probe.at(x - along, 0)) / (h * h);
    if (i > 0) largest = std::max(largest, (second - before).norm());
    before = second;
  }
  return largest;
}

TEST(SpaceField, FollowsTheMapNearTheElements) {
  const Body body = angle_body();
  const SpaceField field(body, &kBlended, 1), twice(body, &kBlended, 2);
  const SpaceMap map(body);
  SpaceField::Probe probe(field), twice_probe(twice);
  SpaceMap::Probe direct(map);
  for (const Vec3& x : body.rest) {
    const Vec3 inside = x + Vec3(0.3, 0.2, 0.4) * kFieldSpacing;
    EXPECT_LT((probe.at(inside, 0) - direct.at(inside, 0).position).norm(), 1e-14);
    EXPECT_LT((twice_probe.at(inside, 0) - (2 * probe.at(inside, 0) - inside)).norm(), 1e-14);
  }
}

TEST(SpaceField, FollowsThePolynomialsOfTheCells) {
  Body body = angle_body();
  add_quadratic(body);
  const SpaceField field(body, &kShapeFunctions, 1);
  SpaceField::Probe probe(field);
  std::vector<Vec3> displacement(body.element_count());
  for (std::size_t e = 0; e < displacement.size(); ++e) displacement[e] = body.position[e] - body.rest[e];
  const QuadraticField cells(body, displacement);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    const Vec3 middle = body.rest[body.cell_elements[c][0]] + Vec3::Constant(kFieldSpacing / 2);
    // what is left of the neighbours' weights in the middle is nothing
    EXPECT_LT((probe.at(middle, 0) - middle - cells.displacement(c, Vec3::Constant(0.5))).norm(), 1e-15);
    const Vec3 face = middle + Vec3(kFieldSpacing / 2, 0, 0);
    EXPECT_LT((probe.at(face, 0) - bent_by_wave(face)).norm(), 1e-3 * kFieldSpacing);
  }
}

// A jump of the second derivative would stay as the points come closer; one of the first would grow.
TEST(SpaceField, SecondDerivativesAreContinuousEverywhere) {
  Body body = angle_body();
  add_quadratic(body);
  for (const MapMethod method : {&kBlended, &kShapeFunctions}) {
    const SpaceField field(body, method, 1);
    using Line = std::pair<Vec3, Vec3>;
    const Line across_void{Vec3(0.05, 2.9, 0.17), Vec3(2.9, 0.11, 0.2)};
    for (const auto& [from, to] :
         less_if_sanitized<std::vector<Line>>({{Vec3(0.1, 0.13, 0.2), Vec3(3.1, 0.21, 0.23)},  // along a bar
                                               across_void,
                                               {Vec3(0.3, 1.7, 0.2), Vec3(6, 5, 1)}},  // far away
                                              {across_void}, "one line of three")) {
      const double coarse = roughness(field, from, to, 2000), fine = roughness(field, from, to, 8000);
      EXPECT_LT(fine, 0.5 * coarse) << name_of(method) << " from " << from.transpose();
    }
  }
}

TEST(SpaceField, FarAwayItIsBounded) {
  const Body body = angle_body();
  const SpaceField field(body, &kBlended, 1);
  SpaceField::Probe probe(field);
  for (const Vec3& x : {Vec3(2.5, 2.5, 0.2), Vec3(-3, 1, 4), Vec3(9, 9, 9)})
    EXPECT_LT((probe.at(x, 0) - x).norm(), 1.0 + x.norm()) << x.transpose();
}

TEST(SpaceField, MethodsThatAreNotSmoothAreRefused) {
  const Body body = angle_body();
  EXPECT_THROW(SpaceField(body, &kAffine, 1), InputError);
  EXPECT_THROW(SpaceField(body, &kSmooth, 1), InputError);
  EXPECT_THROW(SpaceField(body, &kShapeFunctions, 1), InputError);  // another model's body
}

}  // namespace
}  // namespace flexel::mapping
