// Coarsening: matter is kept, pieces stay apart, walls stay on planes.
#include "simulate/estimate/coarsen.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>
#include <tuple>

#include "base/error.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using testing::box_body;

double volume(const Body& body) {
  double sum = 0;
  for (const Part& part : body.parts)
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      sum += body.fill[c] * part.lattice.spacing.prod();
  return sum;
}

// First moment of the matter [m^4].
Vec3 moment(const Body& body) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    for (const std::uint32_t e : body.cell_elements[c])
      sum += body.fill[c] * body.parts[0].lattice.spacing.prod() / 8 * body.rest[e];
  return sum;
}

void expect_sound(const Body& body) {
  std::set<std::tuple<int, int, int, int>> keys;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const Index3& at = body.lattice_index[e];
    EXPECT_TRUE(keys.insert({at[2], at[1], at[0], body.piece[e]}).second);
    EXPECT_LT((body.rest[e] - body.parts[0].lattice.to_world(Vec3(at[0], at[1], at[2]))).norm(), 1e-12);
  }
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    EXPECT_GT(body.fill[c], 0);
    EXPECT_LE(body.fill[c], 1);
    const Index3& low = body.lattice_index[body.cell_elements[c][0]];
    for (int a = 0; a < 8; ++a)
      EXPECT_EQ(body.lattice_index[body.cell_elements[c][static_cast<std::size_t>(a)]],
                (Index3{low[0] + (a & 1), low[1] + (a >> 1 & 1), low[2] + (a >> 2)}));
  }
}

TEST(Coarsen, EvenBoxIsABoxOfHalfTheCells) {
  const Body fine = box_body({.cells = {8, 4, 6}, .spacing = Vec3(1, 2, 3), .origin = Vec3(5, 6, 7)});
  const Body coarse = coarsened(fine);
  expect_sound(coarse);
  EXPECT_EQ(coarse.cell_count(), 4u * 2 * 3);
  EXPECT_EQ(coarse.element_count(), 5u * 3 * 4);
  EXPECT_LT((coarse.parts[0].lattice.spacing - Vec3(2, 4, 6)).norm(), 1e-12);
  for (const double fill : coarse.fill) EXPECT_NEAR(fill, 1, 1e-12);
}

TEST(Coarsen, OddWallsGetWholeCells) {
  const Body coarse = coarsened(box_body({.cells = {12, 3, 5}}));
  expect_sound(coarse);
  EXPECT_EQ(coarse.cell_count(), 8u * 2 * 3);  // all axes near the pitch of the thinnest, 1.5
  for (const double fill : coarse.fill) EXPECT_NEAR(fill, 1, 1e-9);
}

TEST(Coarsen, KeepsMatterAndItsMiddleWherePlanesDoNotFit) {
  testing::BoxOptions options{.cells = {7, 6, 9}};
  options.fill = [](int i, int j, int k) {
    return (i + j + k) % 4 == 0 ? 0.0 : 0.1 + 0.05 * ((3 * i + j + 2 * k) % 18);
  };
  const Body fine = box_body(options), coarse = coarsened(fine), coarsest = coarsened(coarse);
  for (const Body* each : {&coarse, &coarsest}) {
    expect_sound(*each);
    EXPECT_NEAR(volume(*each) / volume(fine), 1, 1e-12);
    EXPECT_LT((moment(*each) - moment(fine)).norm(), 0.2 * moment(fine).norm());
  }
}

// Two leaves with one row of empty cells between them share coarse voxels, but no coarse element.
TEST(Coarsen, LeavesInOneVoxelStayApart) {
  testing::BoxOptions options{.cells = {8, 4, 5}};
  options.fill = [](int, int, int k) { return k == 2 ? 0.0 : 1.0; };
  const Body fine = box_body(options), coarse = coarsened(fine);
  expect_sound(coarse);
  EXPECT_NEAR(volume(coarse) / volume(fine), 1, 1e-12);
  std::vector<std::uint32_t> set(coarse.element_count());
  std::iota(set.begin(), set.end(), 0u);
  for (std::size_t pass = 0; pass < coarse.element_count(); ++pass) {
    bool changed = false;
    for (const auto& cell : coarse.cell_elements) {
      std::uint32_t least = ~0u;
      for (const std::uint32_t e : cell) least = std::min(least, set[e]);
      for (const std::uint32_t e : cell) {
        changed = changed || set[e] != least;
        set[e] = least;
      }
    }
    if (!changed) break;
  }
  EXPECT_EQ(std::set<std::uint32_t>(set.begin(), set.end()).size(), 2u);
}

TEST(Coarsen, AffineDisplacementsComeBackExactly) {
  Mat3 slope;
  slope << 0.1, 0.2, -0.3, 0.05, -0.1, 0.2, 0.3, 0.1, 0.4;
  for (const std::array<int, 3>& cells : {std::array{8, 4, 6}, std::array{9, 3, 5}}) {
    const Body fine = box_body({.cells = cells, .spacing = Vec3(1, 2, 3), .origin = Vec3(5, 6, 7)});
    Coarsening coarse = coarsening(fine);
    ASSERT_LT(coarse.body.cell_count(), fine.cell_count());
    for (std::size_t e = 0; e < coarse.body.element_count(); ++e)
      coarse.body.position[e] += Vec3(1, 2, 3) + slope * coarse.body.rest[e];
    const std::vector<Vec3> moved = prolonged_displacement(coarse, fine);
    for (std::size_t e = 0; e < fine.element_count(); ++e)
      EXPECT_LT((moved[e] - Vec3(1, 2, 3) - slope * fine.rest[e]).norm(), 1e-12);
  }
}

TEST(Coarsen, LeavesInOneVoxelMoveApart) {
  testing::BoxOptions options{.cells = {8, 4, 5}};
  options.fill = [](int, int, int k) { return k == 2 ? 0.0 : 1.0; };
  const Body fine = box_body(options);
  Coarsening coarse = coarsening(fine);
  for (std::uint32_t c = 0; c < fine.cell_count(); ++c)
    for (std::uint32_t at = coarse.offsets[c]; at < coarse.offsets[c + 1]; ++at)
      for (const std::uint32_t e : coarse.body.cell_elements[coarse.cells[at]])
        coarse.body.position[e][0] =
            coarse.body.rest[e][0] + (fine.lattice_index[fine.cell_elements[c][0]][2] < 2 ? 1 : -1);
  const std::vector<Vec3> moved = prolonged_displacement(coarse, fine);
  for (std::size_t e = 0; e < fine.element_count(); ++e)
    EXPECT_LT((moved[e] - Vec3(fine.lattice_index[e][2] <= 2 ? 1 : -1, 0, 0)).norm(), 1e-12);
}

TEST(Coarsen, SurfacePolygonsKeepTheirCells) {
  const Body fine = box_body({.cells = {6, 4, 4}}), coarse = coarsened(fine);
  ASSERT_EQ(coarse.surface_cell_offsets.size(), fine.surface_cell_offsets.size());
  const std::vector<std::size_t> wanted = {4, 4, 6, 6, 6, 6};
  for (std::size_t p = 0; p < wanted.size(); ++p)
    EXPECT_EQ(coarse.surface_cell_offsets[p + 1] - coarse.surface_cell_offsets[p], wanted[p]) << p;
}

TEST(Coarsen, RefusesWithAReason) {
  EXPECT_THROW((void)coarsened(box_body({.cells = {8, 8, 1}})), InputError);
  Body body = box_body({.cells = {4, 4, 4}});
  body.cell_columns["plastic_flow"] = {6, std::vector<double>(6 * body.cell_count())};
  EXPECT_THROW((void)coarsened(body), InputError);
}

TEST(Coarsen, ThinWallsAreCounted) {
  EXPECT_EQ(share_of_thin_walls(box_body({.cells = {8, 8, 1}}), 2), 1);
  EXPECT_EQ(share_of_thin_walls(box_body({.cells = {8, 8, 2}}), 2), 0);
  // A block of 4 x 4 x 4 with a fin of 4 x 4 x 1 on it.
  testing::BoxOptions options{.cells = {8, 4, 4}};
  options.fill = [](int i, int, int k) { return i < 4 || k == 0 ? 1.0 : 0.0; };
  EXPECT_NEAR(share_of_thin_walls(box_body(options), 2), 16.0 / 80, 1e-12);
}

}  // namespace
}  // namespace flexel::simulate
