// Points near one another, in time linear in their number: they are put into the cubes of a grid by a hash of
// the cube (Teschner et al. 2003), and each looks into the 27 around it.
#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/parallel.h"
#include "formats/vec.h"

namespace flexel {

// Compressed rows: those of point i that have a higher number, ascending.
struct Neighbours {
  std::vector<std::size_t> offsets;  // (points + 1)
  std::vector<std::uint32_t> others;
  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t point) const {
    return {others.data() + offsets[point], offsets[point + 1] - offsets[point]};
  }
};

// Points by the cube of the grid that they lie in.
class HashGrid {
 public:
  using Cube = std::array<std::int64_t, 3>;

  // `width` [m] of a cube. Keeps a reference to `points`.
  HashGrid(const std::vector<Vec3>& points, double width);

  // visit(j) for each point j in the 27 cubes around `at`; ascending within a cube.
  template <class Visit>
  void visit_near(const Vec3& at, const Visit& visit) const {
    const Cube middle = cube(at);
    for (std::int64_t n = 0; n < 27; ++n) {
      const Cube wanted{middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1};
      const std::size_t b = bucket(wanted);
      for (std::size_t slot = begin_[b]; slot < begin_[b + 1]; ++slot)
        if (cubes_[slot] == wanted) visit(points_[slot]);
    }
  }

 private:
  [[nodiscard]] Cube cube(const Vec3& at) const {
    Cube result;
    for (int axis = 0; axis < 3; ++axis)
      result[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::floor(at[axis] * per_width_));
    return result;
  }
  [[nodiscard]] std::size_t bucket(const Cube& cube) const {
    std::uint64_t hash = 0;
    for (const std::int64_t each : cube)
      hash = (hash ^ static_cast<std::uint64_t>(each)) * 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>((hash ^ hash >> 32) & mask_);
  }

  double per_width_;
  std::uint64_t mask_ = 0;
  std::vector<std::size_t> begin_;     // (buckets + 1)
  std::vector<std::uint32_t> points_;  // by bucket, then ascending
  std::vector<Cube> cubes_;            // of points_
};

// All pairs i < j at most `reach` [m] apart for which keep(i, j).
template <class Keep>
[[nodiscard]] Neighbours neighbours_within(const std::vector<Vec3>& points, double reach, const Keep& keep) {
  const HashGrid grid(points, reach);
  constexpr std::size_t kGrain = 512;
  std::vector<std::vector<std::uint32_t>> found((points.size() + kGrain - 1) / kGrain);
  Neighbours result;
  result.offsets.assign(points.size() + 1, 0);
  parallel_chunks(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& own = found[begin / kGrain];
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t first = own.size();
      grid.visit_near(points[i], [&](std::uint32_t j) {
        if (j > i && (points[j] - points[i]).squaredNorm() <= reach * reach &&
            keep(static_cast<std::uint32_t>(i), j))
          own.push_back(j);
      });
      std::sort(own.begin() + static_cast<std::ptrdiff_t>(first), own.end());
      result.offsets[i + 1] = own.size() - first;
    }
  });
  for (std::size_t i = 0; i < points.size(); ++i) result.offsets[i + 1] += result.offsets[i];
  result.others.reserve(result.offsets.back());
  for (const auto& own : found) result.others.insert(result.others.end(), own.begin(), own.end());
  return result;
}

}  // namespace flexel
