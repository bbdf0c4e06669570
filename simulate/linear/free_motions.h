// Rigid motions that supports leave free.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

// Rigid motions that A leaves free: eigenvectors of A restricted to the six rigid motions of each connected
// group of unknowns, with an eigenvalue under `threshold` times that of a stiff one. For the message that
// names the part and the motion.
struct FreeMotion {
  std::uint32_t part = 0;
  Vec3 translation = Vec3::Zero();  // unit direction, or zero
  Vec3 rotation = Vec3::Zero();     // unit axis, or zero
};
[[nodiscard]] std::vector<FreeMotion> free_motions(const LinearOperator& matrix, const NodeGeometry& geometry,
                                                   double threshold = 1e-9);
[[nodiscard]] std::vector<FreeMotion> free_motions(const BlockMatrix& matrix, const NodeGeometry& geometry,
                                                   double threshold = 1e-9);

// Likewise of a matrix that is elsewhere: `groups` of its rows that are coupled, ascending; y = A x; its diagonal [N/m] (rows x 3).
struct MatrixElsewhere {
  std::vector<std::vector<std::uint32_t>> groups;
  std::function<void(const std::vector<Vec3>& x, std::vector<Vec3>& y)> multiply;
  std::vector<Vec3> diagonal;
  // Where other processes have more rows of the groups: sums over them all. Empty: there are none.
  std::function<void(std::span<double>)> sum = {};
};
[[nodiscard]] std::vector<FreeMotion> free_motions(const MatrixElsewhere& matrix,
                                                   const NodeGeometry& geometry, double threshold = 1e-9);

// "translate along x", "rotate about (0.71, 0.71, 0.00)".
[[nodiscard]] std::string motion_name(const FreeMotion& motion);

}  // namespace flexel::simulate
