// A counting sort of the points by bucket; the cubes themselves are compared, for a bucket may hold several.
#include "simulate/contact/broad_phase.h"

#include <bit>

namespace flexel {

HashGrid::HashGrid(const std::vector<Vec3>& points, double width) : per_width_(1 / width) {
  mask_ = std::bit_ceil(std::max<std::uint64_t>(points.size(), 1)) - 1;
  std::vector<std::size_t> of(points.size());
  parallel_for_each(points.size(), [&](std::size_t i) { of[i] = bucket(cube(points[i])); });
  begin_.assign(mask_ + 2, 0);
  for (const std::size_t b : of) ++begin_[b + 1];
  for (std::size_t b = 0; b <= mask_; ++b) begin_[b + 1] += begin_[b];
  points_.resize(points.size());
  cubes_.resize(points.size());
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const std::size_t slot = next[of[i]]++;
    points_[slot] = i;
    cubes_[slot] = cube(points[i]);
  }
}

}  // namespace flexel
