// Rigid motions that nothing resists. For each connected group of elements the matrix is restricted to the
// six rigid motions about the group's centre, measured by their mean square displacement; the motions whose
// energy is next to nothing beside the stiffness of a single element are free. Their space is then told in
// plain words: pure translations first, then rotations, each turned as near to the coordinate axes as the
// space allows.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/disjoint_sets.h"
#include "base/math/dense.h"
#include "base/parallel.h"
#include "simulate/linear/aggregate.h"
#include "simulate/linear/free_motions.h"
#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {
namespace {

using Movement = Eigen::Matrix<double, 6, 1>;   // translation, rotation x reach
using Movements = Eigen::Matrix<double, 3, 6>;  // displacement of one element per unit of each
using Rows = std::vector<std::uint32_t>;

constexpr double kCoupled = 1e-12;

// Connected groups of rows, each ascending, in order of their first row.
std::vector<Rows> connected_groups(const LinearOperator& matrix) {
  const std::vector<std::uint8_t> strength = link_strengths(matrix, std::array{kCoupled});
  const auto offsets = matrix.row_offsets();
  const auto columns = matrix.columns();
  DisjointSets sets(matrix.rows());
  for (std::uint32_t i = 0; i < matrix.rows(); ++i)
    for (std::uint64_t q = offsets[i]; q < offsets[i + 1]; ++q)
      if (columns[q] < i && strength[q] > 0) sets.unite(i, columns[q]);
  const std::vector<std::uint32_t> number = sets.numbered();
  std::vector<Rows> groups;
  for (std::uint32_t i = 0; i < matrix.rows(); ++i) {
    if (number[i] == groups.size()) groups.emplace_back();
    groups[number[i]].push_back(i);
  }
  return groups;
}

struct Frame {
  Vec3 centre = Vec3::Zero();
  double reach = 1;
  [[nodiscard]] Movements at(const Vec3& position) const {
    const Vec3 r = (position - centre) / reach;
    Movements motions;
    motions << 1, 0, 0, 0, r[2], -r[1], 0, 1, 0, -r[2], 0, r[0], 0, 0, 1, r[1], -r[0], 0;
    return motions;
  }
};

// Of a group that other processes have rows of, too; `count` becomes how many there are in all. Its reach is the root mean square then.
Frame group_frame(const Rows& rows, const std::vector<Vec3>& position,
                  const std::function<void(std::span<double>)>& sum, double& count) {
  Frame frame;
  std::array<double, 4> sums{static_cast<double>(rows.size()), 0, 0, 0};
  for (const std::uint32_t i : rows)
    for (int axis = 0; axis < 3; ++axis) sums[static_cast<std::size_t>(axis) + 1] += position[i][axis];
  sum(sums);
  count = sums[0];
  frame.centre = Vec3(sums[1], sums[2], sums[3]) / count;
  double squared = 0;
  for (const std::uint32_t i : rows) squared += (position[i] - frame.centre).squaredNorm();
  sum(std::span(&squared, 1));
  if (squared > 0) frame.reach = std::sqrt(squared / count);
  return frame;
}

Frame group_frame(const Rows& rows, const std::vector<Vec3>& position) {
  Frame frame;
  for (const std::uint32_t i : rows) frame.centre += position[i] / static_cast<double>(rows.size());
  double reach = 0;
  for (const std::uint32_t i : rows) reach = std::max(reach, (position[i] - frame.centre).norm());
  if (reach > 0) frame.reach = reach;
  return frame;
}

// Energy and mean square displacement over the six motions, and the mean stiffness of one element.
struct Restriction {
  Eigen::Matrix<double, 6, 6> energy = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 6> size = Eigen::Matrix<double, 6, 6>::Zero();
  double stiffness = 0;
  void operator+=(const Restriction& other) {
    energy += other.energy;
    size += other.size;
    stiffness += other.stiffness;
  }
};

struct Work {
  Movement of = Movement::Zero();
  void operator+=(const Work& other) { of += other.of; }
};

// Each group moves about its own centre, one motion after the other: A times all six is never held.
std::vector<Restriction> restrict_to_rigid(const MatrixElsewhere& matrix, const std::vector<Frame>& frames,
                                           const std::vector<double>& counts,
                                           const std::vector<Vec3>& position) {
  const std::vector<Rows>& groups = matrix.groups;
  std::vector<Restriction> result(groups.size());
  std::vector<Vec3> moved(position.size(), Vec3::Zero()), force(position.size());
  for (Eigen::Index motion = 0; motion < 6; ++motion) {
    for (std::size_t g = 0; g < groups.size(); ++g)
      parallel_for_each(groups[g].size(), [&](std::size_t r) {
        const std::uint32_t i = groups[g][r];
        moved[i] = frames[g].at(position[i]).col(motion);
      });
    matrix.multiply(moved, force);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const Work work = parallel_sum<Work>(groups[g].size(), [&](std::size_t r) {
        const std::uint32_t i = groups[g][r];
        return Work{frames[g].at(position[i]).transpose() * force[i]};
      });
      result[g].energy.col(motion) = work.of;
    }
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const double share = 1 / counts[g];
    result[g] += parallel_sum<Restriction>(groups[g].size(), [&](std::size_t r) {
      const std::uint32_t i = groups[g][r];
      const Movements own = frames[g].at(position[i]);
      Restriction term;
      term.size = share * own.transpose() * own;
      term.stiffness = share * matrix.diagonal[i].sum() / 3;
      return term;
    });
  }
  return result;
}

// Orthonormal base of the motions of non-zero size whose energy per size is at most `limit`.
Eigen::MatrixXd free_space(const Restriction& restriction, double limit) {
  const SymmetricEigen size = eigen_symmetric_6(restriction.size);
  Eigen::MatrixXd whiten(6, 6);
  Eigen::Index kept = 0;
  for (Eigen::Index c = 0; c < 6; ++c) {
    if (size.values[c] > 1e-12) whiten.col(kept++) = size.vectors.col(c) / std::sqrt(size.values[c]);
  }
  whiten.conservativeResize(6, kept);
  const Eigen::MatrixXd energy =
      whiten.transpose() * .5 * (restriction.energy + restriction.energy.transpose()) * whiten;
  const SymmetricEigen eigen = eigen_symmetric(energy);
  Eigen::Index free = 0;
  while (free < kept && eigen.values[free] <= limit) ++free;
  if (free == 0) return Eigen::MatrixXd(6, 0);
  const Eigen::MatrixXd space = whiten * eigen.vectors.leftCols(free);
  return orthonormal_base(space);
}

// An orthonormal base of the span of `directions` (3 x m, orthonormal), as near to the coordinate axes as it
// can be.
std::vector<Vec3> tidy_base(Eigen::MatrixXd directions) {
  std::vector<Vec3> base;
  Mat3 projector = directions * directions.transpose();
  for (Eigen::Index m = 0; m < directions.cols(); ++m) {
    Eigen::Index axis = 0;
    for (Eigen::Index a = 1; a < 3; ++a) {
      if (projector(a, a) > projector(axis, axis) + 1e-6) axis = a;
    }
    Vec3 direction = projector.col(axis).normalized();
    for (double& component : direction) {
      if (std::abs(component) < 1e-9) component = 0;
    }
    base.push_back(direction.normalized());
    projector -= base.back() * base.back().transpose();
  }
  return base;
}

void tell(const Eigen::MatrixXd& space, std::uint32_t part, std::vector<FreeMotion>& motions) {
  if (space.cols() == 0) return;
  // Combinations without rotation are the null space of the lower half; the rest turn about its column space.
  const SingularValues svd = singular_values(space.bottomRows(3));
  Eigen::Index turning = 0;
  while (turning < svd.values.size() && svd.values[turning] > 1e-4) ++turning;
  const Eigen::MatrixXd still = space.topRows(3) * svd.v.rightCols(space.cols() - turning);
  for (const Vec3& direction : tidy_base(still)) motions.push_back({part, direction, Vec3::Zero()});
  for (const Vec3& axis : tidy_base(svd.u.leftCols(turning))) motions.push_back({part, Vec3::Zero(), axis});
}

std::string axis_name(const Vec3& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(direction[axis]) > 0.999) return std::string(1, static_cast<char>('x' + axis));
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
}

}  // namespace

std::vector<FreeMotion> free_motions(const LinearOperator& matrix, const NodeGeometry& geometry,
                                     double threshold) {
  MatrixElsewhere same{connected_groups(matrix),
                       [&](const std::vector<Vec3>& x, std::vector<Vec3>& y) { multiply(matrix, x, y); },
                       {}};
  for (const Block& block : matrix.diagonal()) same.diagonal.emplace_back(block.diagonal());
  return free_motions(same, geometry, threshold);
}

std::vector<FreeMotion> free_motions(const MatrixElsewhere& matrix, const NodeGeometry& geometry,
                                     double threshold) {
  std::vector<FreeMotion> motions;
  const std::vector<Rows>& groups = matrix.groups;
  std::vector<Frame> frames;
  std::vector<double> counts;
  for (const Rows& rows : groups) {
    counts.push_back(static_cast<double>(rows.size()));
    frames.push_back(matrix.sum ? group_frame(rows, geometry.position, matrix.sum, counts.back())
                                : group_frame(rows, geometry.position));
  }
  std::vector<Restriction> restrictions = restrict_to_rigid(matrix, frames, counts, geometry.position);
  for (Restriction& each : restrictions) {
    if (!matrix.sum) break;
    matrix.sum(std::span(each.energy.data(), 36));
    matrix.sum(std::span(each.size.data(), 36));
    matrix.sum(std::span(&each.stiffness, 1));
  }
  // The energy of a motion of unit mean square size, beside that of one element moved alone.
  for (std::size_t g = 0; g < groups.size(); ++g)
    tell(free_space(restrictions[g], threshold * restrictions[g].stiffness),
         groups[g].empty() ? 0 : geometry.part[groups[g].front()], motions);
  return motions;
}

std::vector<FreeMotion> free_motions(const BlockMatrix& matrix, const NodeGeometry& geometry,
                                     double threshold) {
  return free_motions(StoredMatrix(matrix), geometry, threshold);
}

std::string motion_name(const FreeMotion& motion) {
  if (motion.rotation == Vec3::Zero()) return "translate along " + axis_name(motion.translation);
  return "rotate about " + axis_name(motion.rotation);
}

}  // namespace flexel::simulate
