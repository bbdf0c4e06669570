// The laws but neo-Hooke's are written once, over a number type; here with double.
#include "simulate/laws/elasticity.h"

#include <limits>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"
#include "simulate/laws/arruda_boyce.h"
#include "simulate/laws/mooney_rivlin.h"
#include "simulate/laws/neo_hooke_scalar.h"
#include "simulate/laws/orthotropic.h"

namespace flexel::simulate {
namespace {

using laws::ArrudaBoyce;
using laws::Matrix;
using laws::MooneyRivlin;
using laws::Orthotropic;

Matrix<double> plain(const Mat3& m) {
  Matrix<double> result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result.at[i][j] = m(i, j);
  return result;
}

Mat3 matrix_of(const Matrix<double>& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result(i, j) = m.at[i][j];
  return result;
}

// dP/dF from the nine changes of F.
template <class Change>
Mat9 tangent_of(const Change& change) {
  Mat9 result;
  for (int column = 0; column < 9; ++column) {
    Matrix<double> d{};
    d.at[column / 3][column % 3] = 1;
    const Matrix<double> p = change(d);
    for (int row = 0; row < 9; ++row) result(row, column) = p.at[row / 3][row % 3];
  }
  return 0.5 * (result + result.transpose());
}

double largest_eigenvalue(const Mat9& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Mat9>(symmetric, Eigen::EigenvaluesOnly).eigenvalues()[8];
}

constexpr int kAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

// C in another frame: column by column, from unit strains.
Mat6 turned(const Mat6& moduli, const Mat3& axes) {
  Mat6 result;
  for (int column = 0; column < 6; ++column) {
    const auto [i, j] = kAxes[column];
    Mat3 strain = Mat3::Zero();
    strain(i, j) += 0.5;
    strain(j, i) += 0.5;
    const Mat3 own = axes.transpose() * strain * axes;
    Eigen::Matrix<double, 6, 1> listed;
    for (int k = 0; k < 6; ++k) listed[k] = (k < 3 ? 1 : 2) * own(kAxes[k][0], kAxes[k][1]);
    const Eigen::Matrix<double, 6, 1> stress = moduli * listed;
    Mat3 s;
    for (int k = 0; k < 6; ++k) s(kAxes[k][0], kAxes[k][1]) = s(kAxes[k][1], kAxes[k][0]) = stress[k];
    const Mat3 back = axes * s * axes.transpose();
    for (int k = 0; k < 6; ++k) result(k, column) = back(kAxes[k][0], kAxes[k][1]);
  }
  return 0.5 * (result + result.transpose());
}

}  // namespace

double energy_density(const Law& law, const Mat3& h) {
  switch (law.name) {
    case LawName::neo_hooke:
      return neo_hooke::energy_density(law, h);
    case LawName::mooney_rivlin:
      return MooneyRivlin::energy(law, plain(h));
    case LawName::arruda_boyce:
      return ArrudaBoyce::energy(law, plain(h));
    case LawName::orthotropic:
      return Orthotropic::energy(law, plain(h));
  }
  return 0;
}

Mat3 first_stress(const Law& law, const Mat3& h) {
  switch (law.name) {
    case LawName::neo_hooke:
      return neo_hooke::first_stress(law, h);
    case LawName::mooney_rivlin:
      return matrix_of(MooneyRivlin::stress(law, laws::kinematics(plain(h))));
    case LawName::arruda_boyce:
      return matrix_of(ArrudaBoyce::stress(law, laws::kinematics(plain(h))));
    case LawName::orthotropic:
      return matrix_of(Orthotropic::stress(law, laws::kinematics(plain(h))));
  }
  return Mat3::Zero();
}

Mat3 cauchy_stress(const Law& law, const Mat3& h) {
  if (law.name == LawName::neo_hooke) return neo_hooke::cauchy_stress(law, h);
  return first_stress(law, h) * (Mat3::Identity() + h).transpose() / (1 + volume_change(h));
}

Mat9 elasticity(const Law& law, const Mat3& h) {
  const Matrix<double> at = plain(h);
  switch (law.name) {
    case LawName::neo_hooke:
      return neo_hooke::elasticity(law, neo_hooke::tangent(h));
    case LawName::mooney_rivlin:
      return tangent_of([&](const Matrix<double>& d) { return MooneyRivlin::stress_change(law, at, d); });
    case LawName::arruda_boyce:
      return tangent_of([&](const Matrix<double>& d) { return ArrudaBoyce::stress_change(law, at, d); });
    case LawName::orthotropic:
      return tangent_of([&](const Matrix<double>& d) { return Orthotropic::stress_change(law, at, d); });
  }
  return Mat9::Zero();
}

double stiffening(const Law& law, const Mat3& h) {
  if (law.name == LawName::neo_hooke) return neo_hooke::stiffening(law, h);
  if (!(1 + volume_change(h) > 0) || !(chain_reserve(law, h) > 0))
    return std::numeric_limits<double>::infinity();
  return largest_eigenvalue(elasticity(law, h)) / law.stiffest;
}

double chain_reserve(const Law& law, const Mat3& h) {
  return law.name == LawName::arruda_boyce ? ArrudaBoyce::reserve(law, laws::kinematics(plain(h))) : 1;
}

Mat6 moduli_at_rest(const Law& law) {
  Mat6 moduli = Mat6::Zero();
  if (law.name == LawName::orthotropic) {
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) moduli(i, j) = law.moduli[i][j];
    return moduli;
  }
  moduli.topLeftCorner<3, 3>().setConstant(law.lambda);
  moduli.diagonal().head<3>().array() += 2 * law.mu;
  moduli.diagonal().tail<3>().setConstant(law.mu);
  return moduli;
}

Law neo_hooke_law(double mu, double lambda) {
  Law law;
  law.mu = mu;
  law.lambda = lambda;
  return law;
}

Law mooney_rivlin_law(double c10, double c01, double bulk) {
  Law law;
  law.name = LawName::mooney_rivlin;
  law.c10 = c10;
  law.c01 = c01;
  law.bulk = bulk;
  law.mu = 2 * (c10 + c01);
  law.lambda = bulk - 2.0 / 3 * law.mu;
  law.stiffest = largest_eigenvalue(elasticity(law, Mat3::Zero()));
  return law;
}

Law arruda_boyce_law(double mu, double lambda_m, double bulk) {
  Law law;
  law.name = LawName::arruda_boyce;
  law.chains = mu;
  law.links = lambda_m * lambda_m;
  law.bulk = bulk;
  law.mu = mu / 3 * ArrudaBoyce::slope_of(1 - 1 / law.links);
  law.lambda = bulk - 2.0 / 3 * law.mu;
  law.stiffest = largest_eigenvalue(elasticity(law, Mat3::Zero()));
  return law;
}

Law orthotropic_law(const Mat6& compliance, const Mat3& axes) {
  Law law;
  law.name = LawName::orthotropic;
  const Mat6 own = inverse_6(compliance), moduli = turned(own, axes);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) law.moduli[i][j] = moduli(i, j);
  // Voigt's averages (Hill 1952)
  const double straight = own(0, 0) + own(1, 1) + own(2, 2), crossed = own(0, 1) + own(0, 2) + own(1, 2);
  law.mu = (straight - crossed + 3 * (own(3, 3) + own(4, 4) + own(5, 5))) / 15;
  law.lambda = (straight + 2 * crossed) / 9 - 2.0 / 3 * law.mu;
  law.stiffest = largest_eigenvalue(elasticity(law, Mat3::Zero()));
  return law;
}

}  // namespace flexel::simulate
