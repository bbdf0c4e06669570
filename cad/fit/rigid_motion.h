// The rigid motion that moves some points nearly as they went.
#pragma once
#include <gp_Trsf.hxx>
#include <gp_XYZ.hxx>
#include <vector>

namespace flexel::cad {

struct RigidMotion {
  gp_Trsf motion;
  double error = 0;  // largest distance of a moved point from where it went
  double mean =
      0;  // root of the mean square of these: no rigid motion leaves a smaller one, nor all within less
  bool none = false;  // no point moved at all, within `still`
};

// The best one in the sense of least squares (B. K. P. Horn, "Closed-form solution of absolute orientation using unit
// quaternions", 1987). `from` and `to`: as many points, one at least.
[[nodiscard]] RigidMotion rigid_motion(const std::vector<gp_XYZ>& from, const std::vector<gp_XYZ>& to,
                                       double still);

}  // namespace flexel::cad
