// A uniform grid with buckets of one spacing (larger where the part fills little of its box, so that there
// are not many more buckets than elements), filled by a counting sort. A query searches the bucket of the
// point, clamped into the grid, then shells of buckets around it, until no bucket farther out can hold a
// nearer element. For a query q outside the box, with p the nearest point of the box, |q - x|^2 >= |q - p|^2
// + |p - x|^2 for every x of the box gives the bound.
#include "mapping/anchors/nearest.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexel::mapping {
namespace {

constexpr double kNearestTie = 1e-9;  // of a squared distance

}  // namespace

ElementGrid::ElementGrid(const Body& body, std::uint32_t part) {
  const Part& of = body.parts[part];
  const std::uint32_t n = of.element_end - of.element_begin;
  to_local_ = of.lattice.axes.transpose();
  world_origin_ = of.lattice.origin;
  std::vector<Vec3> points(n);
  Box box;
  for (std::uint32_t e = 0; e < n; ++e) {
    points[e] = to_local_ * (body.rest[of.element_begin + e] - world_origin_);
    box.add(points[e]);
  }
  world_origin_ += of.lattice.axes * box.min;
  size_ = box.size();
  width_ = of.lattice.spacing;
  const auto buckets = [&] { return ((size_.cwiseQuotient(width_).array().floor() + 1).prod()); };
  while (buckets() > 4.0 * n + 64.0) width_ *= 2;
  for (int axis = 0; axis < 3; ++axis)
    count_[axis] = static_cast<std::int64_t>(std::floor(size_[axis] / width_[axis])) + 1;
  for (Vec3& point : points) point -= box.min;
  const auto flat = [&](const Vec3& point) {
    const auto [i, j, k] = bucket_of(point);
    return static_cast<std::size_t>((k * count_[1] + j) * count_[0] + i);
  };
  offsets_.assign(static_cast<std::size_t>(count_[0] * count_[1] * count_[2]) + 1, 0);
  for (const Vec3& point : points) ++offsets_[flat(point) + 1];
  for (std::size_t b = 1; b < offsets_.size(); ++b) offsets_[b] += offsets_[b - 1];
  std::vector<std::uint32_t> next(offsets_.begin(), offsets_.end() - 1);
  elements_.resize(n);
  local_.resize(n);
  for (std::uint32_t e = 0; e < n; ++e) {
    const std::uint32_t slot = next[flat(points[e])]++;
    elements_[slot] = of.element_begin + e;
    local_[slot] = points[e];
  }
}

std::array<std::int64_t, 3> ElementGrid::bucket_of(const Vec3& local) const {
  std::array<std::int64_t, 3> bucket{};
  for (int axis = 0; axis < 3; ++axis)
    bucket[axis] = std::min(static_cast<std::int64_t>(local[axis] / width_[axis]), count_[axis] - 1);
  return bucket;
}

void ElementGrid::look_into(std::int64_t i_begin, std::int64_t i_end, std::int64_t j, std::int64_t k,
                            const Vec3& local, Best& best) const {
  const std::size_t row = static_cast<std::size_t>((k * count_[1] + j) * count_[0]);
  const std::uint32_t end = offsets_[row + static_cast<std::size_t>(i_end)];
  for (std::uint32_t slot = offsets_[row + static_cast<std::size_t>(i_begin)]; slot < end; ++slot) {
    const double squared_distance = (local_[slot] - local).squaredNorm();
    if (squared_distance > best.squared_distance * (1 + kNearestTie)) continue;
    const double from_middle = (local_[slot] - 0.5 * size_).squaredNorm();
    const bool nearer = squared_distance < best.squared_distance * (1 - kNearestTie);
    const bool inner = from_middle < best.from_middle * (1 - kNearestTie);
    const bool lower = from_middle <= best.from_middle * (1 + kNearestTie) && elements_[slot] < best.element;
    if (nearer || inner || lower) best = {squared_distance, from_middle, elements_[slot]};
  }
}

void ElementGrid::look_into_shell(const std::array<std::int64_t, 3>& home, std::int64_t radius,
                                  const Vec3& local, Best& best) const {
  const auto low = [&](int axis) { return std::max<std::int64_t>(home[axis] - radius, 0); };
  const auto high = [&](int axis) { return std::min(home[axis] + radius + 1, count_[axis]); };
  for (std::int64_t k = low(2); k < high(2); ++k)
    for (std::int64_t j = low(1); j < high(1); ++j) {
      if (std::abs(k - home[2]) == radius || std::abs(j - home[1]) == radius) {
        look_into(low(0), high(0), j, k, local, best);
        continue;
      }
      if (home[0] - radius >= 0) look_into(home[0] - radius, home[0] - radius + 1, j, k, local, best);
      if (home[0] + radius < count_[0]) look_into(home[0] + radius, home[0] + radius + 1, j, k, local, best);
    }
}

// A lower bound of the distance from `inside`, a point of the grid, to whatever lies beyond the shells up to
// `radius`; infinite when they cover the grid.
double ElementGrid::distance_beyond(const std::array<std::int64_t, 3>& home, std::int64_t radius,
                                    const Vec3& inside) const {
  double distance = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t low = home[axis] - radius, high = home[axis] + radius + 1;
    if (low > 0) distance = std::min(distance, inside[axis] - static_cast<double>(low) * width_[axis]);
    if (high < count_[axis])
      distance = std::min(distance, static_cast<double>(high) * width_[axis] - inside[axis]);
  }
  return std::max(distance, 0.0);
}

std::uint32_t ElementGrid::nearest(const Vec3& point) const {
  const Vec3 local = to_local_ * (point - world_origin_);
  const Vec3 inside = local.cwiseMax(Vec3::Zero()).cwiseMin(size_);
  const double squared_outside = (local - inside).squaredNorm();
  const std::array<std::int64_t, 3> home = bucket_of(inside);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Best best{kFar, kFar, elements_.front()};
  for (std::int64_t radius = 0;; ++radius) {
    look_into_shell(home, radius, local, best);
    const double beyond = distance_beyond(home, radius, inside);
    if (best.squared_distance * (1 + 2 * kNearestTie) <= squared_outside + beyond * beyond)
      return best.element;
  }
}

}  // namespace flexel::mapping
