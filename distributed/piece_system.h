// The mechanics of a piece's cells, by simulate/models/cells.h, and their sums over all ranks as vectors and a matrix of PETSc's.
// Elements that several ranks have are summed up where their unknowns are. Every function is called by all ranks together.
#pragma once
#include "distributed/petsc.h"
#include "distributed/piece.h"
#include "simulate/models/cells.h"
#include "simulate/scene/scene.h"

namespace flexel::distributed {

class PieceSystem {
 public:
  // Materials and models are the scene's. Throws InputError as they do.
  PieceSystem(Piece piece, const simulate::Scene& scene);
  PieceSystem(const PieceSystem&) = delete;
  PieceSystem& operator=(const PieceSystem&) = delete;

  // Zero, over all unknowns.
  [[nodiscard]] Vector vector() const;
  // 1 where nothing prescribes an unknown, else 0.
  [[nodiscard]] Vec free() const { return free_; }
  [[nodiscard]] Mat matrix() const { return matrix_; }

  // J: of the cells, of what effects add, and of `outer` [N], the forces that do not change; infinity where a cell
  // has J <= 0.
  [[nodiscard]] double energy(Vec displacement, Vec outer);
  // N: of the cells; and of what effects add, beside `outer`.
  void forces(Vec displacement, Vec outer, Vec inner, Vec of_effects);
  // Pa (cells of the piece): Cells::predicted_stress() at `before` for the step from there to `now`.
  [[nodiscard]] std::vector<Mat3> predicted_stress(Vec before, Vec now);
  // The tangent at `displacement`, prescribed components eliminated, into matrix(). `pulled` becomes the product with `gap` of
  // the tangent before that, unless `gap` is null.
  void assemble(Vec displacement, const simulate::TangentOptions& tangent, Vec gap, Vec pulled);

 private:
  void make_vectors();
  void make_matrix();
  void set_near_null_space();
  [[nodiscard]] std::vector<Vec3> local(Vec values);
  void add(const std::vector<Vec3>& values, Vec to);
  [[nodiscard]] std::vector<Vec3> added_product(const std::vector<Vec3>& displacement) const;
  void insert_rows();

  Piece piece_;
  simulate::Problem problem_;
  simulate::StiffnessPattern pattern_;
  simulate::Cells cells_;
  simulate::Constraints constraints_;  // its mask alone
  Numbering numbering_;
  Vector global_, local_, free_;
  Scatter to_local_;
  Matrix matrix_;
};

}  // namespace flexel::distributed
