// A submodel of model `quadratic`: a box cut out of a part, with cells of half the size, held on its cut faces as the field of
// its parent goes there (submodelling, global-local analysis), and what it pulls there beside what
// the parent's own cells pulled, given back to the parent.
//
// The parent is the whole, or a submodel in its turn. With P the shape functions of the parent at the nodes of the cut faces, and
// the unbalanced forces r (right side less what the cells do) of the box in fine and in the parent's own cells,
//     s = P^T r_fine - P^T r_own
// is what the parent's equation lacks there. Solved for in turn (K e = s, then the box anew) both become the solution on cells of
// two sizes whose field has no gap on the faces between: each is a correction in the energy's subspace (fast adaptive composite
// grids; McCormick and Thomas, Math. Comput. 46, 1986), so they converge. For linear solutions.
#pragma once
#include <memory>

#include "formats/lattice/body.h"
#include "simulate/matter/voxel_pieces.h"
#include "simulate/quadratic/quadratic_solve.h"

namespace flexel::simulate {

class Submodel {
 public:
  // Voxels `lower` <= (i, j, k) < `upper` of the parent's lattice, each cut into ratio^3; `body` has them, and the whole surface.
  // Keeps a reference to the parent, which has one part. Throws InputError: it is not known which piece of matter at a cut face goes on
  // in which cell of the parent.
  Submodel(const QuadraticSystem& parent, Body body, const LatticeBox& box, int ratio, const Scene& scene);
  Submodel(const Submodel&) = delete;
  Submodel& operator=(const Submodel&) = delete;

  // What of the parent's lattice to cut out, as the body is to have it.
  [[nodiscard]] static LatticeBox finer(const LatticeBox& box, int ratio);

  [[nodiscard]] const QuadraticSystem& system() const { return *system_; }
  [[nodiscard]] const QuadraticSolution& solution() const { return solution_; }
  [[nodiscard]] const Body& body() const { return body_; }
  // Its voxels, in its own lattice.
  [[nodiscard]] const LatticeBox& box() const { return box_; }

  // Finds its equilibrium beside the parent's field `displacement` (nodes of the parent x 3) [m], `turns`: of cells that turn. Throws as
  // solve() and solve_large() do.
  void solve(const std::vector<Vec3>& displacement, bool turns);
  // Takes the parent's field in all its nodes, as it is.
  void take(const std::vector<Vec3>& displacement, double safety, bool turns);
  // Frees what it was solved with; its field stays.
  void forget() { solution_.tangent.reset(); }
  // (nodes of the parent x 3) N: adds `factor` times P^T r.
  void add_pull(double factor, std::vector<Vec3>& to) const;

 private:
  void solve_small();
  void solve_turned(const std::vector<Vec3>& displacement);
  void interpolate(const std::vector<Vec3>& displacement);
  // Where a node lies in the parent's field.
  struct Anchor {
    std::uint32_t node = 0, cell = 0;  // of this; index into the parent's QuadraticNodes::cells
    Vec3 at = Vec3::Zero();            // cell coordinates
  };
  class ParentCells;
  [[nodiscard]] std::vector<std::uint32_t> find_cut(const QuadraticNodes& nodes);
  [[nodiscard]] Vec3 value(const Anchor& anchor, const std::vector<Vec3>& displacement) const;
  [[nodiscard]] bool is_beyond(const FacePoint& point) const;

  const QuadraticSystem& parent_;
  int ratio_;
  LatticeBox parent_box_, box_;
  Body body_;
  Problem problem_;
  const Scene& scene_;
  std::vector<Anchor> cut_, all_;  // nodes on cut faces; all, where the parent has matter
  Surroundings surroundings_;
  std::unique_ptr<QuadraticSystem> system_;
  QuadraticSolution solution_;
};

}  // namespace flexel::simulate
