// The products of gradients at the 125 points are made once: 378 pairs of nodes, nine each.
#include "simulate/quadratic/cell_integrals.h"

namespace flexel::simulate {
namespace {

constexpr int kPairs = static_cast<int>(kQuadraticNodes * (kQuadraticNodes + 1) / 2);
using Products = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;  // (9 x pairs) x moments

Vec3 gauss_point(std::size_t k) {
  return {kGaussPoints[k % kMomentPoints], kGaussPoints[k / kMomentPoints % kMomentPoints],
          kGaussPoints[k / (kMomentPoints * kMomentPoints)]};
}

// d_j N_a d_l N_b (cell coordinates) at each point; pair by pair, a <= b.
Products gradient_products() {
  Products products(9 * kPairs, static_cast<Eigen::Index>(kMoments));
  for (std::size_t k = 0; k < kMoments; ++k) {
    const QuadraticShape shape = quadratic_shape(gauss_point(k));
    Eigen::Index row = 0;
    for (std::size_t a = 0; a < kQuadraticNodes; ++a)
      for (std::size_t b = a; b < kQuadraticNodes; ++b)
        for (int j = 0; j < 3; ++j)
          for (int l = 0; l < 3; ++l)
            products(row++, static_cast<Eigen::Index>(k)) = shape.gradient[a][j] * shape.gradient[b][l];
  }
  return products;
}

const Products& products() {
  static const Products made = gradient_products();
  return made;
}

}  // namespace

CellIntegrals::CellIntegrals(const Lattice& lattice, const Mat9& moduli)
    : lattice_(lattice), moduli_(moduli), volume_(lattice.spacing.prod()) {}

CellMatrix CellIntegrals::stiffness(const Moments& moments) const {
  const Eigen::VectorXd integrals = products() * moments;
  // G(j, l) in the world frame: to_world G^ to_world^T, G^ that in cell coordinates
  const Mat3 to_world = lattice_.axes * lattice_.spacing.cwiseInverse().asDiagonal();
  CellMatrix k;
  Eigen::Index pair = 0;
  for (int a = 0; a < static_cast<int>(kQuadraticNodes); ++a)
    for (int b = a; b < static_cast<int>(kQuadraticNodes); ++b, ++pair) {
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> own(&integrals[9 * pair]);
      const Mat3 g = volume_ * (to_world * own * to_world.transpose());
      Mat3 block;
      for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c) block(i, c) = moduli_.block<3, 3>(3 * i, 3 * c).cwiseProduct(g).sum();
      k.block<3, 3>(3 * a, 3 * b) = block;
      if (a != b) k.block<3, 3>(3 * b, 3 * a) = block.transpose();
    }
  for (int a = 0; a < kCellUnknowns; a += 3)  // rounding alone makes the diagonal blocks uneven
    k.block<3, 3>(a, a) = (0.5 * (k.block<3, 3>(a, a) + k.block<3, 3>(a, a).transpose())).eval();
  return k;
}

std::array<double, kQuadraticNodes> CellIntegrals::volumes(const Moments& moments) const {
  std::array<double, kQuadraticNodes> sum{};
  for (std::size_t k = 0; k < kMoments; ++k) {
    const QuadraticShape shape = quadratic_shape(gauss_point(k));
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      sum[n] += volume_ * moments[static_cast<Eigen::Index>(k)] * shape.value[n];
  }
  return sum;
}

Vec3 CellIntegrals::middle(const Moments& moments) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < kMoments; ++k) sum += moments[static_cast<Eigen::Index>(k)] * gauss_point(k);
  return sum / moments.sum();
}

Moments whole_cell_moments() {
  constexpr auto whole = whole_moments();
  return Moments(Eigen::Map<const Moments>(whole.data()));
}

}  // namespace flexel::simulate
