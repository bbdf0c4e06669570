// Many points at a time, as for supports.
#include "simulate/quadratic/cells/nitsche_bond.h"

#include <algorithm>
#include <cmath>

#include "base/math/dense.h"
#include "simulate/quadratic/cells/nitsche_support.h"

namespace flexel::simulate {
namespace {

constexpr auto kNodes = static_cast<Eigen::Index>(kQuadraticNodes);
using Mass = Eigen::Matrix<double, kQuadraticNodes, kQuadraticNodes>;
using Tractions = Eigen::Matrix<double, kQuadraticNodes, 9 * kQuadraticNodes>;

// int N_a N_b dA [m^2] and int N_a t_b dA [N/m], a of one side, b of `of`; (i, k) at (a, 9 b + 3 i + k).
void integrate(const BondSides& bond, std::size_t side, std::size_t of, Mass* mass, Tractions& traction) {
  const auto count = static_cast<Eigen::Index>(bond.pair->points[side].size());
  Eigen::MatrixXd weighted(kNodes, count), value(kNodes, count), tractions(9 * kNodes, count);
  for (Eigen::Index p = 0; p < count; ++p) {
    const auto at = static_cast<std::size_t>(p);
    const FacePoint& own = bond.pair->points[side][at];
    const QuadraticShape shape = quadratic_shape(own.at);
    const NitschePoint there = traction_point(bond.pair->points[of][at], *bond.lattice[of], *bond.moduli[of]);
    for (Eigen::Index n = 0; n < kNodes; ++n) {
      const auto node = static_cast<std::size_t>(n);
      weighted(n, p) = there.area * shape.value[node];
      value(n, p) = there.shape.value[node];
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) tractions(9 * n + 3 * i + k, p) = there.traction[node](i, k);
    }
  }
  if (mass != nullptr) mass->noalias() = weighted * value.transpose();
  traction.noalias() = weighted * tractions.transpose();
}

Mat3 block(const Tractions& traction, std::size_t a, std::size_t b) {
  Mat3 made;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      made(i, k) = traction(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(9 * b) + 3 * i + k);
  return made;
}

}  // namespace

// By the power method, with the rigid motions, which have neither energy nor tractions, made stiff.
double bearing_limit(const CellMatrix& stiffness, const std::array<Vec3, kQuadraticNodes>& rest,
                     const std::vector<const FacePoint*>& points, const Lattice& lattice,
                     const Mat9& moduli) {
  constexpr int kPowerSteps = 40;
  constexpr double kAbove = 1.1;  // of what they find
  Eigen::Matrix<double, kCellUnknowns, 6> rigid;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(3 * n);
      rigid.block<3, 1>(at, axis) = Vec3::Unit(axis);
      rigid.block<3, 1>(at, 3 + axis) = Vec3::Unit(axis).cross(rest[n] - rest[13]) / lattice.spacing.mean();
    }
  const Eigen::Matrix<double, kCellUnknowns, 6> orthonormal = orthonormal_base(rigid);
  CellMatrix held = stiffness;
  held.noalias() += stiffness.trace() / kCellUnknowns * orthonormal * orthonormal.transpose();
  held.diagonal().array() += 1e-12 * stiffness.trace();
  const CholeskyFactor factor(held);
  CellMatrix pulled = CellMatrix::Zero();
  for (const FacePoint* point : points) {
    const NitschePoint at = traction_point(*point, lattice, moduli);
    Eigen::Matrix<double, 3, kCellUnknowns> rows;
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      rows.middleCols<3>(static_cast<Eigen::Index>(3 * n)) = at.traction[n];
    pulled.noalias() += at.area * rows.transpose() * rows;
  }
  Eigen::Matrix<double, kCellUnknowns, 1> x, image;
  for (int i = 0; i < kCellUnknowns; ++i) x[i] = std::sin(1 + 2.7 * i);  // irregular
  double largest = 0;
  for (int step = 0; step < kPowerSteps; ++step) {
    image.noalias() = pulled * x;
    x = factor.solve(image);
    const double energy = x.dot(held * x);
    if (!(energy > 0)) break;
    x /= std::sqrt(energy);
    largest = x.dot(pulled * x);
  }
  return kAbove * largest;
}

void add_own_stiffness(const BondSides& bond, std::size_t side, CellMatrix& matrix) {
  Mass mass;
  Tractions traction;
  integrate(bond, side, side, &mass, traction);
  for (std::size_t a = 0; a < kQuadraticNodes; ++a)
    for (std::size_t b = 0; b < kQuadraticNodes; ++b) {
      const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
      matrix.block<3, 3>(3 * i, 3 * j) +=
          bond.penalty * mass(i, j) * Mat3::Identity() -
          bond.weight[side] * (block(traction, a, b) + block(traction, b, a).transpose());
    }
}

CellMatrix cross_stiffness(const BondSides& bond, const std::array<Mat3, 2>& rotation) {
  Mass mass;
  Tractions second, first;  // int N_a t_b of the second cell's b; int N_b t_a of the first cell's a
  integrate(bond, 0, 1, &mass, second);
  integrate(bond, 1, 0, nullptr, first);
  CellMatrix matrix;
  for (std::size_t a = 0; a < kQuadraticNodes; ++a)
    for (std::size_t b = 0; b < kQuadraticNodes; ++b) {
      const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
      matrix.block<3, 3>(3 * i, 3 * j) =
          -bond.penalty * mass(i, j) * Mat3::Identity() +
          bond.weight[1] * (rotation[1] * block(second, a, b) * rotation[1].transpose()) +
          bond.weight[0] * (rotation[0] * block(first, b, a).transpose() * rotation[0].transpose());
    }
  return matrix;
}

std::array<NodeVectors, 2> bond_forces(const BondSides& bond, const std::array<NodeVectors, 2>& u,
                                       const std::array<NodeVectors, 2>& local,
                                       const std::array<Mat3, 2>& rotation) {
  std::array<NodeVectors, 2> forces;
  for (NodeVectors& each : forces) each.fill(Vec3::Zero());
  for (std::size_t p = 0; p < bond.pair->points[0].size(); ++p) {
    std::array<NitschePoint, 2> point;
    Vec3 jump = Vec3::Zero(), traction = Vec3::Zero();  // out of the first part
    for (std::size_t side = 0; side < 2; ++side) {
      const double sign = side == 0 ? 1 : -1;
      point[side] = traction_point(bond.pair->points[side][p], *bond.lattice[side], *bond.moduli[side]);
      Vec3 moved = Vec3::Zero(), pulled = Vec3::Zero();
      for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
        moved += point[side].shape.value[n] * u[side][n];
        pulled += point[side].traction[n] * local[side][n];
      }
      jump += sign * moved;
      traction += sign * bond.weight[side] * (rotation[side] * pulled);
    }
    const Vec3 held = bond.penalty * jump - traction;
    for (std::size_t side = 0; side < 2; ++side) {
      const double area = point[side].area, sign = side == 0 ? 1 : -1;
      const Vec3 turned = bond.weight[side] * (rotation[side].transpose() * jump);
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        forces[side][n] += sign * area *
                           (point[side].shape.value[n] * held -
                            rotation[side] * (point[side].traction[n].transpose() * turned));
    }
  }
  return forces;
}

std::array<bool, kQuadraticNodes> nodes_of_surface(const BondedCells& pair, std::size_t side) {
  constexpr double kNone =
      1e-12;  // of the largest int N^2 dA: in cells that are cut nodes of small shares are soft, too
  std::array<double, kQuadraticNodes> square{};
  for (const FacePoint& point : pair.points[side]) {
    const QuadraticShape shape = quadratic_shape(point.at);
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      square[n] += point.area_vector.norm() * shape.value[n] * shape.value[n];
  }
  const double most = *std::max_element(square.begin(), square.end());
  std::array<bool, kQuadraticNodes> found{};
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) found[n] = square[n] > kNone * most;
  return found;
}

}  // namespace flexel::simulate
