// A force and a couple that turn with what they act on.
//
// Points at rest X_q with shares w_q of a face, each carried by nodes, are now at x_q. With C and c their
// middles, Y_q = X_q - C, and A = sum_q w_q (x_q - c) Y_q^T, the face has turned by the rotation R of A =
// R S, S symmetric: that of the rigid motion nearest to its points' (Kabsch 1976). The forces are an
// averaging link's (matter/load_distribution.h) that has turned with it,
//     f_q = w_q R (F / sum w + b x Y_q),   b = (tr S 1 - S)^-1 M,   M = T + (at - C) x F,
// which are those whose work along any motion of the points is that of R F along c and of R M along the
// spin of R. So their sum is R F and their moment about c is R M, exactly, however the face has moved and
// been strained.
//
// They depend on the nodes through A alone, so the derivative has the rank 9 at most.
#pragma once
#include <functional>
#include <optional>

#include "simulate/followers/follower_load.h"
#include "simulate/matter/load_distribution.h"

namespace flexel::simulate {

class TurningLoad final : public FollowerLoad {
 public:
  // Calls each(node, weight) for the nodes that carry point q; the weights' sum is 1.
  using Carriers = std::function<void(std::size_t, const std::function<void(std::uint32_t, double)>&)>;

  // Of `force` [N], which acts at the point `at` [m, rest] or in the points' middle, and the couple
  // `torque` [N m]. Nothing where the points lie on a line, whose turn about itself nobody sees.
  [[nodiscard]] static std::optional<TurningLoad> make(const std::vector<LoadedPoint>& points,
                                                       const Carriers& carriers, const Vec3& force,
                                                       const Vec3& torque, const std::optional<Vec3>& at);

  void add_forces(const std::vector<Vec3>& displacement, double factor,
                  std::vector<Vec3>& forces) const override;
  void add_change(const std::vector<Vec3>& displacement, double factor, const std::vector<Vec3>& change,
                  std::vector<Vec3>& forces) const override;
  void add_transposed_change(const std::vector<Vec3>& displacement, double factor,
                             const std::vector<Vec3>& change, std::vector<Vec3>& forces) const override;
  void add_row_sums(double factor, std::vector<double>& sums) const override;
  [[nodiscard]] Vec3 turn(const std::vector<Vec3>& displacement, const Vec3& last) const override;

 private:
  struct Node {
    std::uint32_t at = 0;
    double weight = 0;        // of all weights, the sum is 1
    Vec3 arm = Vec3::Zero();  // m, sum_q w_q N(q) Y_q over the sum of the w_q
  };
  struct Frame {
    Mat3 turn, stretch;  // R; S, m^2
    Mat3 inverse;        // 1/m^2, (tr S 1 - S)^-1
    Vec3 spread;         // N/m, b
  };
  [[nodiscard]] Frame frame(const std::vector<Vec3>& displacement) const;

  std::vector<Node> nodes_;                            // ascending
  Mat3 rest_ = Mat3::Zero();                           // m^2, A at rest
  Vec3 force_ = Vec3::Zero(), moment_ = Vec3::Zero();  // N; N m, about the middle
};

}  // namespace flexel::simulate
