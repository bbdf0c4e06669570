// Along the plate's normal and across it; in the core of a rod the way out is by its face.
#include "simulate/indent/indenter_shape.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace flexel::simulate {
namespace {

Mat3 along(const Vec3& direction) {
  return direction * direction.transpose();
}

IndenterGap gap_to_ball(double radius, const Vec3& from_centre) {
  IndenterGap gap;
  const double length = from_centre.norm();
  gap.distance = length - radius;
  if (!(length > 0)) return gap;
  gap.gradient = from_centre / length;
  gap.curvature = (Mat3::Identity() - along(gap.gradient)) / length;
  return gap;
}

IndenterGap gap_to_plate(const IndenterShape& shape, const Vec3& normal, const Vec3& from_centre) {
  IndenterGap gap;
  const double before = from_centre.dot(normal);  // the face
  const Vec3 across = from_centre - before * normal;
  const double radius = across.norm();
  const double ahead = before + shape.rounding, beside = radius - (shape.radius - shape.rounding);
  if (beside <= 0) {
    gap.distance = before;
    gap.gradient = normal;
    return gap;
  }
  const Vec3 outward = across / radius, around = normal.cross(outward);
  if (ahead <= 0) {
    gap.distance = beside - shape.rounding;
    gap.gradient = outward;
    gap.curvature = along(around) / radius;
    return gap;
  }
  const double length = std::hypot(ahead, beside);
  gap.distance = length - shape.rounding;
  gap.gradient = (beside * outward + ahead * normal) / length;
  gap.curvature = along((ahead * outward - beside * normal) / length) / length +
                  beside / (length * radius) * along(around);
  return gap;
}

}  // namespace

IndenterGap gap_to(const IndenterShape& shape, const IndenterPlace& place, const Vec3& point) {
  const Vec3 from_centre = point - place.centre;
  return shape.plate ? gap_to_plate(shape, place.normal, from_centre)
                     : gap_to_ball(shape.radius, from_centre);
}

// The distance changes by no more than the way that is gone, so where it is large much of the way is passed over.
bool goes_through(const IndenterShape& shape, const std::array<IndenterPlace, 2>& places,
                  const std::array<Vec3, 2>& point) {
  constexpr double kDeep = 0.25;  // of the rounding
  const double deep = kDeep * shape.rounding;
  const Vec3 before = point[0] - places[0].centre, after = point[1] - places[1].centre;
  const double turned = (places[1].normal - places[0].normal).norm();
  const double way = (after - before).norm() + turned * std::max(before.norm(), after.norm());
  if (way <= 2 * deep) return false;
  for (double gone = 0; gone < 1;) {
    const IndenterPlace now{Vec3::Zero(),
                            ((1 - gone) * places[0].normal + gone * places[1].normal).normalized()};
    const double left = gap_to(shape, now, (1 - gone) * before + gone * after).distance + deep;
    if (left < 0) return true;
    gone += std::max(left, 0.5 * deep) / way;
  }
  return false;
}

}  // namespace flexel::simulate
