// One cell. Everything is written in H = F - I, so that strains of 1e-12 still have ten digits: J - 1 is the
// sum of the invariants of H, ln J is log1p, and the energy is a sum of terms of second order (tr H cancels
// against J - 1 analytically).
#include "simulate/models/cell_model.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace flexel::simulate {
namespace {

// Sum of the principal minors of H, its second invariant.
double second_invariant(const Mat3& h) {
  return h(0, 0) * h(1, 1) - h(0, 1) * h(1, 0) + h(1, 1) * h(2, 2) - h(1, 2) * h(2, 1) + h(2, 2) * h(0, 0) -
         h(2, 0) * h(0, 2);
}

// x - ln(1 + x), without cancellation near 0: the series to x^7 below 1e-2, where its error is under 1e-15 of
// the sum.
double less_logarithm(double x) {
  if (std::abs(x) > 1e-2) return x - std::log1p(x);
  return x * x *
         (1.0 / 2 - x * (1.0 / 3 - x * (1.0 / 4 - x * (1.0 / 5 - x * (1.0 / 6 - x * (1.0 / 7 - x / 8))))));
}

std::array<Vec3, 4> hourglass_displacements(const CellKind& kind, const CellVectors& u) {
  std::array<Vec3, 4> q;
  for (std::size_t mode = 0; mode < 4; ++mode) {
    q[mode] = -kind.mode_offset[mode];
    for (std::size_t a = 0; a < 8; ++a) q[mode] += kind.mode[mode][a] * u[a];
  }
  return q;
}

double hourglass_coefficient(const CellKind& kind, std::size_t a, std::size_t b) {
  double sum = 0;
  for (std::size_t mode = 0; mode < 4; ++mode)
    sum += kind.hourglass[mode] * kind.mode[mode][a] * kind.mode[mode][b];
  return sum;
}

void set_diagonal(CellKind& kind) {
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < 8; ++b)
      kind.diagonal[8 * a + b] = kind.mu * kind.volume / 16 * kind.gradient[a].dot(kind.gradient[b]) +
                                 hourglass_coefficient(kind, a, b);
}

}  // namespace

CellKind cell_kind(const Lattice& lattice, const Material& material) {
  CellKind kind;
  const Vec3& h = lattice.spacing;
  kind.mu = shear_modulus(material);
  kind.lambda = lame_lambda(material);
  kind.volume = h.prod();
  for (int a = 0; a < 8; ++a) {
    const Vec3 sign((a & 1) ? 1 : -1, (a & 2) ? 1 : -1, (a & 4) ? 1 : -1);
    kind.gradient[static_cast<std::size_t>(a)] = lattice.axes * sign.cwiseQuotient(h);
  }
  const Vec3 curvature = h.cwiseProduct(h).cwiseInverse();
  const double scale = kind.mu * kind.volume;
  kind.hourglass = {4.0 / 3 * scale * (curvature.x() + curvature.y()),
                    4.0 / 3 * scale * (curvature.y() + curvature.z()),
                    4.0 / 3 * scale * (curvature.z() + curvature.x()), 8.0 / 9 * scale * curvature.sum()};
  for (int mode = 0; mode < 4; ++mode)
    for (int corner = 0; corner < 8; ++corner)
      kind.mode[static_cast<std::size_t>(mode)][static_cast<std::size_t>(corner)] =
          hourglass_sign(mode, corner) / 8;
  set_diagonal(kind);
  return kind;
}

CellKind with_rest_shape(const CellKind& kind, const Mat3& change, double volume,
                         const std::array<Vec3, 4>& hourglass) {
  CellKind own = kind;
  own.volume *= volume;
  own.offset = change;
  own.mode_offset = hourglass;
  for (std::size_t m = 0; m < 4; ++m) {
    own.hourglass[m] *= volume;
    for (std::size_t a = 0; a < 8; ++a) own.mode[m][a] -= kind.gradient[a].dot(hourglass[m]) / 4;
  }
  for (Vec3& gradient : own.gradient) gradient += (change * gradient).eval();
  set_diagonal(own);
  return own;
}

Mat3 displacement_gradient(const CellKind& kind, const CellVectors& u) {
  Mat3 h = kind.offset;
  // Opposite corners share a gradient but for its sign.
  for (std::size_t a = 0; a < 4; ++a) h += (0.25 * (u[a] - u[7 - a])) * kind.gradient[a].transpose();
  return h;
}

Mat3 corner_gradient(const CellKind& kind, const CellVectors& u, std::uint32_t corner) {
  Mat3 h = Mat3::Zero();
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t other = corner ^ 1u << axis;
    const Vec3 change = corner < other ? Vec3(u[other] - u[corner]) : Vec3(u[corner] - u[other]);
    // Direction of the axis over the spacing: half the difference of the gradients along it.
    const Vec3 slope = 0.5 * (kind.gradient[1u << axis] - kind.gradient[0]);
    h += change * slope.transpose();
  }
  return h;
}

double volume_change(const Mat3& h) {
  return h.trace() + second_invariant(h) + h.determinant();
}

double energy_density(const CellKind& kind, const Mat3& h) {
  const double change = volume_change(h);
  const double log_volume = std::log1p(change);
  // tr F^T F - 3 - 2 ln J = H:H + 2 tr H - 2 ln J and tr H = change - invariants.
  const double shape = h.squaredNorm() + 2 * (less_logarithm(change) - second_invariant(h) - h.determinant());
  return 0.5 * kind.mu * shape + 0.5 * kind.lambda * log_volume * log_volume;
}

Mat3 stress(const CellKind& kind, const Mat3& h) {
  const CellTangent tangent = cell_tangent(h);
  // F - F^-T = (F F^T - I) F^-T.
  const Mat3 strain = h + h.transpose() + h * h.transpose();
  return (kind.mu * strain + kind.lambda * tangent.log_volume * Mat3::Identity()) * tangent.inverse_transpose;
}

Mat3 second_stress(const CellKind& kind, const Mat3& h) {
  return (Mat3::Identity() + h).inverse() * stress(kind, h);
}

Mat3 predicted_stress(const CellKind& kind, const Mat3& h, const Mat3& change) {
  const CellTangent tangent = cell_tangent(h);
  const Mat3 product = (Mat3::Identity() + h).transpose() * change;
  const Mat3 strain = 0.5 * (product + product.transpose());
  const Mat3 metric = tangent.inverse_transpose.transpose() * tangent.inverse_transpose;  // C^-1
  const Mat3 turned = metric * strain;
  return second_stress(kind, h) + kind.lambda * turned.trace() * metric +
         2 * (kind.mu - kind.lambda * tangent.log_volume) * turned * metric;
}

double cell_energy(const CellKind& kind, const CellVectors& u) {
  const Mat3 h = displacement_gradient(kind, u);
  if (!(volume_change(h) > -1)) return std::numeric_limits<double>::infinity();
  double energy = kind.volume * energy_density(kind, h);
  const std::array<Vec3, 4> q = hourglass_displacements(kind, u);
  for (std::size_t mode = 0; mode < 4; ++mode) energy += 0.5 * kind.hourglass[mode] * q[mode].squaredNorm();
  return energy;
}

CellVectors cell_forces(const CellKind& kind, const CellVectors& u) {
  const Mat3 first_piola = (0.25 * kind.volume) * stress(kind, displacement_gradient(kind, u));
  const std::array<Vec3, 4> q = hourglass_displacements(kind, u);
  CellVectors forces;
  for (std::size_t a = 0; a < 8; ++a) {
    Vec3 force = first_piola * kind.gradient[a];
    for (std::size_t m = 0; m < 4; ++m) force += (kind.hourglass[m] * kind.mode[m][a]) * q[m];
    forces[a] = -force;
  }
  return forces;
}

CellTangent cell_tangent(const Mat3& h) {
  return {(Mat3::Identity() + h).inverse().transpose(), std::log1p(volume_change(h))};
}

Block tangent_block(const CellKind& kind, const CellTangent& tangent, std::size_t a, std::size_t b) {
  const Vec3 w_a = tangent.inverse_transpose * kind.gradient[a];
  const Vec3 w_b = tangent.inverse_transpose * kind.gradient[b];
  const double scale = kind.volume / 16;
  Block block = (scale * (kind.mu - kind.lambda * tangent.log_volume)) * w_b * w_a.transpose();
  block += (scale * kind.lambda) * w_a * w_b.transpose();
  block.diagonal().array() += kind.diagonal[8 * a + b];
  return block;
}

Mat9 elasticity(const CellKind& kind, const CellTangent& tangent) {
  const Mat3& g = tangent.inverse_transpose;
  const double geometric = kind.mu - kind.lambda * tangent.log_volume;
  Mat9 result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          result(3 * i + j, 3 * k + l) = (i == k && j == l ? kind.mu : 0) + geometric * g(i, l) * g(k, j) +
                                         kind.lambda * g(i, j) * g(k, l);
  return result;
}

Mat9 projected_elasticity(const CellKind& kind, const CellTangent& tangent) {
  const Eigen::SelfAdjointEigenSolver<Mat9> solver(elasticity(kind, tangent));
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0).asDiagonal() *
         solver.eigenvectors().transpose();
}

Block projected_block(const CellKind& kind, const Mat9& moduli, std::size_t a, std::size_t b) {
  const Vec3& gradient_a = kind.gradient[a];
  const Vec3& gradient_b = kind.gradient[b];
  Block block;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      block(i, k) = kind.volume / 16 * gradient_a.dot(moduli.block<3, 3>(3 * i, 3 * k) * gradient_b);
  block.diagonal().array() += hourglass_coefficient(kind, a, b);
  return block;
}

}  // namespace flexel::simulate
