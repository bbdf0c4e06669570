// The energy is a sum of terms of second order (tr H cancels against J - 1 analytically), ln J is log1p.
#include "simulate/laws/neo_hooke_scalar.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math/eigenvalues.h"

namespace flexel::simulate {
namespace {

// x - ln(1 + x), without cancellation near 0: the series to x^7 below 1e-2, where its error is under 1e-15 of
// the sum.
double less_logarithm(double x) {
  if (std::abs(x) > 1e-2) return x - std::log1p(x);
  return x * x *
         (1.0 / 2 - x * (1.0 / 3 - x * (1.0 / 4 - x * (1.0 / 5 - x * (1.0 / 6 - x * (1.0 / 7 - x / 8))))));
}

}  // namespace

namespace neo_hooke {

double energy_density(const Law& law, const Mat3& h) {
  const double change = volume_change(h);
  const double log_volume = std::log1p(change);
  // tr F^T F - 3 - 2 ln J = H:H + 2 tr H - 2 ln J and tr H = change - invariants.
  const double shape = h.squaredNorm() + 2 * (less_logarithm(change) - second_invariant(h) - h.determinant());
  return 0.5 * law.mu * shape + 0.5 * law.lambda * log_volume * log_volume;
}

Mat3 first_stress(const Law& law, const Mat3& h) {
  const Tangent at = tangent(h);
  // F - F^-T = (F F^T - I) F^-T.
  const Mat3 strain = h + h.transpose() + h * h.transpose();
  return (law.mu * strain + law.lambda * at.log_volume * Mat3::Identity()) * at.inverse_transpose;
}

// sigma = (mu (b - I) + lambda ln J I) / J, b = F F^T.
Mat3 cauchy_stress(const Law& law, const Mat3& h) {
  const double change = volume_change(h);
  const Mat3 strain = h + h.transpose() + h * h.transpose();
  return (law.mu * strain + law.lambda * std::log1p(change) * Mat3::Identity()) / (1 + change);
}

Tangent tangent(const Mat3& h) {
  return {(Mat3::Identity() + h).inverse().transpose(), std::log1p(volume_change(h))};
}

Mat9 elasticity(const Law& law, const Tangent& tangent) {
  const Mat3& g = tangent.inverse_transpose;
  const double geometric = law.mu - law.lambda * tangent.log_volume;
  Mat9 result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          result(3 * i + j, 3 * k + l) = (i == k && j == l ? law.mu : 0) + geometric * g(i, l) * g(k, j) +
                                         law.lambda * g(i, j) * g(k, l);
  return result;
}

Mat3 predicted_stress(const Law& law, const Mat3& h, const Mat3& second, const Mat3& change) {
  const Tangent at = tangent(h);
  const Mat3 product = (Mat3::Identity() + h).transpose() * change;
  const Mat3 strain = 0.5 * (product + product.transpose());
  const Mat3 metric = at.inverse_transpose.transpose() * at.inverse_transpose;  // C^-1
  const Mat3 turned = metric * strain;
  return second + law.lambda * turned.trace() * metric +
         2 * (law.mu - law.lambda * at.log_volume) * turned * metric;
}

// d2W/dF2 has, with s the singular values of F, entries of at most mu + (mu + lambda (1 - ln J)) / s_min^2, or, of
// swollen matter, mu + (lambda ln J - mu) / s_min^2; at rest 2 mu + lambda. A negative lambda counts with ln J alone.
// With plastic flow mu is that of b = F Cp^-1 F^T: at most 1 / s_min^2 where the flow follows F. With a rest
// shape mu is times the largest eigenvalue of Cp^-1, ln J less ln Jp, and all times Jp.
double stiffening(const Law& law, const Mat3& h, const Flow& flow) {
  const double jacobian = 1 + volume_change(h);
  if (!(jacobian > 0)) return std::numeric_limits<double>::infinity();
  const Mat3 f = Mat3::Identity() + h;
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(f.transpose() * f, Eigen::EigenvaluesOnly);
  const double least = std::max(eigen.eigenvalues()[0], 1e-12);
  const double log_volume = std::log(jacobian / flow.volume);
  const double swelling = std::max(law.lambda, 0.0);        // below 0 the stiffest is a shear
  const double turning = law.mu - law.lambda * log_volume;  // below 0: stiffest against spin
  const double own = std::max(flow.follows ? law.mu / std::min(least, 1.0) : law.mu, law.mu * flow.metric);
  const auto growth = [&](double swell) {
    return (own + std::max(turning + swell, -turning) / least) / (2 * law.mu + swell);
  };
  return flow.volume * std::max(growth(swelling), growth(3 * swelling));  // along one axis, along all
}

}  // namespace neo_hooke
}  // namespace flexel::simulate
