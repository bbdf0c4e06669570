// The rotation is the eigenvector of the greatest eigenvalue of a symmetric 4 x 4 matrix, as a quaternion.
#include "cad/fit/rigid_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <gp_Quaternion.hxx>
#include <gp_Vec.hxx>

#include "base/math/dense.h"

namespace flexel::cad {

RigidMotion rigid_motion(const std::vector<gp_XYZ>& from, const std::vector<gp_XYZ>& to, double still) {
  gp_XYZ from_middle(0, 0, 0), to_middle(0, 0, 0);
  for (std::size_t i = 0; i < from.size(); ++i) {
    from_middle += from[i];
    to_middle += to[i];
  }
  from_middle /= static_cast<double>(from.size());
  to_middle /= static_cast<double>(to.size());
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const gp_XYZ a = from[i] - from_middle, b = to[i] - to_middle;
    moment += Eigen::Vector3d(a.X(), a.Y(), a.Z()) * Eigen::Vector3d(b.X(), b.Y(), b.Z()).transpose();
  }
  const Eigen::Vector3d skew(moment(1, 2) - moment(2, 1), moment(2, 0) - moment(0, 2),
                             moment(0, 1) - moment(1, 0));
  Eigen::Matrix4d matrix;
  matrix(0, 0) = moment.trace();
  matrix.block<1, 3>(0, 1) = skew.transpose();
  matrix.block<3, 1>(1, 0) = skew;
  matrix.block<3, 3>(1, 1) = moment + moment.transpose() - moment.trace() * Eigen::Matrix3d::Identity();
  const Eigen::Vector4d q = eigen_symmetric(matrix).vectors.col(3);
  RigidMotion found;
  found.motion.SetRotation(gp_Quaternion(q[1], q[2], q[3], q[0]));
  gp_XYZ turned = from_middle;
  found.motion.Transforms(turned);
  found.motion.SetTranslationPart(gp_Vec(to_middle - turned));
  found.none = true;
  for (std::size_t i = 0; i < from.size(); ++i) {
    gp_XYZ moved = from[i];
    found.motion.Transforms(moved);
    found.error = std::max(found.error, (moved - to[i]).Modulus());
    found.mean += (moved - to[i]).SquareModulus() / static_cast<double>(from.size());
    found.none = found.none && (from[i] - to[i]).Modulus() <= still;
  }
  found.mean = std::sqrt(found.mean);
  return found;
}

}  // namespace flexel::cad
