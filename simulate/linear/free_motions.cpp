// Rigid motions that nothing resists. For each connected group of elements the matrix is restricted to the
// six rigid motions about the group's centre, measured by their mean square displacement; the motions whose
// energy is next to nothing beside the stiffness of a single element are free. Their space is then told in
// plain words: pure translations first, then rotations, each turned as near to the coordinate axes as the
// space allows.
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>

#include "formats/parallel.h"
#include "simulate/linear/aggregate.h"
#include "simulate/linear/solve.h"

namespace flexel {
namespace {

using Motion = Eigen::Matrix<double, 6, 1>;   // translation, rotation x reach
using Motions = Eigen::Matrix<double, 3, 6>;  // displacement of one element per unit of each
using Rows = std::vector<std::uint32_t>;

constexpr double kCoupled = 1e-12;

// Connected groups of rows, each ascending, in order of their first row.
std::vector<Rows> connected_groups(const LinearOperator& matrix) {
  const Graph graph = std::move(coupled_rows(matrix, std::array{kCoupled}).front());
  std::vector<std::uint8_t> seen(graph.nodes(), 0);
  std::vector<Rows> groups;
  for (std::uint32_t seed = 0; seed < graph.nodes(); ++seed) {
    if (seen[seed]) continue;
    seen[seed] = 1;
    Rows rows{seed};
    for (std::size_t next = 0; next < rows.size(); ++next) {
      for (const std::uint32_t other : graph.of(rows[next])) {
        if (seen[other]) continue;
        seen[other] = 1;
        rows.push_back(other);
      }
    }
    std::sort(rows.begin(), rows.end());
    groups.push_back(std::move(rows));
  }
  return groups;
}

struct Frame {
  Vec3 centre = Vec3::Zero();
  double reach = 1;
  [[nodiscard]] Motions at(const Vec3& position) const {
    const Vec3 r = (position - centre) / reach;
    Motions motions;
    motions << 1, 0, 0, 0, r[2], -r[1], 0, 1, 0, -r[2], 0, r[0], 0, 0, 1, r[1], -r[0], 0;
    return motions;
  }
};

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

// A times each of the six motions, each group moving about its own centre.
std::array<std::vector<Vec3>, 6> forces_of_motions(const LinearOperator& matrix,
                                                   const std::vector<Rows>& groups,
                                                   const std::vector<Frame>& frames,
                                                   const std::vector<Vec3>& position) {
  std::array<std::vector<Vec3>, 6> forces;
  std::vector<Vec3> moved(matrix.rows());
  for (std::size_t motion = 0; motion < 6; ++motion) {
    for (std::size_t g = 0; g < groups.size(); ++g)
      parallel_for_each(groups[g].size(), [&](std::size_t r) {
        const std::uint32_t i = groups[g][r];
        moved[i] = frames[g].at(position[i]).col(static_cast<Eigen::Index>(motion));
      });
    multiply(matrix, moved, forces[motion]);
  }
  return forces;
}

Restriction restrict_to_rigid(const std::array<std::vector<Vec3>, 6>& forces,
                              const std::vector<Block>& diagonal, const Rows& rows, const Frame& frame,
                              const std::vector<Vec3>& position) {
  const double share = 1 / static_cast<double>(rows.size());
  return parallel_sum<Restriction>(rows.size(), [&](std::size_t r) {
    const std::uint32_t i = rows[r];
    const Motions own = frame.at(position[i]);
    Motions force;
    for (std::size_t motion = 0; motion < 6; ++motion)
      force.col(static_cast<Eigen::Index>(motion)) = forces[motion][i];
    Restriction term;
    term.energy = own.transpose() * force;
    term.size = share * own.transpose() * own;
    term.stiffness = share * diagonal[i].trace() / 3;
    return term;
  });
}

// Orthonormal base of the motions of non-zero size whose energy per size is at most `limit`.
Eigen::MatrixXd free_space(const Restriction& restriction, double limit) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> size(restriction.size);
  Eigen::MatrixXd whiten(6, 6);
  Eigen::Index kept = 0;
  for (Eigen::Index c = 0; c < 6; ++c) {
    if (size.eigenvalues()[c] > 1e-12)
      whiten.col(kept++) = size.eigenvectors().col(c) / std::sqrt(size.eigenvalues()[c]);
  }
  whiten.conservativeResize(6, kept);
  const Eigen::MatrixXd energy =
      whiten.transpose() * .5 * (restriction.energy + restriction.energy.transpose()) * whiten;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(energy);
  Eigen::Index free = 0;
  while (free < kept && eigen.eigenvalues()[free] <= limit) ++free;
  if (free == 0) return Eigen::MatrixXd(6, 0);
  const Eigen::MatrixXd space = whiten * eigen.eigenvectors().leftCols(free);
  return space.householderQr().householderQ() * Eigen::MatrixXd::Identity(6, free);
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
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(space.bottomRows(3), Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Index turning = 0;
  while (turning < svd.singularValues().size() && svd.singularValues()[turning] > 1e-4) ++turning;
  const Eigen::MatrixXd still = space.topRows(3) * svd.matrixV().rightCols(space.cols() - turning);
  for (const Vec3& direction : tidy_base(still)) motions.push_back({part, direction, Vec3::Zero()});
  for (const Vec3& axis : tidy_base(svd.matrixU().leftCols(turning)))
    motions.push_back({part, Vec3::Zero(), axis});
}

}  // namespace

std::vector<FreeMotion> free_motions(const LinearOperator& matrix, const NodeGeometry& geometry,
                                     double threshold) {
  std::vector<FreeMotion> motions;
  const std::vector<Rows> groups = connected_groups(matrix);
  std::vector<Frame> frames;
  for (const Rows& rows : groups) frames.push_back(group_frame(rows, geometry.position));
  const auto forces = forces_of_motions(matrix, groups, frames, geometry.position);
  const std::vector<Block> diagonal = matrix.diagonal();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Restriction restriction =
        restrict_to_rigid(forces, diagonal, groups[g], frames[g], geometry.position);
    // The energy of a motion of unit mean square size, beside that of one element moved alone.
    tell(free_space(restriction, threshold * restriction.stiffness), geometry.part[groups[g].front()],
         motions);
  }
  return motions;
}

std::vector<FreeMotion> free_motions(const BlockMatrix& matrix, const NodeGeometry& geometry,
                                     double threshold) {
  return free_motions(StoredMatrix(matrix), geometry, threshold);
}

}  // namespace flexel
