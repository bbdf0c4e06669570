// Rigid links and rigid parts of model `quadratic`: matter that moves as one rigid body, whose motion is found.
//
// Their motions q, six numbers each (the displacement of the middle; the rotation vector times the reach), lead what they hold as a
// [[move]] does. With q held the nodes find their equilibrium; what the links lack then, b(q) = load - pull, falls to 0 by
//     dq = -S^-1 b,   S = db/dq with the nodes following, K Y = df/dq,
// one linear solution Y a number, with the tangent that the nodes are solved with. The body's system is as well conditioned as one with held faces.
// S is kept as long as it serves and mended by what each step shows (Broyden 1965).
#pragma once
#include <functional>

#include "simulate/quadratic/quadratic_system.h"

namespace flexel::simulate {

// What is in equilibrium while the links are held.
struct LinkedNodes {
  std::vector<Vec3>& displacement;      // (nodes x 3) m
  const std::vector<Vec3>& unbalanced;  // (nodes x 3) N
  const std::vector<Mat3>& turns;       // (cells) R - 1; none: a linear solution
  const QuadraticOperator& stiffness;   // the tangent
  std::function<bool()> hold;           // brings the nodes to equilibrium
  std::function<bool()> evaluate;       // `unbalanced` and `turns` of the displacement as it is
  std::function<void()> make_tangent;
  std::function<bool(const std::vector<Vec3>&, std::vector<Vec3>&)> solve;  // K x = b
};

class LinkBalance {
 public:
  // Keeps a reference.
  explicit LinkBalance(const QuadraticSystem& system) : system_(system) {}

  [[nodiscard]] bool any() const { return !system_.linked().empty(); }
  // Arms and turns as they are at rest, or as they are.
  void take_small(bool small) const;
  // (6 x links) q; at first 0.
  [[nodiscard]] Eigen::VectorXd motions() const;
  void set_motions(const Eigen::VectorXd& q) const;

  // Moves the links and the nodes, which are in equilibrium, until no more than `tolerance` of the forces is lacking at `share` of the
  // load. False: it was not found. Throws InputError, named for the link, where nothing resists a motion of it.
  [[nodiscard]] bool find(LinkedNodes& nodes, double share, double safety, double tolerance);
  // Whether an equilibrium is stable in the motions of the links (simulate/conditions/link_stability.h). Nothing: that does
  // not tell.
  [[nodiscard]] std::optional<bool> stable(LinkedNodes& nodes, double share, double safety);

 private:
  [[nodiscard]] Eigen::VectorXd lacking(const LinkedNodes& nodes, double share, double safety) const;
  [[nodiscard]] double forces(const LinkedNodes& nodes, double share, double safety) const;
  [[nodiscard]] bool find_slope(LinkedNodes& nodes, double share, double safety);
  [[nodiscard]] bool add_column(LinkedNodes& nodes, double share, double safety, Eigen::Index number,
                                std::vector<Vec3>& left);
  [[nodiscard]] double turn_of(const Eigen::VectorXd& step) const;
  void refuse_free() const;
  // Moves the links by `step` and the nodes as they answer to it.
  void go(LinkedNodes& nodes, const Eigen::VectorXd& step) const;
  // find() where there are links; false leaves an S that may serve nobody.
  [[nodiscard]] bool balance(LinkedNodes& nodes, double share, double safety, double tolerance);

  const QuadraticSystem& system_;
  Eigen::MatrixXd slope_;                     // S [N/m]; none: not known
  Eigen::VectorXd made_at_;                   // q, where it was made
  std::vector<std::vector<Vec3>> responses_;  // Y (6 x links) x (nodes x 3) [m/m]
};

}  // namespace flexel::simulate
