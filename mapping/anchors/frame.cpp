// The base of four elements is built in the same way at rest and deformed, from the edges that leave the
// origin; only the difference of the two bases is kept, so that elements that did not move give a difference
// of exactly zero. Gram-Schmidt takes its third axis from the third edge, not from a cross product: a base
// that is turned inside out keeps its coordinates and changes its handedness, which the determinant shows.
#include "mapping/anchors/frame.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace flexel::mapping {
namespace {

Mat3 edges(const Frame& frame, const std::vector<Vec3>& points) {
  Mat3 edge;
  for (int axis = 0; axis < 3; ++axis)
    edge.col(axis) = points[frame.elements[axis + 1]] - points[frame.elements[0]];
  return edge;
}

Mat3 gram_schmidt(const Mat3& edge) {
  Mat3 base;
  base.col(0) = edge.col(0).normalized();
  base.col(1) = (edge.col(1) - edge.col(1).dot(base.col(0)) * base.col(0)).normalized();
  base.col(2) =
      edge.col(2) - edge.col(2).dot(base.col(0)) * base.col(0) - edge.col(2).dot(base.col(1)) * base.col(1);
  base.col(2).normalize();
  return base;
}

// The plane's edges (or their orthonormal axes) and its unit normal.
Mat3 plane_base(const Mat3& edge, bool orthonormal) {
  Mat3 base = edge;
  if (orthonormal) {
    base.col(0) = edge.col(0).normalized();
    base.col(1) = (edge.col(1) - edge.col(1).dot(base.col(0)) * base.col(0)).normalized();
  }
  base.col(2) = edge.col(0).cross(edge.col(1)).normalized();
  return base;
}

// The smallest rotation that takes unit vector `from` to unit vector `to` (Rodrigues); half a turn about some
// axis across when they are opposite.
Mat3 smallest_rotation(const Vec3& from, const Vec3& to) {
  const double cosine = from.dot(to);
  if (cosine < -1 + 1e-12) {
    const Vec3 axis = from.unitOrthogonal();
    return 2 * axis * axis.transpose() - Mat3::Identity();
  }
  const Vec3 axis = from.cross(to);
  Mat3 cross;
  cross << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return Mat3::Identity() + cross + cross * cross / (1 + cosine);
}

// `rest` is the edge at rest, `edge` the edge now.
Mat3 line_base(const Vec3& rest, const Vec3& edge, bool orthonormal) {
  const Vec3 along = rest.normalized();
  const Mat3 rotation = smallest_rotation(along, edge.normalized());
  const Vec3 across = along.unitOrthogonal();
  Mat3 base;
  base.col(0) = orthonormal ? edge.normalized() : edge;
  base.col(1) = rotation * across;
  base.col(2) = rotation * along.cross(across);
  return base;
}

// The base now, of a frame whose edges were `rest_edge` at rest.
Mat3 base_of(FrameKind kind, const Mat3& rest_edge, const Mat3& edge, bool orthonormal) {
  switch (kind) {
    case FrameKind::full:
      return orthonormal ? gram_schmidt(edge) : edge;
    case FrameKind::plane:
      return plane_base(edge, orthonormal);
    case FrameKind::line:
      return line_base(rest_edge.col(0), edge.col(0), orthonormal);
    case FrameKind::rigid:
      break;
  }
  return Mat3::Identity();
}

std::uint8_t flags_of(FrameKind kind, const Mat3& rest_edge, const Mat3& edge) {
  if (kind == FrameKind::rigid) return 0;
  const double shortening = edge.col(0).norm() / rest_edge.col(0).norm();
  if (kind == FrameKind::line) return shortening < kDegenerate ? kFrameDegenerate : 0;
  if (kind == FrameKind::plane) return sine(edge.col(0), edge.col(1)) < kDegenerate ? kFrameDegenerate : 0;
  const double now = normalised_determinant(edge.col(0), edge.col(1), edge.col(2));
  if (std::abs(now) < kDegenerate) return kFrameDegenerate;
  return now * rest_edge.determinant() < 0 ? kFrameInverted : 0;
}

}  // namespace

double normalised_determinant(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double lengths = a.norm() * b.norm() * c.norm();
  return lengths > 0 ? a.cross(b).dot(c) / lengths : 0;
}

double sine(const Vec3& a, const Vec3& b) {
  const double lengths = a.norm() * b.norm();
  return lengths > 0 ? a.cross(b).norm() / lengths : 0;
}

Mat3 rest_base(const Frame& frame, const std::vector<Vec3>& rest, bool orthonormal) {
  const Mat3 edge = edges(frame, rest);
  return base_of(frame.kind, edge, edge, orthonormal);
}

FrameMotion frame_motion(const Frame& frame, const std::vector<Vec3>& rest, const std::vector<Vec3>& position,
                         bool orthonormal) {
  FrameMotion motion;
  motion.translation = position[frame.elements[0]] - rest[frame.elements[0]];
  if (frame.kind == FrameKind::rigid) return motion;
  const Mat3 rest_edge = edges(frame, rest), edge = edges(frame, position);
  motion.flags = flags_of(frame.kind, rest_edge, edge);
  // A collapsed base has no axes: the vertex then follows the origin.
  if (motion.flags & kFrameDegenerate) return motion;
  motion.change = base_of(frame.kind, rest_edge, edge, orthonormal) -
                  base_of(frame.kind, rest_edge, rest_edge, orthonormal);
  return motion;
}

std::vector<Mat3> deformation_gradients(const std::vector<Frame>& frames, const std::vector<Vec3>& rest,
                                        const std::vector<Vec3>& position) {
  std::vector<Mat3> gradients(frames.size());
  parallel_for_each(frames.size(), [&](std::size_t f) {
    const FrameMotion motion = frame_motion(frames[f], rest, position, false);
    gradients[f] = Mat3::Identity() + motion.change * rest_base(frames[f], rest, false).inverse();
  });
  return gradients;
}

double distance_outside(const Body& body, const Frame& frame, const Vec3& point) {
  const std::uint32_t origin = frame.elements[0];
  const auto part =
      std::upper_bound(body.parts.begin(), body.parts.end(), origin,
                       [](std::uint32_t element, const Part& p) { return element < p.element_end; });
  const Lattice& lattice = part->lattice;
  return (lattice.axes.transpose() * (point - body.rest[origin])).cwiseQuotient(lattice.spacing).norm() -
         kHalfDiagonal;
}

}  // namespace flexel::mapping
