// Points in parallel; what they give the nodes is summed in the points' order.
#include "simulate/followers/pressing_load.h"

#include <Eigen/Geometry>

#include "base/parallel.h"

namespace flexel::simulate {
namespace {

// Half of the derivative of cof(F) along G is that bilinear map with cof(F) = half_change(F, F).
Mat3 half_change(const Mat3& f, const Mat3& g) {
  Mat3 made;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    made.col(i) = 0.5 * (f.col(j).cross(g.col(k)) + g.col(j).cross(f.col(k)));
  }
  return made;
}

}  // namespace

void PressingLoad::add_point(std::span<const std::uint32_t> nodes, std::span<const double> values,
                             std::span<const Vec3> gradients, const Vec3& area_vector) {
  points_.push_back({nodes_.size(), nodes_.size() + nodes.size(), area_vector});
  nodes_.insert(nodes_.end(), nodes.begin(), nodes.end());
  values_.insert(values_.end(), values.begin(), values.end());
  gradients_.insert(gradients_.end(), gradients.begin(), gradients.end());
}

Mat3 PressingLoad::gradient(const Point& point, const std::vector<Vec3>& values) const {
  Mat3 sum = Mat3::Zero();
  for (std::size_t i = point.begin; i < point.end; ++i) sum += values[nodes_[i]] * gradients_[i].transpose();
  return sum;
}

void PressingLoad::spread(const std::vector<Vec3>& point_forces, std::vector<Vec3>& forces) const {
  for (std::size_t q = 0; q < points_.size(); ++q)
    for (std::size_t i = points_[q].begin; i < points_[q].end; ++i)
      forces[nodes_[i]] += values_[i] * point_forces[q];
}

void PressingLoad::add_forces(const std::vector<Vec3>& displacement, double factor,
                              std::vector<Vec3>& forces) const {
  std::vector<Vec3> point_forces(points_.size());
  parallel_for_each(points_.size(), [&](std::size_t q) {
    const Mat3 f = Mat3::Identity() + gradient(points_[q], displacement);
    point_forces[q] = -factor * pressure_ * (half_change(f, f) * points_[q].area_vector);
  });
  spread(point_forces, forces);
}

void PressingLoad::add_change(const std::vector<Vec3>& displacement, double factor,
                              const std::vector<Vec3>& change, std::vector<Vec3>& forces) const {
  std::vector<Vec3> point_forces(points_.size());
  parallel_for_each(points_.size(), [&](std::size_t q) {
    const Mat3 f = Mat3::Identity() + gradient(points_[q], displacement);
    point_forces[q] =
        -2 * factor * pressure_ * (half_change(f, gradient(points_[q], change)) * points_[q].area_vector);
  });
  spread(point_forces, forces);
}

// y . dcof(F)[G] A = dcof(F)[y A^T] : G, for both are the second derivative of det F.
void PressingLoad::add_transposed_change(const std::vector<Vec3>& displacement, double factor,
                                         const std::vector<Vec3>& change, std::vector<Vec3>& forces) const {
  std::vector<Mat3> by_gradient(points_.size());
  parallel_for_each(points_.size(), [&](std::size_t q) {
    const Mat3 f = Mat3::Identity() + gradient(points_[q], displacement);
    Vec3 value = Vec3::Zero();
    for (std::size_t i = points_[q].begin; i < points_[q].end; ++i) value += values_[i] * change[nodes_[i]];
    by_gradient[q] = -2 * factor * pressure_ * half_change(f, value * points_[q].area_vector.transpose());
  });
  for (std::size_t q = 0; q < points_.size(); ++q)
    for (std::size_t i = points_[q].begin; i < points_[q].end; ++i)
      forces[nodes_[i]] += by_gradient[q] * gradients_[i];
}

void PressingLoad::add_row_sums(double factor, std::vector<double>& sums) const {
  for (const Point& point : points_) {
    double gradients = 0;
    for (std::size_t i = point.begin; i < point.end; ++i) gradients += gradients_[i].norm();
    for (std::size_t i = point.begin; i < point.end; ++i)
      sums[nodes_[i]] += 2 * std::abs(factor * pressure_ * values_[i]) * point.area_vector.norm() * gradients;
  }
}

}  // namespace flexel::simulate
