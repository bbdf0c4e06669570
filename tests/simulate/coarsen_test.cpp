// Coarsening: matter is kept, pieces stay apart, walls stay on planes.
#include "simulate/estimate/coarsen.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <tuple>

#include "base/error.h"
#include "formats/lattice/cell_moments.h"
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

// The integral of x^a y^b z^c over the matter, from the moments: its own or those of a whole cell.
double integral(const Body& body, int a, int b, int c) {
  const CellMoments whole = whole_moments();
  const Lattice& lattice = body.parts[0].lattice;
  double sum = 0;
  std::size_t next = 0;
  for (std::uint32_t cell = 0; cell < body.cell_count(); ++cell) {
    const double* moments = whole.data();
    if (next < body.moment_cells.size() && body.moment_cells[next] == cell)
      moments = &body.moments[kMoments * next++];
    const Index3& low = body.lattice_index[body.cell_elements[cell][0]];
    for (std::size_t k = 0; k < kMoments; ++k) {
      const Vec3 at = lattice.to_world(Vec3(low[0] + kGaussPoints[k % 5], low[1] + kGaussPoints[k / 5 % 5],
                                            low[2] + kGaussPoints[k / 25]));
      sum +=
          lattice.spacing.prod() * moments[k] * std::pow(at[0], a) * std::pow(at[1], b) * std::pow(at[2], c);
    }
  }
  return sum;
}

void expect_same_integrals(const Body& fine, const Body& coarse) {
  for (int a = 0; a <= 4; ++a)
    for (int b = 0; b <= 4; ++b)
      for (int c = 0; c <= 4; ++c) {
        const double exact = integral(fine, a, b, c);
        EXPECT_NEAR(integral(coarse, a, b, c), exact, 1e-12 * std::abs(exact)) << a << b << c;
      }
  std::size_t next = 0;
  for (std::uint32_t cell = 0; cell < coarse.cell_count(); ++cell) {
    if (next < coarse.moment_cells.size() && coarse.moment_cells[next] == cell) {
      const auto begin = coarse.moments.begin() + static_cast<std::ptrdiff_t>(kMoments * next++);
      EXPECT_NEAR(std::accumulate(begin, begin + kMoments, 0.0), coarse.fill[cell], 1e-12);
    } else {
      EXPECT_GE(coarse.fill[cell], kWholeFill);
    }
  }
  EXPECT_EQ(next, coarse.moment_cells.size());
  EXPECT_EQ(coarse.moments.size(), kMoments * next);
}

TEST(CoarseMoments, IntegrateThePolynomialsThatTheFineOnesDo) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(0.5, 1);
  for (const bool all_cut : {true, false}) {
    testing::BoxOptions options{.cells = {5, 4, 1}, .spacing = Vec3(1, 2, 3), .origin = Vec3(1, 1, 1)};
    options.fill = [&](int i, int j, int) { return i == 3 && j == 1 ? 0 : all_cut || i == 4 ? 0.5 : 1; };
    Body fine = box_body(options);
    for (std::uint32_t c = 0; c < fine.cell_count(); ++c) {
      if (fine.fill[c] == 1) continue;
      fine.moment_cells.push_back(c);
      double sum = 0;
      for (const double moment : whole_moments()) {
        fine.moments.push_back(moment * uniform(random));
        sum += fine.moments.back();
      }
      fine.fill[c] = sum;
    }
    const Body coarse = coarsened(fine);
    expect_sound(coarse);
    EXPECT_EQ(coarse.cell_count(), 3u * 2);
    EXPECT_LT((coarse.parts[0].lattice.spacing - Vec3(2, 4, 6)).norm(), 1e-12) << "no cell is cut";
    expect_same_integrals(fine, coarse);
  }
}

TEST(CoarseMoments, OfALayerAreThoseOfTheLayer) {
  testing::BoxOptions options{.cells = {8, 4, 5}};
  options.fill = [](int, int, int k) { return k == 4 ? 0.3 : 1; };
  Body fine = box_body(options);
  const auto layer = [](double height) {
    CellMoments moments{};
    for (std::size_t g = 0; g < kMomentPoints; ++g) {
      const auto z = lagrange_at(height * kGaussPoints[g]);
      for (std::size_t k = 0; k < kMoments; ++k)
        moments[k] += kGaussWeights[k % 5] * kGaussWeights[k / 5 % 5] * height * kGaussWeights[g] * z[k / 25];
    }
    return moments;
  };
  for (std::uint32_t c = 0; c < fine.cell_count(); ++c) {
    if (fine.fill[c] == 1) continue;
    fine.moment_cells.push_back(c);
    for (const double moment : layer(0.3)) fine.moments.push_back(moment);
  }
  const Body coarse = coarsened(fine);
  ASSERT_EQ(coarse.cell_count(), 4u * 2 * 3);
  ASSERT_EQ(coarse.moment_cells.size(), 4u * 2);
  const CellMoments wanted = layer(0.15);
  for (std::size_t n = 0; n < coarse.moment_cells.size(); ++n) {
    EXPECT_EQ(coarse.moment_cells[n], 16 + n);
    for (std::size_t k = 0; k < kMoments; ++k)
      EXPECT_NEAR(coarse.moments[kMoments * n + k], wanted[k], 1e-15);
  }
}

TEST(CoarseMoments, OfWholeCellsThatCoarsePlanesCut) {
  testing::BoxOptions options{.cells = {7, 6, 9}};
  options.fill = [](int i, int j, int k) { return (i + j + k) % 4 == 0 ? 0.0 : 1; };
  const Body fine = box_body(options), coarse = coarsened(fine);
  EXPECT_FALSE(coarse.moment_cells.empty());
  expect_same_integrals(fine, coarse);
}

TEST(CoarseMoments, AreNotThereWhereTheFineOnesAreNot) {
  testing::BoxOptions options{.cells = {6, 6, 6}};
  options.fill = [](int, int, int k) { return k == 5 ? 0.5 : 1; };
  const Body coarse = coarsened(box_body(options));
  EXPECT_TRUE(coarse.moment_cells.empty());
  EXPECT_TRUE(coarse.moments.empty());
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
