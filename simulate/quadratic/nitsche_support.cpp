// The terms of Nitsche's method at one point, with dP/dF of the material at rest.
#include "simulate/quadratic/nitsche_support.h"

namespace flexel::simulate {

NitschePoint nitsche_point(const FacePoint& point, const Tie& tie, double share, const Lattice& lattice,
                           const Mat9& moduli, double penalty) {
  NitschePoint made;
  made.shape = world_shape(lattice, point.at);
  made.area = point.area_vector.norm();
  made.penalty = penalty;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (tie.axes[axis]) made.projector(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(axis)) = 1;
  made.led = tie.motion.displacement(point.position, share);
  const Vec3 normal = point.area_vector / made.area;
  Eigen::Matrix<double, 3, 9> normal_moduli;  // (i, 3 k + l): sum_j n_j A(3 i + j, 3 k + l)
  for (int i = 0; i < 3; ++i) normal_moduli.row(i) = normal.transpose() * moduli.middleRows<3>(3 * i);
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    for (int k = 0; k < 3; ++k)
      made.traction[n].col(k) = normal_moduli.middleCols<3>(3 * k) * made.shape.gradient[n];
  return made;
}

void add_to(const NitschePoint& point, const Mat3& rotation, CellMatrix& matrix) {
  const Mat3 projector = rotation.transpose() * point.projector * rotation;
  for (std::size_t a = 0; a < kQuadraticNodes; ++a)
    for (std::size_t b = 0; b < kQuadraticNodes; ++b) {
      const double na = point.shape.value[a], nb = point.shape.value[b];
      matrix.block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b)) +=
          point.area * (point.penalty * na * nb * projector - na * (projector * point.traction[b]) -
                        nb * (point.traction[a].transpose() * projector));
    }
}

void add_led(const NitschePoint& point, std::array<Vec3, kQuadraticNodes>& forces) {
  const Vec3 led = point.projector * point.led;
  for (std::size_t a = 0; a < kQuadraticNodes; ++a)
    forces[a] +=
        point.area * (point.penalty * point.shape.value[a] * led - point.traction[a].transpose() * led);
}

Vec3 reaction(const NitschePoint& point, const std::array<Vec3, kQuadraticNodes>& u,
              const std::array<Vec3, kQuadraticNodes>& local, const Mat3& rotation) {
  Vec3 moved = Vec3::Zero(), traction = Vec3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    moved += point.shape.value[n] * u[n];
    traction += point.traction[n] * local[n];
  }
  return point.area * (point.projector * (rotation * traction - point.penalty * (moved - point.led)));
}

std::array<Vec3, kQuadraticNodes> support_forces(const NitschePoint& point,
                                                 const std::array<Vec3, kQuadraticNodes>& u,
                                                 const std::array<Vec3, kQuadraticNodes>& local,
                                                 const Mat3& rotation) {
  const Vec3 held = reaction(point, u, local, rotation);
  Vec3 moved = -point.led;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) moved += point.shape.value[n] * u[n];
  const Vec3 slip = rotation.transpose() * (point.projector * moved);
  std::array<Vec3, kQuadraticNodes> forces;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    forces[n] =
        -point.shape.value[n] * held - point.area * (rotation * (point.traction[n].transpose() * slip));
  return forces;
}

}  // namespace flexel::simulate
