// Loads that turn with the surface that they act on (follower loads), over the nodes of any lattice: what
// they do and how that changes with the shape. Two kinds: turning_load.h (a force and a couple that turn
// with a face) and pressing_load.h (a pressure).
//
// Such a load has no energy in general: its work depends on the way (Ziegler, Principles of Structural
// Stability, 1968), and the derivative of its forces is not symmetric. In the plane the couple has one (M
// times the angle), and so has a pressure whose surface is closed or ends where it is held (p times the
// volume).
#pragma once
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

class FollowerLoad {
 public:
  virtual ~FollowerLoad() = default;

  // N, `factor` times the load, added to `forces` (nodes x 3) where the nodes have gone by `displacement`
  // (nodes x 3) m.
  virtual void add_forces(const std::vector<Vec3>& displacement, double factor,
                          std::vector<Vec3>& forces) const = 0;
  // N, how those forces change to first order along `change` (nodes x 3) m.
  virtual void add_change(const std::vector<Vec3>& displacement, double factor,
                          const std::vector<Vec3>& change, std::vector<Vec3>& forces) const = 0;
  // The same with the derivative transposed: `change` . (what is added by add_change() along x) = x .
  // (what is added here).
  virtual void add_transposed_change(const std::vector<Vec3>& displacement, double factor,
                                     const std::vector<Vec3>& change, std::vector<Vec3>& forces) const = 0;
  // N/m (nodes), added to `sums`: bounds on the sums of the absolute values in the rows of that
  // derivative, near rest.
  virtual void add_row_sums(double factor, std::vector<double>& sums) const = 0;
  // rad, the rotation vector of what the load turns with, counted on from `last`, so that whole turns
  // stay; zero for a pressure.
  [[nodiscard]] virtual Vec3 turn(const std::vector<Vec3>& displacement, const Vec3& last) const = 0;

 protected:
  FollowerLoad() = default;
  FollowerLoad(const FollowerLoad&) = default;
  FollowerLoad& operator=(const FollowerLoad&) = default;
};

}  // namespace flexel::simulate
