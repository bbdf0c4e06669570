// Block Jacobi: every unknown element is corrected by the inverse of its own 3x3 block. Cheap to set up, but
// the iterations grow with the number of cells along the part.
#include "simulate/linear/block_jacobi.h"
#include "base/parallel.h"
#include "simulate/linear/block_inverse.h"
#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {
namespace {

class BlockJacobi : public Preconditioner {
 public:
  explicit BlockJacobi(const BlockMatrix& matrix) : matrix_(matrix) { refresh(); }

  void apply(const std::vector<Vec3>& residual, std::vector<Vec3>& correction) const override {
    correction.resize(inverse_.size());
    parallel_for_each(inverse_.size(),
                      [&](std::size_t row) { correction[row] = inverse_[row] * residual[row]; });
  }

  void refresh() override {
    inverse_.resize(matrix_.rows());
    const double floor = 1e-14 * largest_diagonal(matrix_);
    parallel_for_each(inverse_.size(), [&](std::size_t row) {
      inverse_[row] = guarded_inverse<3>(matrix_.values[diagonal_position(matrix_, row)], floor);
    });
  }

 private:
  const BlockMatrix& matrix_;
  std::vector<Mat3> inverse_;  // (rows)
};

}  // namespace

std::unique_ptr<Preconditioner> block_jacobi(const BlockMatrix& matrix) {
  return std::make_unique<BlockJacobi>(matrix);
}

}  // namespace flexel::simulate
