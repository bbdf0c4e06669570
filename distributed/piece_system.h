// The mechanics of a piece's cells, by simulate/equilibrium/mechanics.h, and their sums over all ranks as vectors and an operator of PETSc's.
// The tangent is not stored: a product is that of each rank's cells, summed up. Elements that several ranks have are summed up where
// their unknowns are. Every function is called by all ranks together, but for what only reads.
#pragma once
#include "distributed/petsc.h"
#include "distributed/piece.h"
#include "simulate/equilibrium/mechanics.h"
#include "simulate/scene/scene.h"

namespace flexel::distributed {

class PieceSystem {
 public:
  // Materials and models are the scene's. Throws InputError as they do.
  PieceSystem(Piece piece, const simulate::Scene& scene);
  PieceSystem(const PieceSystem&) = delete;
  PieceSystem& operator=(const PieceSystem&) = delete;

  // Zero, over all unknowns; over those of the elements of this piece.
  [[nodiscard]] Vector vector() const;
  [[nodiscard]] Vector local_vector() const;
  // 1 where nothing prescribes an unknown, else 0.
  [[nodiscard]] Vec free() const { return free_; }
  // The tangent of all ranks, a shell.
  [[nodiscard]] Mat matrix() const { return matrix_; }
  // What this rank adds to it: of all rows but those of shared() elements it is the whole.
  [[nodiscard]] const simulate::LinearOperator& own() const { return mechanics_.tangent(); }
  [[nodiscard]] const Body& body() const { return piece_.body; }
  // (elements) 1: other ranks have it too.
  [[nodiscard]] const std::vector<std::uint8_t>& shared() const { return shared_; }
  // (elements) place among the unknowns of this rank; -1: another's.
  [[nodiscard]] const std::vector<PetscInt>& places() const { return place_; }
  [[nodiscard]] PetscInt owned() const { return piece_.owned; }

  // Values of all unknowns to those of this piece's elements, and the sum of these over the ranks, added.
  void forward(Vec from, Vec to_local);
  void add(Vec local, Vec to);
  [[nodiscard]] std::vector<Vec3> local(Vec values);
  void add(const std::vector<Vec3>& values, Vec to);
  // y = A x
  void multiply(Vec x, Vec y);
  void diagonal(Vec to);

  // J: of the cells, of what effects add, and of `outer` [N], the forces that do not change; infinity where a cell
  // has J <= 0.
  [[nodiscard]] double energy(Vec displacement, Vec outer);
  // Of the cells of all ranks, which are named by their numbers in the whole body.
  [[nodiscard]] simulate::CellsElsewhere::Figures figures(Vec displacement);
  // N: of the cells; and of what effects add, beside `outer`.
  void forces(Vec displacement, Vec outer, Vec inner, Vec of_effects);
  // Pa (cells of the piece): Cells::predicted_stress() at `before` for the step from there to `now`.
  [[nodiscard]] std::vector<Mat3> predicted_stress(Vec before, Vec now);
  // Takes up the tangent at `displacement`, prescribed components eliminated, as matrix(). `pulled` becomes the product with
  // `gap` of the tangent before that, unless `gap` is null.
  void assemble(Vec displacement, const simulate::TangentOptions& tangent, Vec gap, Vec pulled);

 private:
  void make_vectors();
  void make_matrix();
  void product(Vec x, Vec y);

  Piece piece_;
  simulate::Problem problem_;
  simulate::Mechanics mechanics_;
  Vector global_, local_, image_, free_;
  Scatter to_local_;
  Matrix matrix_;
  std::vector<std::uint8_t> shared_;  // (elements)
  std::vector<PetscInt> place_;       // (elements)
};

}  // namespace flexel::distributed
