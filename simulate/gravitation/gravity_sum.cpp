// Eight masses side by side, so that the compiler can use wide registers; the eight sums are added in order.
#include "simulate/gravitation/gravity_sum.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kGravityLanes = 8, kGravityGrain = 32;

// The masses by component, filled up with masses of 0.
struct LaneMasses {
  std::vector<double> x, y, z, mass, radius;
};

LaneMasses columns_of(const PointMasses& points) {
  const std::size_t count = (points.mass.size() + kGravityLanes - 1) / kGravityLanes * kGravityLanes;
  LaneMasses columns;
  for (auto* column : {&columns.x, &columns.y, &columns.z, &columns.mass}) column->assign(count, 0);
  columns.radius.assign(count, 1);
  for (std::size_t i = 0; i < points.mass.size(); ++i) {
    columns.x[i] = points.position[i].x();
    columns.y[i] = points.position[i].y();
    columns.z[i] = points.position[i].z();
    columns.mass[i] = points.mass[i];
    columns.radius[i] = points.radius[i];
  }
  return columns;
}

using Sums = std::array<double, kGravityLanes>;

double total(const Sums& sums) {
  double sum = 0;
  for (const double value : sums) sum += value;
  return sum;
}

}  // namespace

Pull pull_of(double mass, const Vec3& offset, double reach) {
  const double distance = offset.norm(), inverse = 1 / std::max(distance, reach), inside = distance * inverse,
               tide = mass * inverse * inverse * inverse;
  return {tide * offset, -mass * inverse * (1.5 - 0.5 * inside * inside), tide};
}

Attraction attraction_by_pairs(const PointMasses& points) {
  const std::size_t count = points.mass.size();
  const LaneMasses all = columns_of(points);
  Attraction result;
  result.field.resize(count);
  result.potential.resize(count);
  result.tide.resize(count);
  parallel_for_each(
      count,
      [&](std::size_t i) {
        Sums x{}, y{}, z{}, potential{}, tide{};
        for (std::size_t begin = 0; begin < all.x.size(); begin += kGravityLanes)
          for (std::size_t l = 0; l < kGravityLanes; ++l) {
            const std::size_t j = begin + l;
            const double dx = all.x[j] - all.x[i], dy = all.y[j] - all.y[i], dz = all.z[j] - all.z[i];
            const double distance = std::sqrt(dx * dx + dy * dy + dz * dz),
                         reach = 0.5 * (all.radius[i] + all.radius[j]),
                         inverse = 1 / (distance > reach ? distance : reach), inside = distance * inverse,
                         mass = j == i ? 0 : all.mass[j], cubed = mass * (inverse * inverse * inverse);
            x[l] += cubed * dx;
            y[l] += cubed * dy;
            z[l] += cubed * dz;
            potential[l] -= mass * inverse * (1.5 - 0.5 * inside * inside);
            tide[l] += cubed;
          }
        result.field[i] = Vec3(total(x), total(y), total(z));
        result.potential[i] = total(potential);
        result.tide[i] = total(tide);
      },
      kGravityGrain);
  return result;
}

}  // namespace flexel::simulate
