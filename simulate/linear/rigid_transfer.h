// The way from the elements to their groups and back without a stored prolongator. P = T - w D^-1 A T takes
// one more product with A, which reads a tenth of what the blocks of P would be (simulate/equilibrium/cell_stiffness.h);
// T moves the members of each group as one rigid body, and all it needs is where they are.
#pragma once
#include "simulate/linear/transfer.h"

namespace flexel::simulate {

// What a level's prolongator is made from, besides the matrix.
struct Grouping {
  std::vector<std::uint32_t> aggregate_of;  // (rows)
  std::vector<Vec3> offset;                 // (rows x 3) m, from the aggregate's centre
  std::vector<float> fine_reach;            // (rows); empty for elements
  std::vector<double> coarse_reach;         // (aggregates)
};

class RigidTransfer {
 public:
  explicit RigidTransfer(Grouping groups);

  [[nodiscard]] const std::vector<std::uint32_t>& aggregate_of() const { return groups_.aggregate_of; }
  // The directions in which element i may follow its group: a projector; the identity where none is set.
  // Rows ascending.
  void restrain(std::vector<std::pair<std::uint32_t, Mat3>> free);
  // The transposed block of T in row i, which has an aggregate.
  [[nodiscard]] Eigen::Matrix<double, 6, 3> at(std::size_t i) const;
  // fine = T coarse; fine (rows x 3), coarse (aggregates x 6).
  void spread(const double* coarse, double* fine) const;
  // coarse = T^T r, r(i) (3).
  template <class Residual>
  void collect(const Residual& r, double* coarse) const;

 private:
  [[nodiscard]] const Mat3* restraint(std::size_t i) const;

  Grouping groups_;
  std::vector<std::uint32_t> begin_, members_;  // (aggregates + 1); ascending within an aggregate
  std::vector<std::uint8_t> restrained_;        // (rows); empty: none is
  std::vector<std::pair<std::uint32_t, Mat3>> free_;
};

inline RigidTransfer::RigidTransfer(Grouping groups)
    : groups_(std::move(groups)), begin_(groups_.coarse_reach.size() + 1, 0) {
  const auto& of = groups_.aggregate_of;
  for (const std::uint32_t a : of)
    if (a != kNoAggregate) ++begin_[a + 1];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  members_.resize(begin_.back());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t i = 0; i < of.size(); ++i)
    if (of[i] != kNoAggregate) members_[next[of[i]]++] = i;
}

inline void RigidTransfer::restrain(std::vector<std::pair<std::uint32_t, Mat3>> free) {
  free_ = std::move(free);
  restrained_.clear();
  if (free_.empty()) return;
  restrained_.assign(groups_.aggregate_of.size(), 0);
  for (const auto& [row, projector] : free_) restrained_[row] = 1;
}

// Null where it follows its group in all directions.
inline const Mat3* RigidTransfer::restraint(std::size_t i) const {
  if (restrained_.empty() || !restrained_[i]) return nullptr;
  const auto at = std::lower_bound(free_.begin(), free_.end(), i,
                                   [](const auto& each, std::size_t row) { return each.first < row; });
  return &at->second;
}

inline Eigen::Matrix<double, 6, 3> RigidTransfer::at(std::size_t i) const {
  Eigen::Matrix<double, 6, 3> block =
      rigid_motion<3>(groups_.offset[i], 0, groups_.coarse_reach[groups_.aggregate_of[i]]);
  if (const Mat3* projector = restraint(i)) block = (block * *projector).eval();
  return block;
}

inline void RigidTransfer::spread(const double* coarse, double* fine) const {
  parallel_for_each(groups_.aggregate_of.size(), [&](std::size_t i) {
    const std::uint32_t a = groups_.aggregate_of[i];
    Vec3 moved = Vec3::Zero();
    if (a != kNoAggregate) {
      const Eigen::Map<const Vec3> shift(coarse + 6 * std::size_t{a}), turn(coarse + 6 * std::size_t{a} + 3);
      moved = shift + turn.cross(groups_.offset[i]) / groups_.coarse_reach[a];
      if (const Mat3* projector = restraint(i)) moved = (*projector * moved).eval();
    }
    Eigen::Map<Vec3>(fine + 3 * i) = moved;
  });
}

template <class Residual>
void RigidTransfer::collect(const Residual& r, double* coarse) const {
  parallel_for_each(
      begin_.size() - 1,
      [&](std::size_t a) {
        Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
        for (std::uint32_t m = begin_[a]; m < begin_[a + 1]; ++m) {
          const std::uint32_t i = members_[m];
          Vec3 pull = r(i);
          if (const Mat3* projector = restraint(i)) pull = (*projector * pull).eval();
          force += pull;
          moment += groups_.offset[i].cross(pull);
        }
        Eigen::Map<Vec3>(coarse + 6 * a) = force;
        Eigen::Map<Vec3>(coarse + 6 * a + 3) = moment / groups_.coarse_reach[a];
      },
      32);
}

}  // namespace flexel::simulate
