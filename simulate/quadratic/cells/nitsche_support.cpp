// The terms of Nitsche's method at one point, with dP/dF of the material at rest.
#include "simulate/quadratic/cells/nitsche_support.h"

#include <algorithm>

namespace flexel::simulate {
namespace {

Mat3 projector_of(const Tie& tie) {
  return Vec3(tie.axes[0], tie.axes[1], tie.axes[2]).asDiagonal();
}

}  // namespace

NitschePoint traction_point(const FacePoint& point, const Lattice& lattice, const Mat9& moduli) {
  NitschePoint made;
  made.shape = world_shape(lattice, point.at);
  made.area = point.area_vector.norm();
  const Vec3 normal = point.area_vector / made.area;
  Eigen::Matrix<double, 3, 9> normal_moduli;  // (i, 3 k + l): sum_j n_j A(3 i + j, 3 k + l)
  for (int i = 0; i < 3; ++i) normal_moduli.row(i) = normal.transpose() * moduli.middleRows<3>(3 * i);
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    for (int k = 0; k < 3; ++k)
      made.traction[n].col(k) = normal_moduli.middleCols<3>(3 * k) * made.shape.gradient[n];
  return made;
}

NitschePoint nitsche_point(const FacePoint& point, const Tie& tie, double share, const Lattice& lattice,
                           const Mat9& moduli, double penalty) {
  NitschePoint made = traction_point(point, lattice, moduli);
  made.penalty = penalty;
  made.projector = projector_of(tie);
  made.led = tie.motion.displacement(point.position, share);
  return made;
}

void add_led(const NitschePoint& point, const Mat3& rotation, std::array<Vec3, kQuadraticNodes>& forces) {
  const Vec3 led = point.projector * point.led, local = rotation.transpose() * led;
  for (std::size_t a = 0; a < kQuadraticNodes; ++a)
    forces[a] += point.area * (point.penalty * point.shape.value[a] * led -
                               rotation * (point.traction[a].transpose() * local));
}

Vec3 reaction(const NitschePoint& point, const std::array<Vec3, kQuadraticNodes>& u,
              const std::array<Vec3, kQuadraticNodes>& local, const Mat3& rotation) {
  Vec3 moved = Vec3::Zero(), traction = Vec3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    moved += point.shape.value[n] * u[n];
    traction += point.traction[n] * local[n];
  }
  return point.area *
         (point.projector * (rotation * (traction - point.free) - point.penalty * (moved - point.led)));
}

// Many points at a time: most of the work is the product of shape functions and tractions.
void SupportIntegrals::find(const Lattice& lattice, const Mat9& moduli) {
  constexpr std::size_t kAtATime = 32;
  constexpr auto kNodes = static_cast<Eigen::Index>(kQuadraticNodes);
  free.fill(Vec3::Zero());
  mass.setZero();
  traction.setZero();
  Eigen::Matrix<double, kQuadraticNodes, Eigen::Dynamic> value(kNodes, kAtATime), weighted = value;
  Eigen::Matrix<double, 9 * kQuadraticNodes, Eigen::Dynamic> tractions(9 * kNodes, kAtATime);
  for (std::size_t first = 0; first < points.size(); first += kAtATime) {
    const auto count = static_cast<Eigen::Index>(std::min(kAtATime, points.size() - first));
    for (Eigen::Index p = 0; p < count; ++p) {
      const NitschePoint point =
          traction_point(*points[first + static_cast<std::size_t>(p)], lattice, moduli);
      for (Eigen::Index n = 0; n < kNodes; ++n) {
        value(n, p) = point.shape.value[static_cast<std::size_t>(n)];
        weighted(n, p) = point.area * value(n, p);
        const Mat3& t = point.traction[static_cast<std::size_t>(n)];
        for (int i = 0; i < 3; ++i)
          for (int k = 0; k < 3; ++k) tractions(9 * n + 3 * i + k, p) = t(i, k);
      }
    }
    mass.noalias() += weighted.leftCols(count) * value.leftCols(count).transpose();
    traction.noalias() += weighted.leftCols(count) * tractions.leftCols(count).transpose();
  }
}

Mat3 SupportIntegrals::traction_block(std::size_t a, std::size_t b) const {
  Mat3 block;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      block(i, k) = traction(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(9 * b) + 3 * i + k);
  return block;
}

void SupportIntegrals::add_to(double penalty, const Mat3& rotation, CellMatrix& matrix) const {
  const Mat3 projector = rotation.transpose() * projector_of(*support->tie) * rotation;
  for (std::size_t a = 0; a < kQuadraticNodes; ++a)
    for (std::size_t b = 0; b < kQuadraticNodes; ++b) {
      const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
      matrix.block<3, 3>(3 * i, 3 * j) += penalty * mass(i, j) * projector -
                                          projector * traction_block(a, b) -
                                          traction_block(b, a).transpose() * projector;
    }
}

void SupportIntegrals::add_forces(double penalty, double share, const std::array<Vec3, kQuadraticNodes>& u,
                                  const std::array<Vec3, kQuadraticNodes>& local, const Mat3& rotation,
                                  std::array<Vec3, kQuadraticNodes>& forces) const {
  const Mat3 projector = projector_of(*support->tie);
  std::array<Vec3, kQuadraticNodes> held, turned;  // P u in the world's frame and in the cell's
  for (std::size_t b = 0; b < kQuadraticNodes; ++b) {
    held[b] = projector * u[b];
    turned[b] = rotation.transpose() * held[b];
  }
  for (std::size_t a = 0; a < kQuadraticNodes; ++a) {
    Vec3 penalised = Vec3::Zero(), pulled = -share * free[a], adjoint = Vec3::Zero();
    for (std::size_t b = 0; b < kQuadraticNodes; ++b) {
      penalised += mass(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) * held[b];
      pulled += traction_block(a, b) * local[b];
      adjoint += traction_block(b, a).transpose() * turned[b];
    }
    forces[a] += penalty * penalised - projector * (rotation * pulled) - rotation * adjoint;
  }
}

}  // namespace flexel::simulate
