// Moment k is the weight of Gauss's point k; a cell_elasticity() is the strain-stress relation in the lattice's axes.
#include "simulate/quadratic/cells/cell_integrals.h"

#include <algorithm>

namespace flexel::simulate {

Vec3 gauss_point(std::size_t k) {
  return {kGaussPoints[k % kMomentPoints], kGaussPoints[k / kMomentPoints % kMomentPoints],
          kGaussPoints[k / (kMomentPoints * kMomentPoints)]};
}

Mat3 stress_of(const Mat9& moduli, const Mat3& gradient) {
  Eigen::Matrix<double, 9, 1> h;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) h[3 * k + l] = gradient(k, l);
  const Eigen::Matrix<double, 9, 1> s = moduli * h;
  Mat3 stress;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) stress(i, j) = s[3 * i + j];
  return stress;
}

quadratic_kernel::Elasticity<double> cell_elasticity(const Lattice& lattice, const Mat9& moduli) {
  constexpr int row[6] = {0, 1, 2, 0, 1, 2}, column[6] = {0, 1, 2, 1, 2, 0};
  quadratic_kernel::Elasticity<double> made{};
  const double volume = lattice.spacing.prod();
  for (int axis = 0; axis < 3; ++axis) made.scale[axis] = 2 / lattice.spacing[axis];
  double largest = 0;
  for (int b = 0; b < 6; ++b) {
    Mat3 strain = Mat3::Zero();  // a unit of it
    strain(row[b], column[b]) += 0.5;
    strain(column[b], row[b]) += 0.5;
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> world =
        lattice.axes * strain * lattice.axes.transpose();
    const Eigen::Matrix<double, 9, 1> stress =
        moduli * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(world.data());
    const Mat3 own = lattice.axes.transpose() *
                     Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(stress.data()) *
                     lattice.axes;
    for (int a = 0; a < 6; ++a) {
      made.moduli[6 * a + b] = volume * own(row[a], column[a]);
      largest = std::max(largest, std::abs(made.moduli[6 * a + b]));
    }
  }
  const double lambda = made.moduli[1], mu = made.moduli[21];
  made.isotropic = true;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      const double wanted = a < 3 && b < 3 ? lambda + (a == b ? 2 * mu : 0) : a == b ? mu : 0;
      if (std::abs(made.moduli[6 * a + b] - wanted) > 1e-14 * largest) made.isotropic = false;
    }
  return made;
}

std::array<double, kQuadraticNodes> shape_integrals(double voxel, const Moments& moments) {
  std::array<double, kQuadraticNodes> sum{};
  for (std::size_t k = 0; k < kMoments; ++k) {
    const QuadraticShape shape = quadratic_shape(gauss_point(k));
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      sum[n] += voxel * moments[static_cast<Eigen::Index>(k)] * shape.value[n];
  }
  return sum;
}

Vec3 middle_of(const Moments& moments) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < kMoments; ++k) sum += moments[static_cast<Eigen::Index>(k)] * gauss_point(k);
  return sum / moments.sum();
}

Moments whole_cell_moments() {
  constexpr auto whole = whole_moments();
  return Moments(Eigen::Map<const Moments>(whole.data()));
}

}  // namespace flexel::simulate
