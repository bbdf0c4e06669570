// A triangle is flipped when its normal points against the one that the frames of its corners give it: the
// cofactor of their mean deformation gradient turns normals (Nanson's formula).
#include "mapping/report/quality.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "formats/part/topology.h"

namespace flexel::mapping {
namespace {

constexpr double kDegrees = 180 / M_PI;
constexpr double kFlat = 90, kFolded = 150;  // degrees

using Triangle = std::array<std::uint32_t, 3>;

Vec3 area_of(const std::vector<Vec3>& at, const Triangle& t) {
  return (at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]) / 2;
}

double smallest_angle(const std::vector<Vec3>& at, const Triangle& t) {
  double smallest = 180;
  for (int i = 0; i < 3; ++i) {
    const Vec3 a = at[t[(i + 1) % 3]] - at[t[i]], b = at[t[(i + 2) % 3]] - at[t[i]];
    smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)) * kDegrees);
  }
  return smallest;
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * kDegrees;
}

// The transposed inverse times the determinant, which a singular matrix has too.
Mat3 cofactor(const Mat3& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i) result.col(i) = m.col((i + 1) % 3).cross(m.col((i + 2) % 3));
  return result;
}

struct Sums {
  double area_before = 0, area_after = 0, angle_before = 180, angle_after = 180, jump = 0;
  std::size_t triangles = 0, flipped = 0, folded = 0;
  void operator+=(const Sums& other) {
    area_before += other.area_before;
    area_after += other.area_after;
    angle_before = std::min(angle_before, other.angle_before);
    angle_after = std::min(angle_after, other.angle_after);
    jump = std::max(jump, other.jump);
    triangles += other.triangles;
    flipped += other.flipped;
    folded += other.folded;
  }
};

}  // namespace

SurfaceQuality surface_quality(const Surface& surface, const MapResult& result,
                               const std::vector<Mat3>& gradients) {
  const Triangles triangles = triangulate(surface);
  const std::vector<Triangle>& corners = triangles.corners;
  const std::vector<Vec3>& rest = surface.vertices;
  std::vector<Vec3> moved(rest.size());
  parallel_for_each(moved.size(), [&](std::size_t v) { moved[v] = rest[v] + result.displacement[v]; });
  const Topology mesh = topology(corners, weld(rest));
  constexpr std::size_t kTrianglesAtATime = 1024;
  ShareCounter done(corners.size());
  const Sums sums = parallel_sum<Sums>(corners.size(), [&](std::size_t t) {
    Sums own;
    if (t % kTrianglesAtATime == 0) done.add(std::min(kTrianglesAtATime, corners.size() - t));
    const Vec3 before = area_of(rest, corners[t]), after = area_of(moved, corners[t]);
    if (!(before.norm() > 0) || !after.allFinite()) return own;
    own.triangles = 1;
    own.area_before = before.norm();
    own.area_after = after.norm();
    own.angle_before = smallest_angle(rest, corners[t]);
    own.angle_after = smallest_angle(moved, corners[t]);
    Mat3 gradient = Mat3::Zero();
    for (const std::uint32_t v : corners[t]) gradient += gradients[result.frame[v]];
    own.flipped = (cofactor(gradient) * before).dot(after) < 0;
    for (const std::uint32_t other : mesh.neighbour[t]) {
      if (other == kNoTriangle) continue;
      const double angle_before = angle_between(before, area_of(rest, corners[other]));
      const double angle_after = angle_between(after, area_of(moved, corners[other]));
      own.jump = std::max(own.jump, angle_after - angle_before);
      if (angle_before < kFlat && angle_after > kFolded) own.folded = 1;
    }
    return own;
  });
  SurfaceQuality quality;
  quality.triangles = sums.triangles;
  quality.flipped = sums.flipped;
  quality.folded = sums.folded;
  quality.smallest_angle_before = sums.triangles > 0 ? sums.angle_before : 0;
  quality.smallest_angle_after = sums.triangles > 0 ? sums.angle_after : 0;
  quality.area_before = sums.area_before;
  quality.area_after = sums.area_after;
  quality.largest_normal_jump_added = sums.jump;
  quality.volume_before = signed_volume(rest, corners);
  quality.volume_after = signed_volume(moved, corners);
  return quality;
}

LatticeVolume lattice_volume(const Body& body, const std::vector<std::uint8_t>& but) {
  struct Volumes {
    double before = 0, after = 0;
    void operator+=(const Volumes& other) {
      before += other.before;
      after += other.after;
    }
  };
  // Two Gauss points along each axis are exact for a trilinear cell.
  const auto volume = [&](std::size_t cell, const std::vector<Vec3>& at) {
    const double points[2] = {0.5 - std::sqrt(1.0 / 12), 0.5 + std::sqrt(1.0 / 12)};
    double sum = 0;
    for (unsigned g = 0; g < 8; ++g) {
      const Vec3 p(points[g & 1], points[g >> 1 & 1], points[g >> 2]);
      Mat3 jacobian = Mat3::Zero();
      for (unsigned a = 0; a < 8; ++a) {
        const Vec3 high(a & 1, a >> 1 & 1, a >> 2);
        const Vec3 n = (1 - high.array()) + (2 * high.array() - 1) * p.array(), s = 2 * high.array() - 1;
        jacobian += at[body.cell_elements[cell][a]] *
                    Vec3(s.x() * n.y() * n.z(), n.x() * s.y() * n.z(), n.x() * n.y() * s.z()).transpose();
      }
      sum += jacobian.determinant() / 8;
    }
    return sum;
  };
  const Volumes sum = parallel_sum<Volumes>(body.cell_count(), [&](std::size_t cell) {
    if (body.broken[cell] != 0 || (!but.empty() && but[cell] != 0)) return Volumes{};
    return Volumes{body.fill[cell] * volume(cell, body.rest), body.fill[cell] * volume(cell, body.position)};
  });
  return {sum.before, sum.after};
}

double stretch(const Mat3& gradient) {
  if (!gradient.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(gradient.transpose() * gradient, Eigen::EigenvaluesOnly);
  return (solver.eigenvalues().cwiseMax(0).cwiseSqrt().array() - 1).abs().maxCoeff();
}

}  // namespace flexel::mapping
