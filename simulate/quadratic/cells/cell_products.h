// Products with the stiffness of the cells of model `quadratic`, made from their moments; no matrix is kept but those of
// supports. Eight cells of a part at a time, by the kernels of kernel_quadratic.h.
#pragma once
#include <concepts>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "simulate/kernels/kernel_quadratic_matrix.h"
#include "simulate/quadratic/cells/cell_integrals.h"
#include "simulate/quadratic/cells/quadratic_nodes.h"

namespace flexel::simulate {

// What large deflections make of a cell's matrix K: R (K + a gamma^T + gamma a^T) R^T, node by node
// (simulate/quadratic/corotation.h).
struct CellTurn {
  using Columns = Eigen::Matrix<double, kCellUnknowns, 3>;
  Mat3 rotation = Mat3::Identity();
  Columns a = Columns::Zero(), gamma = Columns::Zero();
};

// What joins cells of different parts (nitsche_bond.h): their cross stiffness, in the world frame. What it adds to either
// cell's own stiffness is a support of it.
struct CellCouplings {
  std::vector<std::array<std::uint32_t, 2>> pairs;  // cells
  std::vector<CellMatrix> cross;                    // (pairs) rows: the first cell; columns: the second
  std::vector<std::uint32_t> cells;                 // that are in any pair, ascending
  // (cells + 1) and (2 x pairs): 2 pair + side of each of them, ascending
  std::vector<std::uint32_t> offsets, of_cell;
  std::vector<std::int32_t> place;  // (all cells) in `cells`, or -1

  CellCouplings(std::vector<std::array<std::uint32_t, 2>> pairs_of_cells, std::size_t cell_count);
};

// Of a cell: the lower triangle of its matrix by blocks of its 27 nodes, and that of the trilinear field over its corners.
// Block a >= b is at block_place(a, b), row by row (simulate/kernels/kernel_quadratic_matrix.h) [N/m].
struct CellBlocks {
  std::array<double, quadratic_kernel::kNodeMatrix> nodes;
  std::array<double, quadratic_kernel::kCornerMatrix> corners;
};
using CornerMatrix = Eigen::Matrix<double, 24, 24>;
// P^T M P, P the trilinear field at the nodes of a cell.
[[nodiscard]] CornerMatrix corners_of(const CellMatrix& matrix);

// K x of up to eight columns.
using CellColumns = Eigen::Matrix<double, kCellUnknowns, 8>;

// `Number`: what is summed within a cell; double, or float for a preconditioner.
template <class Number>
class CellProducts {
 public:
  struct PartCells {
    quadratic_kernel::Elasticity<double> elasticity;
    Mat3 axes;  // of the lattice, in the world frame
  };
  // Keeps a reference to `nodes`. `part`: (cells). `moments` of a cell; none where it is whole.
  CellProducts(const QuadraticNodes& nodes, const std::vector<PartCells>& parts,
               const std::vector<std::uint32_t>& part,
               const std::function<std::optional<Moments>(std::size_t)>& moments);
  // The same in another precision.
  template <class Other>
  explicit CellProducts(const CellProducts<Other>& other);

  // Room for the matrices of these cells' supports, before they are set from several threads.
  void reserve_supports(const std::vector<std::uint32_t>& cells);
  // What supports add to K, symmetric.
  void set_support(std::size_t cell, const CellMatrix& matrix);
  // `couplings` may change as long as nothing is multiplied; none: no parts are bonded.
  void set_couplings(std::shared_ptr<const CellCouplings> couplings) { couplings_ = std::move(couplings); }
  [[nodiscard]] const CellCouplings* couplings() const { return couplings_.get(); }
  // (cells) From now on every cell is turned; what `more` has is added to `a` (none: nothing).
  void turn(const std::vector<CellTurn>& turns, const std::vector<CellTurn::Columns>& more = {});

  // y (nodes x 3) N = K x, x (nodes x 3) m; in parallel, the same bits for any thread count.
  void forces(const double* x, double* y) const;
  // K x of a cell without its supports and before it was turned.
  void elastic_forces(std::size_t cell, const CellColumns& x, CellColumns& product) const;
  // Of a cell, as forces() takes it.
  [[nodiscard]] CellMatrix matrix(std::size_t cell) const requires std::same_as<Number, double>;
  // (cells) a cell that has the same matrix, the same one for all of those, and the first of them.
  [[nodiscard]] std::vector<std::uint32_t> twins() const;
  // Calls take(cell, matrices) for each cell that is its own twin, as forces() takes it; from several threads.
  void matrices(const std::function<void(std::uint32_t, const CellBlocks&)>& take)
      const requires std::same_as<Number, double>;

  [[nodiscard]] bool is_supported(std::size_t cell) const {
    return !support_at_.empty() && support_at_[cell] >= 0;
  }
  // Share of the voxel.
  [[nodiscard]] double fill(std::size_t cell) const;

 private:
  template <class>
  friend class CellProducts;

  struct Eight {
    std::array<std::uint32_t, 8> cell{};
    std::uint32_t count = 0, part = 0;
    bool whole = false;
    std::size_t moments = 0;  // where they begin
  };
  struct Part {
    quadratic_kernel::Elasticity<Number> elasticity;
    Mat3 axes;
    bool along_world;  // the axes are the world's
  };
  void apply(std::size_t eight, Number* values) const;
  // N: R S R^T x of a cell, in its unit.
  [[nodiscard]] Eigen::Matrix<double, kCellUnknowns, 1> support_forces(std::size_t cell,
                                                                       const double* x) const;
  void add_coupled(const double* x) const;
  [[nodiscard]] CellMatrix support(std::size_t cell) const;  // R S R^T
  // Of the cells of an eight in the axes of their lattice, as they were at first: to `nodes` and `corners`, side by side.
  void first_matrices(const Eight& eight, std::vector<double>& nodes,
                      std::vector<double>& corners) const requires std::same_as<Number, double>;
  // What turning and supports make of those of a cell.
  void turn_blocks(std::size_t cell, CellBlocks& blocks) const requires std::same_as<Number, double>;

  const QuadraticNodes* nodes_;
  std::vector<Part> parts_;
  std::vector<Eight> eights_;
  double unit_ = 1;                       // of the stiffness as it is kept [N/m]: floats have a narrow range
  std::vector<std::uint32_t> place_;      // (cells) 8 eight + lane
  std::vector<Number> moments_;           // 27 x 8 of whole cells, then 125 x 8 of each eight that is not
  std::vector<Number> first_rotation_;    // (parts x 9 x 8) from the world's axes to the lattice's
  std::vector<Number> rotation_;          // (eights x 9 x 8); none: not turned
  std::vector<Number> a_, gamma_;         // (eights x 243 x 8)
  std::vector<Mat3> turned_;              // (cells) R; none: not turned
  std::vector<std::int32_t> support_at_;  // (cells) or -1; none: no supports
  std::vector<double> support_;           // (supported cells x 81 x 82 / 2) lower triangle, row by row
  std::shared_ptr<const CellCouplings> couplings_;
  mutable std::vector<Number> cell_force_;  // (cells x 81)
};

}  // namespace flexel::simulate
