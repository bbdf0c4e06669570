// Boxes are halved at the middle triangle along their longest side, and the nearer half is looked into first.
#include "formats/part/nearest_polygon.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/math/distance.h"

namespace flexel {
namespace {

constexpr std::uint32_t kFew = 8;      // triangles of a box that is not halved
constexpr std::size_t kFewPoints = 4;  // that take no longer without a tree

double distance_from(const Vec3& point, const Vec3& low, const Vec3& high) {
  return (low - point).cwiseMax(point - high).cwiseMax(0.0).norm();
}

}  // namespace

NearestPolygon::NearestPolygon(const Surface& surface, std::size_t points)
    : surface_(surface), triangles_(triangulate(surface)), order_(triangles_.corners.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  const auto count = static_cast<std::uint32_t>(order_.size());
  if (count > 0) halve(0, count, points <= kFewPoints ? count : kFew);
}

void NearestPolygon::halve(std::uint32_t begin, std::uint32_t end, std::uint32_t few) {
  Box box{corner(order_[begin], 0), corner(order_[begin], 0), begin, end};
  for (std::uint32_t i = begin; i < end; ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      box.low = box.low.cwiseMin(corner(order_[i], c));
      box.high = box.high.cwiseMax(corner(order_[i], c));
    }
  const std::size_t own = boxes_.size();
  boxes_.push_back(box);
  if (end - begin <= few) return;
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const auto middle = [&](std::uint32_t t) {
    return corner(t, 0)[axis] + corner(t, 1)[axis] + corner(t, 2)[axis];
  };
  const std::uint32_t half = begin + (end - begin) / 2;
  std::nth_element(
      order_.begin() + begin, order_.begin() + half, order_.begin() + end,
      [&](std::uint32_t a, std::uint32_t b) { return std::pair(middle(a), a) < std::pair(middle(b), b); });
  halve(begin, half, few);
  boxes_[own].second = static_cast<std::uint32_t>(boxes_.size());
  halve(half, end, few);
}

// Of triangles equally near the one of lowest number, whatever order the boxes are looked into.
void NearestPolygon::consider(std::uint32_t triangle, const Vec3& point, double same, Best& best) const {
  const Vec3 &a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
  const Vec3 at = nearest_of_triangle(point, a, b, c);
  const bool outside = (point - at).dot((b - a).cross(c - a)) > 0;
  const double distance = (point - at).norm(), rank = distance + (outside ? same : 0);
  const std::uint32_t polygon = triangles_.polygon[triangle];
  if (best.found && (rank > best.rank || (rank == best.rank && polygon >= best.found->polygon))) return;
  best.rank = rank;
  best.found = NearPolygon{polygon, at, distance, outside};
}

void NearestPolygon::look_into(std::uint32_t box, const Vec3& point, double same,
                               const std::function<bool(std::uint32_t)>& counts, Best& best) const {
  const auto away = [&](std::uint32_t of) { return distance_from(point, boxes_[of].low, boxes_[of].high); };
  if (best.found && away(box) > best.rank) return;
  const Box& own = boxes_[box];
  if (own.second == 0) {
    for (std::uint32_t i = own.begin; i < own.end; ++i)
      if (counts(triangles_.polygon[order_[i]])) consider(order_[i], point, same, best);
    return;
  }
  const std::uint32_t first = box + 1, second = own.second;
  const bool swapped = away(second) < away(first);
  look_into(swapped ? second : first, point, same, counts, best);
  look_into(swapped ? first : second, point, same, counts, best);
}

std::optional<NearPolygon> NearestPolygon::find(const Vec3& point, double same,
                                                const std::function<bool(std::uint32_t)>& counts) const {
  Best best;
  if (!boxes_.empty()) look_into(0, point, same, counts, best);
  return best.found;
}

}  // namespace flexel
