// A pressure that stays normal to the surface as that turns and stretches.
//
// A point of the surface with the outward area vector A at rest has the area vector cof(F) A now
// (Nanson), F = 1 + grad u, so the force on it is f_q = -p cof(F) A. Over a closed surface, or one that
// ends where it is held, that is the derivative of p times the volume, and the derivative of the forces
// is symmetric but for quadrature.
#pragma once
#include <cstdint>
#include <span>

#include "simulate/followers/follower_load.h"

namespace flexel::simulate {

class PressingLoad final : public FollowerLoad {
 public:
  explicit PressingLoad(double pressure) : pressure_(pressure) {}  // Pa, against the surface

  // A point of the surface: the nodes that carry it, the values there of their shape functions and the
  // gradients of those (1/m, world frame, rest), and its outward area vector [m^2] at rest.
  void add_point(std::span<const std::uint32_t> nodes, std::span<const double> values,
                 std::span<const Vec3> gradients, const Vec3& area_vector);

  void add_forces(const std::vector<Vec3>& displacement, double factor,
                  std::vector<Vec3>& forces) const override;
  void add_change(const std::vector<Vec3>& displacement, double factor, const std::vector<Vec3>& change,
                  std::vector<Vec3>& forces) const override;
  void add_transposed_change(const std::vector<Vec3>& displacement, double factor,
                             const std::vector<Vec3>& change, std::vector<Vec3>& forces) const override;
  void add_row_sums(double factor, std::vector<double>& sums) const override;
  [[nodiscard]] Vec3 turn(const std::vector<Vec3>&, const Vec3&) const override { return Vec3::Zero(); }

 private:
  struct Point {
    std::size_t begin = 0, end = 0;  // of the three vectors below
    Vec3 area_vector = Vec3::Zero();
  };
  [[nodiscard]] Mat3 gradient(const Point& point, const std::vector<Vec3>& values) const;
  void spread(const std::vector<Vec3>& point_forces, std::vector<Vec3>& forces) const;

  double pressure_;
  std::vector<Point> points_;
  std::vector<std::uint32_t> nodes_;
  std::vector<double> values_;
  std::vector<Vec3> gradients_;
};

}  // namespace flexel::simulate
