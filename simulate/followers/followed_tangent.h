// A tangent stiffness with what loads that follow the shape add to it, which is not symmetric: for
// gmres(). Preconditioners are made of the stiffness alone, beside which loads are small.
#pragma once
#include <functional>

#include "simulate/linear/operator.h"

namespace flexel::simulate {

class FollowedTangent final : public LinearOperator {
 public:
  // Adds how the loads' forces change along x to `change`, or the same with the derivative transposed;
  // (rows x 3) both.
  using LoadChange =
      std::function<void(const std::vector<Vec3>& x, bool transposed, std::vector<Vec3>& change)>;

  // Keeps references. `held`: (rows) bit i: component i is prescribed, and its row is that of the
  // stiffness; none: no component is. `symmetric`: the symmetric part of the whole, for
  // conjugate_gradients(): where that is positive, so is the determinant, and no equilibrium branches
  // off.
  FollowedTangent(const LinearOperator& stiffness, const std::vector<std::uint8_t>& held, LoadChange loads,
                  bool symmetric = false)
      : stiffness_(stiffness), held_(held), loads_(std::move(loads)), symmetric_(symmetric) {}

  [[nodiscard]] std::span<const std::uint64_t> row_offsets() const override {
    return stiffness_.row_offsets();
  }
  [[nodiscard]] std::span<const std::uint32_t> columns() const override { return stiffness_.columns(); }
  void multiply(const double* x, double* y) const override;
  // Of the stiffness alone.
  [[nodiscard]] const Block* blocks(std::size_t begin, std::size_t end,
                                    std::vector<Block>& room) const override {
    return stiffness_.blocks(begin, end, room);
  }
  [[nodiscard]] std::vector<Block> diagonal() const override { return stiffness_.diagonal(); }

 private:
  const LinearOperator& stiffness_;
  const std::vector<std::uint8_t>& held_;
  LoadChange loads_;
  bool symmetric_;
};

}  // namespace flexel::simulate
