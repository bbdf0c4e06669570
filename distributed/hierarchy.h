// What preconditions conjugate gradients on all ranks: Flexel's own multigrid (simulate/linear/multigrid.cpp) on the elements, PETSc's
// GAMG below (where few groups are left, a factorisation). Each rank groups the elements that it owns; the matrix of the groups is the sum of what each rank's cells make of it.
//
// The prolongator is P = T - w D^-1 A T, as there, but w = 0 at elements that several ranks have: so a rank's rows of P, and its share of
// P^T A P, come from its own cells alone. Of the elements nothing is stored but their groups.
#pragma once
#include <optional>

#include "distributed/piece_system.h"
#include "simulate/linear/level.h"
#include "simulate/linear/rigid_transfer.h"

namespace flexel::distributed {

class Hierarchy {
 public:
  // PETSc's options of the groups' solver begin with "-coarse_".
  explicit Hierarchy(PieceSystem& system);
  Hierarchy(const Hierarchy&) = delete;
  Hierarchy& operator=(const Hierarchy&) = delete;

  // Takes up the tangent at `displacement`; the groups stay. By all ranks together, as all that follows.
  void refresh(Vec displacement);
  // Likewise, but the matrix of the groups stays.
  void refresh_smoother();
  [[nodiscard]] bool made() const { return rigid_.has_value(); }
  // correction = M residual, symmetric.
  void apply(Vec residual, Vec correction);

 private:
  using Inverse = Eigen::Matrix3f;

  void make_groups();
  void choose_solver();
  std::vector<PetscInt> groups_of_others(const std::vector<std::uint32_t>& own);
  void make_coarse_vectors(const std::vector<PetscInt>& others);
  void make_coarse_matrix();
  [[nodiscard]] simulate::Grouping grouping(Vec displacement);
  void restrain(const std::vector<simulate::Block>& diagonal);
  std::vector<simulate::Block> make_smoother();
  [[nodiscard]] std::vector<simulate::Block> whole_diagonal();
  [[nodiscard]] double largest_eigenvalue();
  void fill_coarse_matrix();
  void mend_diagonal();
  void set_near_null_space();
  void scale(Vec residual, Vec to) const;
  void add_coarse(Vec residual, Vec x);

  PieceSystem& system_;
  Vector work_, image_, residual_, local_residual_, moved_, pulled_;
  std::vector<std::uint32_t> group_of_;  // (elements) this rank's groups first, then those of others
  PetscInt own_groups_ = 0, first_group_ = 0, all_groups_ = 0;
  std::optional<simulate::RigidTransfer> rigid_;
  simulate::Transfer<3> transfer_;         // without values
  simulate::Pattern pattern_;              // of the groups of this piece
  std::vector<Inverse> inverse_diagonal_;  // (elements that this rank owns)
  simulate::Chebyshev smoother_;
  double weight_ = 0;          // that P is smoothed with
  std::vector<Vec3> centre_;   // (groups of this piece) m
  std::vector<double> reach_;  // likewise
  struct Coarse {
    Numbering numbering;
    Vector right_hand_side, answer, local;
    Scatter to_local;
    Matrix matrix;
    Preconditioner solver;
  } coarse_;
};

}  // namespace flexel::distributed
