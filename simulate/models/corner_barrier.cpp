// F_c = I + sum_a u_a (x) g_a over corner c and its three neighbours; dJ_c/du_a = cof F_c g_a, and
// d2J_c/du_a du_b w = (F_c (g_a x g_b)) x w up to its sign.
#include "simulate/models/corner_barrier.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace flexel::simulate {
namespace {

constexpr double kStrength = 4;              // times mu
constexpr double kGoesOn = 1.0 / 16;         // r below which b is quadratic
constexpr double kRounding = 1e-9;           // more than that of corner_volumes()
constexpr double kFarSquared = 0.41 * 0.41;  // (1 - 0.41)^3 > 0.2

struct Barrier {
  double value = 0, slope = 0, curvature = 0;
};

Barrier logarithm(double r) {
  const double left = 1 - r, ln = std::log(r);
  return {-left * left * ln, 2 * left * ln - left * left / r, -2 * ln + 4 * left / r + left * left / (r * r)};
}

Barrier barrier(double r) {
  if (!(r < 1)) return {};
  if (r >= kGoesOn) return logarithm(r);
  const Barrier from = logarithm(kGoesOn);
  const double on = r - kGoesOn;
  return {from.value + on * (from.slope + 0.5 * on * from.curvature), from.slope + on * from.curvature,
          from.curvature};
}

// A corner that is within its threshold, its barrier by J_c [J], and what J_c depends on.
struct Corner {
  std::array<std::size_t, 4> element{};  // itself, its neighbours along the axes
  std::array<Vec3, 4> gradient;          // g_a [1/m]
  Mat3 f, cofactor;
  Barrier by_volume;
};

Vec3 slope_of(const CellKind& kind, std::size_t axis) {
  return 0.5 * (kind.gradient[std::size_t{1} << axis] - kind.gradient[0]);
}

Mat3 cofactor_of(const Mat3& f) {
  Mat3 c;
  c.col(0) = f.col(1).cross(f.col(2));
  c.col(1) = f.col(2).cross(f.col(0));
  c.col(2) = f.col(0).cross(f.col(1));
  return c;
}

// Calls visit(Corner) for the corners whose barrier is not zero.
template <class Visit>
void visit_folding(const CellKind& kind, const CornerThresholds& thresholds, const CellVectors& u,
                   const Visit& visit) {
  if (far_from_folding(kind, u)) return;
  const CornerVolumes volumes = corner_volumes(kind, u);
  for (std::size_t c = 0; c < 8; ++c) {
    if (!(thresholds[c] > 0) || volumes[c] > (1 + kRounding) * thresholds[c]) continue;
    const Mat3 gradient = corner_gradient(kind, u, static_cast<std::uint32_t>(c));
    const double r = (1 + volume_change(gradient)) / thresholds[c];
    if (!(r < 1)) continue;
    Corner corner;
    corner.f = Mat3::Identity() + gradient;
    corner.cofactor = cofactor_of(corner.f);
    corner.element[0] = c;
    corner.gradient[0].setZero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t other = c ^ std::size_t{1} << axis;
      corner.element[axis + 1] = other;
      corner.gradient[axis + 1] = other > c ? slope_of(kind, axis) : Vec3(-slope_of(kind, axis));
      corner.gradient[0] -= corner.gradient[axis + 1];
    }
    const double scale = kStrength * kind.mu * kind.volume / 8;
    const Barrier b = barrier(r);
    corner.by_volume = {scale * b.value, scale * b.slope / thresholds[c],
                        scale * b.curvature / (thresholds[c] * thresholds[c])};
    visit(corner);
  }
}

// w -> w x v as a matrix
Mat3 crossed_with(const Vec3& v) {
  Mat3 m;
  m << 0, v.z(), -v.y(), -v.z(), 0, v.x(), v.y(), -v.x(), 0;
  return m;
}

}  // namespace

// The edges at a corner span it: by what they do at rest, whose directions are square to one another.
CornerVolumes corner_volumes(const CellKind& kind, const CellVectors& u) {
  std::array<Vec3, 3> slope, rest;
  double scale = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    slope[axis] = slope_of(kind, axis);
    rest[axis] = slope[axis] / slope[axis].squaredNorm();
  }
  scale /= rest[0].dot(rest[1].cross(rest[2]));
  std::array<std::array<Vec3, 8>, 3> edge;  // of each axis, by its first corner
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t a = 0; a < 8; ++a)
      if (!(a >> axis & 1)) edge[axis][a] = rest[axis] + u[a | std::size_t{1} << axis] - u[a];
  CornerVolumes volumes;
  for (std::size_t c = 0; c < 8; ++c)
    volumes[c] = scale * edge[0][c & 6].dot(edge[1][c & 5].cross(edge[2][c & 3]));
  return volumes;
}

CornerThresholds fold_thresholds(const CellKind& kind, const std::optional<CellKind>& shaped) {
  CornerThresholds thresholds;
  thresholds.fill(kFoldThreshold);
  if (!shaped) return thresholds;
  // The rest shape itself: F = G^-1 and q_m = F Q_m.
  const Mat3 f = (Mat3::Identity() + shaped->offset).inverse();
  CellVectors u;
  for (std::size_t a = 0; a < 8; ++a) {
    Vec3 at = Vec3::Zero(), moved = Vec3::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vec3 slope = slope_of(kind, axis);
      at += ((a >> axis & 1) ? 0.5 : -0.5) / slope.squaredNorm() * slope;
    }
    for (int m = 0; m < 4; ++m)
      moved += hourglass_sign(m, static_cast<int>(a)) * shaped->mode_offset[static_cast<std::size_t>(m)];
    u[a] = f * (at + moved) - at;
  }
  const CornerVolumes volumes = corner_volumes(kind, u);
  for (std::size_t c = 0; c < 8; ++c) thresholds[c] *= std::clamp(volumes[c], 0.0, 1.0);
  return thresholds;
}

bool far_from_folding(const CellKind& kind, const CellVectors& u, const CellVectors* more, double factor) {
  double most = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double square = slope_of(kind, axis).squaredNorm();
    double longest = 0;
    for (std::size_t a = 0; a < 8; ++a) {
      if (a >> axis & 1) continue;
      const std::size_t b = a | std::size_t{1} << axis;
      double change = (u[b] - u[a]).squaredNorm();
      if (more) {
        const double on = std::sqrt(change) + factor * ((*more)[b] - (*more)[a]).norm();
        change = on * on;
      }
      longest = std::max(longest, change);
    }
    most += square * longest;
  }
  return most < kFarSquared;
}

double nearest_to_folding(const CellKind& kind, const CornerThresholds& thresholds, const CellVectors& u) {
  double least = std::numeric_limits<double>::infinity();
  const CornerVolumes volumes = corner_volumes(kind, u);
  for (std::size_t c = 0; c < 8; ++c)
    if (thresholds[c] > 0) least = std::min(least, volumes[c] / thresholds[c]);
  return least;
}

double fold_energy(const CellKind& kind, const CornerThresholds& thresholds, const CellVectors& u) {
  double energy = 0;
  visit_folding(kind, thresholds, u, [&](const Corner& corner) { energy += corner.by_volume.value; });
  return energy;
}

void add_fold_forces(const CellKind& kind, const CornerThresholds& thresholds, const CellVectors& u,
                     CellVectors& forces) {
  visit_folding(kind, thresholds, u, [&](const Corner& corner) {
    for (std::size_t a = 0; a < 4; ++a)
      forces[corner.element[a]] -= corner.by_volume.slope * (corner.cofactor * corner.gradient[a]);
  });
}

std::optional<FoldTangent> fold_tangent(const CellKind& kind, const CornerThresholds& thresholds,
                                        const CellVectors& u, bool project) {
  std::optional<FoldTangent> tangent;
  visit_folding(kind, thresholds, u, [&](const Corner& corner) {
    if (!tangent) tangent.emplace().fill(Block::Zero());
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = 0; b < 4; ++b) {
        const Vec3 &g_a = corner.gradient[a], &g_b = corner.gradient[b];
        Block& block = (*tangent)[8 * corner.element[a] + corner.element[b]];
        block += corner.by_volume.curvature * (corner.cofactor * g_a) * (corner.cofactor * g_b).transpose();
        if (!project) block += corner.by_volume.slope * crossed_with(corner.f * g_a.cross(g_b));
      }
  });
  return tangent;
}

double fold_stiffening(const CellKind& kind, const CornerThresholds& thresholds, const CellVectors& u) {
  std::array<double, 3> square{};
  for (std::size_t axis = 0; axis < 3; ++axis) square[axis] = slope_of(kind, axis).squaredNorm();
  // Of the star of a corner's three edges: at most what two of its elements have together.
  const double star = square[0] + square[1] + square[2] + *std::max_element(square.begin(), square.end());
  double sum = 0;
  visit_folding(kind, thresholds, u, [&](const Corner& corner) {
    sum += star * (corner.by_volume.curvature * corner.cofactor.squaredNorm() -
                   corner.by_volume.slope * corner.f.norm());
  });
  if (sum == 0) return 0;
  // Rayleigh's quotients of a swelling and of a shear.
  const double lengths = 1 / square[0] + 1 / square[1] + 1 / square[2];
  const double own = kind.volume * std::max((3 * kind.mu + 4.5 * kind.lambda) / lengths,
                                            kind.mu * *std::min_element(square.begin(), square.end()));
  return sum / own;
}

}  // namespace flexel::simulate
