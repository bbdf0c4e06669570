// The elastic laws: every derivative against differences, objectivity, small strains, and what each is called for.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"
#include "simulate/input/materials.h"
#include "simulate/laws/elasticity.h"
#include "simulate/models/cell_model.h"
#include "tests/simulate/law_materials.h"

namespace flexel::simulate {
namespace {

using testing::arruda_boyce_material;
using testing::mooney_rivlin_material;
using testing::orthotropic_material;

std::vector<Law> laws_to_test() {
  return {neo_hooke_law(0.8e6, 2e6), law_of(mooney_rivlin_material()), law_of(arruda_boyce_material()),
          law_of(orthotropic_material())};
}

Mat3 random_gradient(std::mt19937& engine, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  return Mat3::NullaryExpr([&] { return uniform(engine); });
}

TEST(Laws, StressIsTheEnergysDerivativeAndTheTangentTheStresss) {
  std::mt19937 engine(3);
  for (const Law& law : laws_to_test())
    for (int round = 0; round < 20; ++round) {
      const Mat3 h = random_gradient(engine, 0.2);
      const Mat3 p = first_stress(law, h);
      const Mat9 tangent = elasticity(law, h);
      for (int k = 0; k < 9; ++k) {
        constexpr double step = 1e-6;
        Mat3 up = h, down = h;
        up(k / 3, k % 3) += step;
        down(k / 3, k % 3) -= step;
        const double slope = (energy_density(law, up) - energy_density(law, down)) / (2 * step);
        EXPECT_NEAR(p(k / 3, k % 3), slope, 1e-6 * p.norm()) << law_name(law.name);
        const Mat3 change = (first_stress(law, up) - first_stress(law, down)) / (2 * step);
        for (int row = 0; row < 9; ++row)
          EXPECT_NEAR(tangent(row, k), change(row / 3, row % 3), 1e-7 * tangent.norm()) << law_name(law.name);
      }
    }
}

TEST(Laws, RotationChangesNothing) {
  std::mt19937 engine(5);
  const Mat3 turn = Eigen::AngleAxisd(1.9, Vec3(2, -1, 1).normalized()).toRotationMatrix();
  for (const Law& law : laws_to_test()) {
    const Mat3 h = random_gradient(engine, 0.2), turned = turn * (Mat3::Identity() + h) - Mat3::Identity();
    EXPECT_NEAR(energy_density(law, turned) / energy_density(law, h), 1, 1e-12);
    EXPECT_LT((first_stress(law, turned) - turn * first_stress(law, h)).norm(),
              1e-12 * first_stress(law, h).norm());
    EXPECT_NEAR(stiffening(law, turned), stiffening(law, h), 1e-10);
    EXPECT_NEAR(stiffening(law, Mat3::Zero()), 1, 1e-12);
  }
}

// The bound on the step takes it for how much faster waves run in a strained state; materials that grow thick when drawn
// (nu < 0, lambda < 0) too.
TEST(Laws, StiffeningBoundsTheTangent) {
  std::mt19937 engine(4);
  const auto largest = [](const Law& law, const Mat3& h) {
    return Eigen::SelfAdjointEigenSolver<Mat9>(elasticity(law, h), Eigen::EigenvaluesOnly).eigenvalues()[8];
  };
  std::vector<Law> laws = laws_to_test();
  for (const double poisson : {-0.4, -0.2, 0.0, 0.49})
    laws.push_back(neo_hooke_law(0.8e6, 2 * 0.8e6 * poisson / (1 - 2 * poisson)));
  for (const Law& law : laws)
    for (const double size : {0.05, 0.2, 0.4})
      for (int round = 0; round < 30; ++round) {
        const Mat3 h = random_gradient(engine, size);
        if (!(volume_change(h) > -0.9) || !(chain_reserve(law, h) > 0)) continue;
        EXPECT_LE(largest(law, h), (1 + 1e-9) * stiffening(law, h) * largest(law, Mat3::Zero()));
      }
}

TEST(Laws, SmallStrainsKeepTheirDigits) {
  std::mt19937 engine(7);
  for (const Law& law : laws_to_test()) {
    const Mat3 h = random_gradient(engine, 1);
    const double coarse = energy_density(law, 1e-8 * h) / 1e-16,
                 fine = energy_density(law, 1e-12 * h) / 1e-24;
    EXPECT_NEAR(fine / coarse, 1, 1e-6) << law_name(law.name);
    EXPECT_LT((first_stress(law, 1e-12 * h) / 1e-12 - first_stress(law, 1e-8 * h) / 1e-8).norm(),
              1e-6 * first_stress(law, 1e-8 * h).norm() / 1e-8);
  }
}

// With C01 = 0, and with isotropic constants, the moduli at rest are those of neo-Hooke.
TEST(Laws, IsotropicLimits) {
  const double mu = 0.8e6, lambda = 2e6, bulk = lambda + 2.0 / 3 * mu;
  const Law neo = neo_hooke_law(mu, lambda);
  Material even;
  even.law = LawName::orthotropic;
  even.young = mu * (3 * lambda + 2 * mu) / (lambda + mu);
  even.poisson = lambda / (2 * (lambda + mu));
  even.youngs.setConstant(even.young);
  even.poissons.setConstant(even.poisson);
  even.shears.setConstant(mu);
  even.axes = orthotropic_material().axes;
  const Mat9 expected = elasticity(neo, Mat3::Zero());
  const double links = 4, slope = 2 / (1 - 1 / links) + 1 - 0.2 / links - 0.4 / (links * links);
  for (const Law& law : {mooney_rivlin_law(mu / 2, 0, bulk), law_of(even),
                         arruda_boyce_law(3 * mu / slope, std::sqrt(links), bulk)}) {
    EXPECT_LT((elasticity(law, Mat3::Zero()) - expected).norm(), 1e-10 * expected.norm());
    EXPECT_NEAR(law.mu / mu, 1, 1e-12);
    EXPECT_NEAR(law.lambda / lambda, 1, 1e-12);
  }
  Material plain{"even", even.young, even.poisson, 1000, ""};
  Lattice lattice;
  lattice.spacing = Vec3(0.1, 0.115, 0.093);
  const CellKind one = cell_kind(lattice, even), other = cell_kind(lattice, plain);
  for (std::size_t m = 0; m < 4; ++m) EXPECT_NEAR(one.hourglass[m] / other.hourglass[m], 1, 1e-10);
  EXPECT_LT((one.by_mode - other.by_mode).norm(), 1e-10 * other.by_mode.norm());
}

// Young's moduli along the material's axes, and turned by 30 degrees in the plane (Lekhnitskii 1963):
// 1/E = c^4/E1 + (1/G12 - 2 nu12/E1) c^2 s^2 + s^4/E2.
TEST(Laws, TurnedComplianceIsLekhnitskiis) {
  Material material = orthotropic_material();
  const double angle = std::numbers::pi / 6, c = std::cos(angle), s = std::sin(angle);
  material.axes = Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix();
  const Mat6 turned = inverse_6(moduli_at_rest(law_of(material)));
  const double expected =
      std::pow(c, 4) / material.youngs[0] + std::pow(s, 4) / material.youngs[1] +
      (1 / material.shears[0] - 2 * material.poissons[0] / material.youngs[0]) * c * c * s * s;
  EXPECT_NEAR(turned(0, 0) / expected, 1, 1e-12);
  EXPECT_NEAR(inverse_6(moduli_at_rest(law_of(material, material.axes)))(0, 0) * material.youngs[0], 1,
              1e-12);
}

// Incompressible in the limit: sigma = 2 (l^2 - 1/l) (C10 + C01 / l) (Rivlin 1948).
TEST(Laws, MooneyRivlinUnderUniaxialStress) {
  const Law law = mooney_rivlin_law(0.3e6, 0.1e6, 1e11);
  for (const double stretch : {0.6, 1.3, 2.0, 3.0}) {
    // across: the stretch at which the stress across is 0, by bisection
    double low = 0.9 / std::sqrt(stretch), high = 1.1 / std::sqrt(stretch);
    const auto at = [&](double across) {
      Mat3 h = Mat3::Zero();
      h.diagonal() = Vec3(stretch - 1, across - 1, across - 1);
      return cauchy_stress(law, h);
    };
    for (int i = 0; i < 200; ++i) (at(0.5 * (low + high))(1, 1) > 0 ? high : low) = 0.5 * (low + high);
    const double expected = 2 * (stretch * stretch - 1 / stretch) * (0.3e6 + 0.1e6 / stretch);
    EXPECT_NEAR(at(0.5 * (low + high))(0, 0) / expected, 1, 1e-4) << stretch;
  }
}

// J = 1, drawn along x: what Cauchy's stress differs in along and across.
double drawn_difference(const Law& law, double stretch) {
  Mat3 h = Mat3::Zero();
  h.diagonal() = Vec3(stretch, 1 / std::sqrt(stretch), 1 / std::sqrt(stretch)) - Vec3::Ones();
  const Mat3 stress = cauchy_stress(law, h);
  return stress(0, 0) - stress(1, 1);
}

// coth x - 1/x
double langevin(double x) {
  return x < 1e-4 ? x / 3 : 1 / std::tanh(x) - 1 / x;
}

// sigma = mu/3 sqrt N / lambda_chain L^-1(lambda_chain / sqrt N) (l^2 - 1/l), lambda_chain^2 = (l^2 + 2/l) / 3 (Arruda and Boyce
// 1993, equation 15), L^-1 by bisection, up to 99.9 % of the chains' length.
TEST(Laws, ArrudaBoyceIsThatOfLangevin) {
  const double mu = 0.27e6, lambda_m = 5.148;
  const Law law = arruda_boyce_law(mu, lambda_m, 1e9);
  double longest = 0;
  for (const double stretch : {0.05, 0.3, 0.9, 1.001, 1.5, 3.0, 5.0, 7.0, 8.0, 8.8, 8.9}) {
    const double chain = std::sqrt((stretch * stretch + 2 / stretch) / 3), share = chain / lambda_m;
    ASSERT_LT(share, 1) << stretch;
    longest = std::max(longest, share);
    double low = 0, high = 1e6;
    for (int i = 0; i < 200; ++i) (langevin(0.5 * (low + high)) < share ? low : high) = 0.5 * (low + high);
    const double expected = mu / 3 * low / share * (stretch * stretch - 1 / stretch);
    EXPECT_NEAR(drawn_difference(law, stretch) / expected, 1, 0.003) << stretch;
  }
  EXPECT_GT(longest, 0.995);
}

// Long chains: neo-Hooke's with the same shear modulus, to order 1 / lambda_m^2.
TEST(Laws, ArrudaBoyceOfLongChainsIsNeoHooke) {
  double before = 1;
  for (const double lambda_m : {20.0, 40.0, 80.0}) {
    const Law law = arruda_boyce_law(0.3e6, lambda_m, 1e8), plain = mooney_rivlin_law(law.mu / 2, 0, 1e8);
    const double off = std::abs(drawn_difference(law, 3) / drawn_difference(plain, 3) - 1);
    EXPECT_LT(off, 10 / (lambda_m * lambda_m));
    EXPECT_LT(off, before / 3.5);
    before = off;
  }
}

// At the end of the chains energy, stress and the speed of waves grow without bound, and beyond it nothing is not a number.
TEST(Laws, ChainsEnd) {
  const Law law = law_of(arruda_boyce_material());
  const auto drawn = [](double stretch) {
    Mat3 h = Mat3::Zero();
    h.diagonal() = Vec3(stretch, 1 / std::sqrt(stretch), 1 / std::sqrt(stretch)) - Vec3::Ones();
    return h;
  };
  double low = 1, high = 10;  // where they end: l^2 + 2/l = 3 lambda_m^2
  for (int i = 0; i < 200; ++i)
    (chain_reserve(law, drawn(0.5 * (low + high))) > 0 ? low : high) = 0.5 * (low + high);
  EXPECT_NEAR(low * low + 2 / low, 12, 1e-9);
  double energy = 0, stress = 0, speed = 0;
  for (const double short_of : {1e-1, 1e-2, 1e-3, 1e-4}) {
    const Mat3 h = drawn(low * (1 - short_of));
    EXPECT_GT(energy_density(law, h), energy);
    EXPECT_GT(first_stress(law, h)(0, 0), 5 * stress);
    EXPECT_GT(stiffening(law, h), 20 * speed);
    energy = energy_density(law, h);
    stress = first_stress(law, h)(0, 0);
    speed = stiffening(law, h);
  }
  for (const double beyond : {1 + 1e-9, 1.5, 10.0}) {
    const Mat3 h = drawn(beyond * low);
    EXPECT_EQ(energy_density(law, h), std::numeric_limits<double>::infinity());
    EXPECT_EQ(stiffening(law, h), std::numeric_limits<double>::infinity());
    EXPECT_TRUE(first_stress(law, h).allFinite());
    EXPECT_TRUE(elasticity(law, h).allFinite());
  }
}

}  // namespace
}  // namespace flexel::simulate
