// Supports of model `quadratic`: Nitsche's method (1971) on faces; nodes that a box or a sphere selects are
// eliminated.
//
// Where a face is held or led to d along the axes of the projector P, with the outward traction t(u) = sigma n of
// the field,
//     a(u, v) = int sigma : eps(v) - int [t(u) . P v + t(v) . P (u - d)] + int beta (u - d) . P v,
// which the exact solution satisfies (unlike a penalty). beta = kNitsche (lambda + 2 mu) / h: half of that is not
// enough at Poisson's ratio .3 (measured; docs/theory/quadratic.md).
#pragma once
#include <string>

#include "simulate/effects/supports.h"
#include "simulate/quadratic/cells/cell_integrals.h"
#include "simulate/quadratic/cells/face_points.h"

namespace flexel::simulate {

constexpr double kNitsche = 150;

// What one [[fix]] or [[move]] holds.
struct NitscheSupport {
  const Tie* tie = nullptr;
  std::vector<FacePoint> points;     // on faces
  std::vector<std::uint32_t> nodes;  // held as they are
};

// Of one point: the traction that node n's displacement makes, (i, k): component i by component k [Pa/m]; and the
// stiffness of the penalty [Pa/m].
struct NitschePoint {
  QuadraticShape shape;  // gradients in the world frame
  std::array<Mat3, kQuadraticNodes> traction{};
  Mat3 projector = Mat3::Zero();
  double area = 0, penalty = 0;  // m^2, Pa/m
  Vec3 led = Vec3::Zero();       // m, d
  Vec3 free = Vec3::Zero();      // Pa, A : e n of the free strain, in the frame of the cell
};
// Shape functions, tractions and area only.
[[nodiscard]] NitschePoint traction_point(const FacePoint& point, const Lattice& lattice, const Mat9& moduli);
// `share`: of the tie's motion that is done.
[[nodiscard]] NitschePoint nitsche_point(const FacePoint& point, const Tie& tie, double share,
                                         const Lattice& lattice, const Mat9& moduli, double penalty);

// Adds what `led` asks for to forces (27 x 3) [N], of a cell that is turned by `rotation`.
void add_led(const NitschePoint& point, const Mat3& rotation, std::array<Vec3, kQuadraticNodes>& forces);

// N, of the support on the body: P (t - beta (u - d)) times the area. t is the traction of `local`, the displacement of the
// cell's nodes without its rotation (in its frame; without a rotation u itself).
[[nodiscard]] Vec3 reaction(const NitschePoint& point, const std::array<Vec3, kQuadraticNodes>& u,
                            const std::array<Vec3, kQuadraticNodes>& local, const Mat3& rotation);
// Of one support in one cell: int N_a N_b dA [m^2], and int N_a t_b dA [N/m], (i, k) at (a, 9 b + 3 i + k).
struct SupportIntegrals {
  const NitscheSupport* support = nullptr;
  std::vector<const FacePoint*> points;
  Eigen::Matrix<double, kQuadraticNodes, kQuadraticNodes> mass;
  Eigen::Matrix<double, kQuadraticNodes, 9 * kQuadraticNodes> traction;
  std::array<Vec3, kQuadraticNodes> free{};  // N, int N_a A : e n dA of the free strain e

  void find(const Lattice& lattice, const Mat9& moduli);
  // Adds its part to the cell's matrix, in the frame of a cell that is turned by `rotation`. `penalty`: beta [Pa/m].
  void add_to(double penalty, const Mat3& rotation, CellMatrix& matrix) const;
  // Adds its forces on the nodes, but for what a move asks for, to (27 x 3) [N]; u and `local` as for reaction(). `share`: of the
  // free strain.
  void add_forces(double penalty, double share, const std::array<Vec3, kQuadraticNodes>& u,
                  const std::array<Vec3, kQuadraticNodes>& local, const Mat3& rotation,
                  std::array<Vec3, kQuadraticNodes>& forces) const;

 private:
  [[nodiscard]] Mat3 traction_block(std::size_t a, std::size_t b) const;
};

}  // namespace flexel::simulate
