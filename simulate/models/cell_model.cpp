// One cell. Everything is written in H = F - I, so that strains of 1e-12 still have ten digits.
#include "simulate/models/cell_model.h"

#include <cmath>
#include <limits>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"

namespace flexel::simulate {
namespace {

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

// Young's moduli of plane stress along axes k and l: E'_k, E'_kl, E'_l. `s`: compliance.
Vec3 plane_moduli(const Mat6& s, int k, int l) {
  return Vec3(s(l, l), -s(k, l), s(k, k)) / (s(k, k) * s(l, l) - s(k, l) * s(k, l));
}

// 2 mu of other directions than those of an isotropic law: Young's modulus along j without contraction.
double modulus_along(const Mat6& s, int j) {
  const double contraction = 0.5 * (s(j, (j + 1) % 3) + s(j, (j + 2) % 3));
  return 1 / std::max(s(j, j) - contraction, 0.5 * s(j, j));
}

// K and the c_m together. Mode m has the axes m, m + 1 and twists along m + 2.
Mat9 twisting_and_bending(const Mat6& s, const Vec3& h) {
  Mat9 k = Mat9::Zero();
  const double scale = 4.0 / 3 * h.prod();
  const auto at = [](int mode, int component) { return 3 * mode + component; };
  const auto add = [&](int row, int column, double value) {
    k(row, column) += scale * value;
    if (row != column) k(column, row) += scale * value;
  };
  for (int i = 0; i < 3; ++i) {  // the shear of axes i and j, linear along l
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    const double shear = 1 / s(3 + i, 3 + i);
    const int one = at(j, i), other = at(l, j);  // modes jl and li
    add(one, one, shear / (h[j] * h[j]));
    add(one, other, shear / (h[j] * h[i]));
    add(other, other, shear / (h[i] * h[i]));
  }
  for (int j = 0; j < 3; ++j) {
    const int a = (j + 1) % 3, b = (j + 2) % 3;
    const Vec3 moduli = plane_moduli(s, a, b);
    const int one = at(j, a), other = at(b, b);  // modes ja and bj
    add(one, one, moduli[0] / (h[a] * h[a]));
    add(one, other, moduli[1] / (h[a] * h[b]));
    add(other, other, moduli[2] / (h[b] * h[b]));
  }
  return k;
}

// `law`: in the lattice's axes.
void set_hourglass(CellKind& kind, const Law& law, const Vec3& h) {
  const Mat6 compliance = inverse_6(moduli_at_rest(law));
  const Vec3 curvature = h.cwiseProduct(h).cwiseInverse();
  kind.by_mode = twisting_and_bending(compliance, h);
  Eigen::Matrix<double, 9, 1> root;  // of c_m / theta
  for (int m = 0; m < 3; ++m)
    root.segment<3>(3 * m).setConstant(
        std::sqrt(4.0 / 3 * kind.volume * (curvature[m] + curvature[(m + 1) % 3])));
  const Mat9 scaled = root.cwiseInverse().asDiagonal() * kind.by_mode * root.cwiseInverse().asDiagonal();
  const double theta = Eigen::SelfAdjointEigenSolver<Mat9>(scaled, Eigen::EigenvaluesOnly).eigenvalues()[0];
  for (std::size_t m = 0; m < 3; ++m) {
    const auto first = static_cast<Eigen::Index>(3 * m);
    kind.hourglass[m] = theta * root[first] * root[first];
    kind.by_mode.diagonal().segment<3>(first).array() -= kind.hourglass[m];
  }
  kind.by_mode_largest =
      Eigen::SelfAdjointEigenSolver<Mat9>(kind.by_mode, Eigen::EigenvaluesOnly).eigenvalues()[8];
  kind.hourglass[3] = 0;
  for (int j = 0; j < 3; ++j)
    kind.hourglass[3] += 4.0 / 27 * kind.volume * modulus_along(compliance, j) * curvature[j];
}

CellKind kind_of(const Lattice& lattice, const Mat3& axes, const Law& law, const Law& in_lattice) {
  CellKind kind;
  const Vec3& h = lattice.spacing;
  kind.law = law;
  kind.mu = law.mu;
  kind.lambda = law.lambda;
  kind.volume = h.prod();
  for (int a = 0; a < 8; ++a) {
    const Vec3 sign((a & 1) ? 1 : -1, (a & 2) ? 1 : -1, (a & 4) ? 1 : -1);
    kind.gradient[static_cast<std::size_t>(a)] = axes * sign.cwiseQuotient(h);
  }
  kind.to_lattice = axes.transpose();
  set_hourglass(kind, in_lattice, h);
  for (int mode = 0; mode < 4; ++mode)
    for (int corner = 0; corner < 8; ++corner)
      kind.mode[static_cast<std::size_t>(mode)][static_cast<std::size_t>(corner)] =
          hourglass_sign(mode, corner) / 8;
  set_diagonal(kind);
  return kind;
}

}  // namespace

CellKind cell_kind(const Lattice& lattice, const Material& material) {
  const Law law = law_of(material);
  return kind_of(lattice, lattice.axes, law,
                 law.name == LawName::orthotropic ? law_of(material, lattice.axes) : law);
}

CellKind cell_kind_in_lattice(const Lattice& lattice, const Material& material) {
  const Law law = law_of(material, lattice.axes);
  return kind_of(lattice, Mat3::Identity(), law, law);
}

CellKind with_rest_shape(const CellKind& kind, const Mat3& change, double volume,
                         const std::array<Vec3, 4>& hourglass) {
  CellKind own = kind;
  own.volume *= volume;
  own.offset = change;
  own.mode_offset = hourglass;
  own.by_mode *= volume;
  own.by_mode_largest *= volume;
  own.to_lattice += kind.to_lattice * change;
  for (std::size_t m = 0; m < 4; ++m) {
    own.hourglass[m] *= volume;
    for (std::size_t a = 0; a < 8; ++a) own.mode[m][a] -= kind.gradient[a].dot(hourglass[m]) / 4;
  }
  for (Vec3& gradient : own.gradient) gradient += (change * gradient).eval();
  set_diagonal(own);
  return own;
}

std::array<Vec3, 4> hourglass_displacements(const CellKind& kind, const CellVectors& u) {
  std::array<Vec3, 4> q;
  for (std::size_t mode = 0; mode < 4; ++mode) {
    q[mode] = -kind.mode_offset[mode];
    for (std::size_t a = 0; a < 8; ++a) q[mode] += kind.mode[mode][a] * u[a];
  }
  return q;
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

double energy_density(const CellKind& kind, const Mat3& h) {
  return energy_density(kind.law, h);
}

Mat3 stress(const CellKind& kind, const Mat3& h) {
  return first_stress(kind.law, h);
}

Mat3 second_stress(const CellKind& kind, const Mat3& h) {
  return (Mat3::Identity() + h).inverse() * stress(kind, h);
}

Mat3 predicted_stress(const CellKind& kind, const Mat3& h, const Mat3& change) {
  const Mat3 second = second_stress(kind, h);
  if (kind.law.name == LawName::neo_hooke) return neo_hooke::predicted_stress(kind.law, h, second, change);
  // P = F S: F dS = dP - dF S.
  const Mat9 moduli = elasticity(kind, h);
  Mat3 first;
  for (int row = 0; row < 9; ++row) {
    first(row / 3, row % 3) = 0;
    for (int column = 0; column < 9; ++column)
      first(row / 3, row % 3) += moduli(row, column) * change(column / 3, column % 3);
  }
  return second + (Mat3::Identity() + h).inverse() * (first - change * second);
}

HourglassForces hourglass_forces(const CellKind& kind, const Mat3& h, const std::array<Vec3, 4>& q) {
  HourglassForces made;
  const Mat3 inverse = (Mat3::Identity() + h).inverse();
  made.pull = kind.to_lattice * inverse;
  made.inverse_transpose = inverse.transpose();
  Eigen::Matrix<double, 9, 1> p;
  for (int m = 0; m < 3; ++m) {
    const Vec3& each = q[static_cast<std::size_t>(m)];
    made.arm[static_cast<std::size_t>(m)] = inverse * each;
    p.segment<3>(3 * m) = made.pull * each;
  }
  const Eigen::Matrix<double, 9, 1> s = (1 + volume_change(h)) * (kind.by_mode * p);
  for (int m = 0; m < 3; ++m)
    made.force[static_cast<std::size_t>(m)] = made.pull.transpose() * s.segment<3>(3 * m);
  made.energy = 0.5 * p.dot(s);
  return made;
}

double cell_energy(const CellKind& kind, const CellVectors& u) {
  const Mat3 h = displacement_gradient(kind, u);
  if (!(volume_change(h) > -1)) return std::numeric_limits<double>::infinity();
  double energy = kind.volume * energy_density(kind, h);
  const std::array<Vec3, 4> q = hourglass_displacements(kind, u);
  for (std::size_t mode = 0; mode < 4; ++mode) energy += 0.5 * kind.hourglass[mode] * q[mode].squaredNorm();
  return energy + hourglass_forces(kind, h, q).energy;
}

CellVectors cell_forces(const CellKind& kind, const CellVectors& u) {
  const Mat3 h = displacement_gradient(kind, u);
  const Mat3 first_piola = (0.25 * kind.volume) * stress(kind, h);
  const std::array<Vec3, 4> q = hourglass_displacements(kind, u);
  const HourglassForces by_mode = hourglass_forces(kind, h, q);
  CellVectors forces;
  const Mat3 mean = first_piola + (0.25 * by_mode.energy) * by_mode.inverse_transpose;
  for (std::size_t a = 0; a < 8; ++a) {
    Vec3 force = mean * kind.gradient[a];
    for (std::size_t m = 0; m < 4; ++m) force += (kind.hourglass[m] * kind.mode[m][a]) * q[m];
    for (std::size_t m = 0; m < 3; ++m) force += carried_mode(kind, by_mode.arm[m], m, a) * by_mode.force[m];
    forces[a] = -force;
  }
  return forces;
}

CellTangent cell_tangent(const Mat3& h) {
  return neo_hooke::tangent(h);
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

Mat9 elasticity(const CellKind& kind, const Mat3& gradient) {
  return elasticity(kind.law, gradient);
}

Mat9 elasticity(const CellKind& kind, const CellTangent& tangent) {
  return neo_hooke::elasticity(kind.law, tangent);
}

Mat9 positive_part(const Mat9& moduli) {
  const Eigen::SelfAdjointEigenSolver<Mat9> solver(moduli);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0).asDiagonal() *
         solver.eigenvectors().transpose();
}

Mat9 projected_elasticity(const CellKind& kind, const CellTangent& tangent) {
  return positive_part(elasticity(kind, tangent));
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
