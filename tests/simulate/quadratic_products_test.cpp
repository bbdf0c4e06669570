// Products of model `quadratic` from moments: against the integral written out, between instruction sets and precisions.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstring>
#include <mutex>
#include <random>

#include "simulate/quadratic/cells/cell_products.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using quadratic_kernel::EightCells;
using quadratic_kernel::Elasticity;
using quadratic_kernel::kWidth;

template <class Number>
std::vector<Number> any_numbers(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Number> made(count);
  for (Number& each : made) each = static_cast<Number>(any(random));
  return made;
}

Mat3 any_rotation(std::mt19937& random) {
  std::normal_distribution<double> any;
  return Eigen::Quaterniond(any(random), any(random), any(random), any(random))
      .normalized()
      .toRotationMatrix();
}

// dP/dH of an orthotropic material in axes of its own.
Mat9 any_moduli(std::mt19937& random) {
  Eigen::Matrix<double, 6, 6> voigt = Eigen::Matrix<double, 6, 6>::Random();
  voigt = (voigt * voigt.transpose() + Eigen::Matrix<double, 6, 6>::Identity()).eval();
  voigt.topRightCorner<3, 3>().setZero();
  voigt.bottomLeftCorner<3, 3>().setZero();
  const Mat3 axes = any_rotation(random);
  constexpr int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  Mat9 own, turn;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) {
          own(3 * i + j, 3 * k + l) = voigt(place[i][j], place[k][l]);
          turn(3 * i + j, 3 * k + l) = axes(i, k) * axes(j, l);
        }
  return turn * own * turn.transpose();
}

// K of a cell by Gauss's rule with the moments as weights, without any factorization.
CellMatrix written_out(const Lattice& lattice, const Mat9& moduli, const Moments& moments) {
  CellMatrix sum = CellMatrix::Zero();
  for (std::size_t k = 0; k < kMoments; ++k) {
    const QuadraticShape shape =
        quadratic_shape({kGaussPoints[k % 5], kGaussPoints[k / 5 % 5], kGaussPoints[k / 25]});
    Eigen::Matrix<double, 9, kCellUnknowns> gradient = Eigen::Matrix<double, 9, kCellUnknowns>::Zero();
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      const Vec3 world = lattice.axes * shape.gradient[n].cwiseQuotient(lattice.spacing);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) gradient(3 * i + j, static_cast<int>(3 * n) + i) = world[j];
    }
    sum += moments[static_cast<Eigen::Index>(k)] * lattice.spacing.prod() * gradient.transpose() * moduli *
           gradient;
  }
  return sum;
}

// 3 x 3 x 2 cells in a lattice of its own axes and uneven spacing: every other one whole, the others of any moments.
struct Lump {
  Body body;
  QuadraticNodes nodes;
  std::vector<std::optional<Moments>> moments;
  std::vector<CellTurn> turns;
  std::vector<CellMatrix> supports;
  Mat9 moduli;

  Lump(bool isotropic, std::mt19937& random)
      : body(testing::box_body({.cells = {3, 3, 2}, .spacing = Vec3(0.01, 0.013, 0.008)})) {
    body.parts[0].lattice.axes = any_rotation(random);
    nodes = quadratic_nodes(body, std::vector<std::uint8_t>(body.cell_count(), 1));
    moduli = any_moduli(random);
    if (isotropic)
      for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j)
          moduli(i, j) = (i / 3 == i % 3 && j / 3 == j % 3 ? 2 : 0) + (i == j ? 3 : 0) +
                         (i / 3 == j % 3 && i % 3 == j / 3 ? 3 : 0);
    std::uniform_real_distribution<double> any(0, 0.02);
    for (std::size_t c = 0; c < nodes.cells.size(); ++c) {
      moments.emplace_back();
      if (c % 2 == 1) moments.back() = Moments::NullaryExpr([&] { return any(random) - 0.002; });
      CellTurn& turn = turns.emplace_back();
      turn.rotation = any_rotation(random);
      turn.a.setRandom();
      turn.gamma.setRandom();
      for (auto* each : {&turn.a, &turn.gamma})  // a translation neither turns a cell nor strains it
        for (int column = 0; column < 3; ++column) {
          Eigen::Map<Eigen::Matrix<double, 3, 27>> nodes_of(each->col(column).data());
          nodes_of.colwise() -= Vec3(nodes_of.rowwise().mean());
        }
      const CellMatrix half = CellMatrix::Random();
      supports.push_back(half + half.transpose());
    }
  }

  [[nodiscard]] CellProducts<double> products(bool turned) const {
    const Lattice& lattice = body.parts[0].lattice;
    CellProducts<double> made(nodes, {{cell_elasticity(lattice, moduli), lattice.axes}},
                              std::vector<std::uint32_t>(nodes.cells.size(), 0),
                              [&](std::size_t c) { return moments[c]; });
    if (!turned) return made;
    made.reserve_supports({2, 5});
    for (const std::size_t c : {2, 5}) made.set_support(c, supports[c]);
    made.turn(turns);
    return made;
  }

  [[nodiscard]] CellMatrix reference(std::size_t c, bool turned) const {
    CellMatrix matrix = written_out(body.parts[0].lattice, moduli, moments[c].value_or(whole_cell_moments()));
    if (!turned) return matrix;
    const CellTurn& turn = turns[c];
    matrix += turn.a * turn.gamma.transpose() + turn.gamma * turn.a.transpose();
    if (c == 2 || c == 5) matrix += supports[c];
    CellMatrix rotation = CellMatrix::Zero();
    for (int n = 0; n < kCellUnknowns; n += 3) rotation.block<3, 3>(n, n) = turn.rotation;
    return rotation * matrix * rotation.transpose();
  }
};

TEST(QuadraticProducts, AreTheIntegralWrittenOut) {
  std::mt19937 random(7);
  for (const bool isotropic : {true, false}) {
    const Lump lump(isotropic, random);
    for (const bool turned : {false, true}) {
      const CellProducts<double> products = lump.products(turned);
      const std::size_t n = lump.nodes.size();
      const std::vector<double> x = any_numbers<double>(3 * n, random);
      std::vector<double> expected(3 * n, 0), found(3 * n), roughly(3 * n);
      for (std::size_t c = 0; c < lump.nodes.cells.size(); ++c) {
        const CellMatrix matrix = lump.reference(c, turned);
        EXPECT_LT((products.matrix(c) - matrix).norm(), 1e-13 * matrix.norm()) << c;
        Eigen::Matrix<double, kCellUnknowns, 1> own;
        for (std::size_t i = 0; i < 81; ++i)
          own[static_cast<Eigen::Index>(i)] = x[3 * lump.nodes.of_cell[c][i / 3] + i % 3];
        const Eigen::Matrix<double, kCellUnknowns, 1> force = matrix * own;
        for (std::size_t i = 0; i < 81; ++i)
          expected[3 * lump.nodes.of_cell[c][i / 3] + i % 3] += force[static_cast<Eigen::Index>(i)];
      }
      products.forces(x.data(), found.data());
      CellProducts<float>(products).forces(x.data(), roughly.data());
      const Eigen::Map<const Eigen::VectorXd> wanted(expected.data(), static_cast<Eigen::Index>(3 * n)),
          exact(found.data(), static_cast<Eigen::Index>(3 * n)),
          single(roughly.data(), static_cast<Eigen::Index>(3 * n));
      EXPECT_LT((exact - wanted).norm(), 1e-13 * wanted.norm());
      EXPECT_LT((single - wanted).norm(), 1e-5 * wanted.norm());
      EXPECT_GT((single - wanted).norm(), 0);
    }
  }
}

TEST(QuadraticProducts, ElasticForcesAreThoseBeforeTheTurn) {
  std::mt19937 random(8);
  const Lump lump(false, random);
  const CellProducts<double> products = lump.products(true);
  const CellColumns x = CellColumns::Random();
  CellColumns found;
  for (std::size_t c = 0; c < lump.nodes.cells.size(); ++c) {
    products.elastic_forces(c, x, found);
    const CellColumns expected = lump.reference(c, false) * x;
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
  }
}

struct Tables {
  const char* name;
  InstructionSet set;
  const quadratic_kernel::Table& (*table)();
  const quadratic_kernel::MatrixTable& (*matrices)();
};
const std::vector<Tables>& tables() {
  static const std::vector<Tables> all = {
    {"portable", InstructionSet::portable, &quadratic_kernel::portable, &quadratic_kernel::matrices_portable},
#if defined(__x86_64__)
    {"avx2", InstructionSet::avx2, &quadratic_kernel::avx2, &quadratic_kernel::matrices_avx2},
    {"avx512", InstructionSet::avx512, &quadratic_kernel::avx512, &quadratic_kernel::matrices_avx512},
#endif
  };
  return all;
}

template <class Number>
void expect_same_bits(quadratic_kernel::Product<Number> product, quadratic_kernel::Product<Number> portable,
                      std::size_t points, bool isotropic, std::mt19937& random) {
  const auto moments = any_numbers<Number>(points * points * points * kWidth, random),
             rotation = any_numbers<Number>(9 * kWidth, random),
             a = any_numbers<Number>(243 * kWidth, random), gamma = any_numbers<Number>(243 * kWidth, random),
             moduli = any_numbers<Number>(36, random);
  Elasticity<Number> part{{2, 3, 1}, {}, isotropic};
  std::copy(moduli.begin(), moduli.end(), part.moduli);
  for (const bool turned : {false, true}) {
    EightCells<Number> cells{moments.data(), nullptr, nullptr, nullptr};
    if (turned) cells = {moments.data(), rotation.data(), a.data(), gamma.data()};
    std::vector<Number> expected = any_numbers<Number>(81 * kWidth, random), found = expected;
    portable(cells, part, expected.data());
    product(cells, part, found.data());
    EXPECT_EQ(found, expected) << points << isotropic << turned;
  }
}

TEST(QuadraticKernels, HaveTheSameBitsOnAllInstructionSets) {
  std::mt19937 random(9);
  for (const Tables& each : tables()) {
    if (!runs(each.set)) continue;
    SCOPED_TRACE(each.name);
    const auto &table = each.table(), &portable = quadratic_kernel::portable();
    for (const bool isotropic : {true, false})
      for (const std::size_t rule : {0, 1}) {
        expect_same_bits(table.product[rule], portable.product[rule], 3 + 2 * rule, isotropic, random);
        expect_same_bits(table.product_of_floats[rule], portable.product_of_floats[rule], 3 + 2 * rule,
                         isotropic, random);
      }
  }
}

TEST(QuadraticKernels, TheSquareOfATriangle) {
  std::mt19937 random(10);
  std::uniform_int_distribution<int> any(-quadratic_kernel::kMostSteps, quadratic_kernel::kMostSteps);
  quadratic_kernel::Triangle triangle{};
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(81, 81);
  std::int16_t* steps = triangle.steps;
  for (std::size_t r = 0; r < 81; ++r) {
    triangle.step[r] = 1e-5F * static_cast<float>(1 + r % 7);
    triangle.scale[r] = 0.5F + 0.01F * static_cast<float>(r);
    for (std::size_t j = 0; j <= r; ++j) {
      steps[j] = static_cast<std::int16_t>(any(random));
      full(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(j)) =
          static_cast<double>(triangle.step[r]) * steps[j];
    }
    steps += quadratic_kernel::group_columns(r / quadratic_kernel::kRows);
  }
  const Eigen::VectorXd scale = Eigen::Map<const Eigen::Matrix<float, 81, 1>>(triangle.scale).cast<double>();
  std::vector<float> x = any_numbers<float>(quadratic_kernel::kPaddedUnknowns, random), first;
  std::fill(x.begin() + 81, x.end(), 0.F);
  const Eigen::VectorXd wanted =
      scale.asDiagonal() *
      (full.transpose() * (full * (scale.asDiagonal() *
                                   Eigen::Map<const Eigen::Matrix<float, 81, 1>>(x.data()).cast<double>())));
  for (const Tables& each : tables()) {
    if (!runs(each.set)) continue;
    std::vector<float> lost = x, y(x.size());
    each.table().square(triangle, lost.data(), y.data());
    EXPECT_LT((Eigen::Map<const Eigen::Matrix<float, 81, 1>>(y.data()).cast<double>() - wanted).norm(),
              1e-6 * wanted.norm());
    if (first.empty()) first = y;
    EXPECT_EQ(first, y) << each.name;
  }
}

// Of each cell as forces() takes it, and of the trilinear field over its corners.
TEST(QuadraticProducts, MatricesOfNodesAndCorners) {
  std::mt19937 random(11);
  const Lump lump(true, random);
  for (const bool turned : {false, true}) {
    const CellProducts<double> products = lump.products(turned);
    std::vector<std::uint8_t> seen(lump.nodes.cells.size(), 0);
    const std::vector<std::uint32_t> twins = products.twins();
    std::mutex one_at_a_time;
    products.matrices([&](std::uint32_t c, const CellBlocks& blocks) {
      const std::lock_guard lock(one_at_a_time);
      seen[c] = 1;
      const CellMatrix matrix = lump.reference(c, turned);
      const CornerMatrix corners = corners_of(matrix);
      for (std::size_t a = 0; a < kQuadraticNodes; ++a)
        for (std::size_t b = 0; b <= a; ++b)
          for (std::size_t i = 0; i < 9; ++i) {
            const auto row = static_cast<Eigen::Index>(3 * a + i / 3),
                       column = static_cast<Eigen::Index>(3 * b + i % 3);
            const std::size_t place = quadratic_kernel::block_place(a, b) + i;
            EXPECT_NEAR(blocks.nodes[place], matrix(row, column), 1e-13 * matrix.norm()) << c;
            if (a < 8) {
              EXPECT_NEAR(blocks.corners[place], corners(row, column), 1e-13 * corners.norm()) << c;
            }
          }
    });
    for (std::size_t c = 0; c < seen.size(); ++c) EXPECT_EQ(seen[c], twins[c] == c ? 1 : 0) << c;
  }
}

TEST(QuadraticKernels, MatricesHaveTheSameBitsOnAllInstructionSets) {
  std::mt19937 random(12);
  const auto moments = any_numbers<double>(kMoments * kWidth, random);
  for (const bool isotropic : {true, false}) {
    Elasticity<double> part{{2, 3, 1}, {}, isotropic};
    const auto moduli = any_numbers<double>(36, random);
    std::copy(moduli.begin(), moduli.end(), part.moduli);
    std::vector<double> first_nodes, first_corners;
    for (const Tables& each : tables()) {
      if (!runs(each.set)) continue;
      std::vector<double> nodes(quadratic_kernel::kNodeMatrix * kWidth),
          corners(quadratic_kernel::kCornerMatrix * kWidth);
      each.matrices().matrices(moments.data(), part, nodes.data(), corners.data());
      if (first_nodes.empty()) {
        first_nodes = nodes;
        first_corners = corners;
      }
      EXPECT_EQ(nodes, first_nodes) << each.name;
      EXPECT_EQ(corners, first_corners) << each.name;
    }
  }
}

Eigen::MatrixXd written_out(const quadratic_kernel::Triangle& triangle) {
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(81, 81);
  const std::int16_t* steps = triangle.steps;
  for (Eigen::Index r = 0; r < 81; ++r) {
    for (Eigen::Index j = 0; j <= r; ++j)
      full(r, j) = static_cast<double>(triangle.step[r]) * steps[j] * static_cast<double>(triangle.scale[j]);
    steps += quadratic_kernel::group_columns(static_cast<std::size_t>(r) / quadratic_kernel::kRows);
  }
  return full;
}

// Five matrices; the third of them is not positive.
TEST(QuadraticKernels, InverseFactors) {
  constexpr std::size_t kCount = 5, kBad = 2;
  std::vector<Eigen::MatrixXd> wanted;
  std::vector<double> lower(quadratic_kernel::kFactorSize * kWidth, 0);
  for (std::size_t lane = 0; lane < kCount; ++lane) {
    const Eigen::MatrixXd half = Eigen::MatrixXd::Random(81, 81);
    const Eigen::VectorXd scale = Eigen::VectorXd::LinSpaced(81, 1, 1e6);
    Eigen::MatrixXd matrix = half * half.transpose();
    matrix.diagonal().array() += 1;
    matrix = (scale.asDiagonal() * matrix * scale.asDiagonal()).eval();
    if (lane == kBad) matrix(40, 40) = -1;
    wanted.push_back(matrix);
    for (std::size_t r = 0; r < 81; ++r)
      for (std::size_t c = 0; c <= r; ++c)
        lower[kWidth * (quadratic_kernel::row_place(r) + c) + lane] =
            matrix(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
  }
  std::vector<quadratic_kernel::Triangle> first;
  for (const Tables& each : tables()) {
    if (!runs(each.set)) continue;
    std::vector<double> lost = lower;
    std::vector<quadratic_kernel::Triangle> found(kCount);
    const unsigned failed = each.matrices().invert_factors(lost.data(), 0, kCount, found.data());
    EXPECT_EQ(failed & ((1u << kCount) - 1), 1u << kBad);
    for (std::size_t lane = 0; lane < kCount; ++lane) {
      if (lane == kBad) {
        EXPECT_EQ(found[lane].step[0], 0);
        continue;
      }
      const Eigen::MatrixXd t = written_out(found[lane]), inverse = t.transpose() * t,
                            product = wanted[lane] * inverse;
      const Eigen::VectorXd scale = wanted[lane].diagonal().cwiseSqrt();
      const Eigen::MatrixXd unit = scale.cwiseInverse().asDiagonal() * product * scale.asDiagonal();
      EXPECT_LT((unit - Eigen::MatrixXd::Identity(81, 81)).norm(), 0.05) << each.name;
    }
    if (first.empty()) first = found;
    EXPECT_EQ(std::memcmp(first.data(), found.data(), kCount * sizeof(first[0])), 0) << each.name;
  }
}

}  // namespace
}  // namespace flexel::simulate
