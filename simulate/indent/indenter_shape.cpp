// Along the plate's normal and across it; in the core of a rod the way out is by its face.
#include "simulate/indent/indenter_shape.h"

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

}  // namespace flexel::simulate
