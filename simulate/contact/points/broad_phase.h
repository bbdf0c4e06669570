// Points near one another, in time and memory linear in their number however far apart they lie: points are
// sorted by the cube of a grid that they lie in, so that those of a row of cubes lie together in memory; each
// looks into the nine rows of three cubes around its own, which move on through the sorted points as it does.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/math/vec.h"
#include "base/parallel.h"

namespace flexel::simulate {

// Compressed rows: those of point i that have a higher number, ascending.
struct Neighbours {
  std::vector<std::size_t> offsets;  // (points + 1)
  std::vector<std::uint32_t> others;
  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t point) const {
    return {others.data() + offsets[point], offsets[point + 1] - offsets[point]};
  }
};

// Points in the order of their cubes, x fastest, and in a cube by their numbers.
class CubeOrder {
 public:
  // `width` [m] of a cube, or more where the points would need over 2^20 of them along an axis.
  CubeOrder(const std::vector<Vec3>& points, double width);

  [[nodiscard]] std::size_t size() const { return points_.size(); }
  [[nodiscard]] std::uint32_t point(std::size_t place) const { return points_[place]; }

  // visit(a, b, c) for the places a of [begin, end) and those [b, c) of points in the 27 cubes around that of
  // a, a row of cubes at a time; done(a) after them.
  template <class Visit, class Done>
  void visit_near(std::size_t begin, std::size_t end, const Visit& visit, const Done& done) const;

 private:
  std::vector<std::uint64_t> keys_;    // of the cubes, ascending
  std::vector<std::uint32_t> points_;  // numbers
  std::array<std::uint64_t, 9> rows_;  // key of the first cube of each row around a cube, less that cube's
};

template <class Visit, class Done>
void CubeOrder::visit_near(std::size_t begin, std::size_t end, const Visit& visit, const Done& done) const {
  struct Row {
    std::size_t first = 0, last = 0;
  };
  std::array<Row, 9> rows;
  const auto place_of = [&](std::uint64_t key) {
    return static_cast<std::size_t>(std::lower_bound(keys_.begin(), keys_.end(), key) - keys_.begin());
  };
  for (std::size_t r = 0; r < 9 && begin < end; ++r)
    rows[r].first = rows[r].last = place_of(keys_[begin] + rows_[r]);
  for (std::size_t a = begin; a < end; ++a) {
    if (a == begin || keys_[a] != keys_[a - 1])
      for (std::size_t r = 0; r < 9; ++r) {
        const std::uint64_t from = keys_[a] + rows_[r];
        while (rows[r].first < size() && keys_[rows[r].first] < from) ++rows[r].first;
        rows[r].last = std::max(rows[r].last, rows[r].first);
        while (rows[r].last < size() && keys_[rows[r].last] < from + 3) ++rows[r].last;
      }
    for (const Row& row : rows)
      if (row.first < row.last) visit(a, row.first, row.last);
    done(a);
  }
}

// All pairs i < j at most `reach` [m] apart for which keep(i, j).
template <class Keep>
[[nodiscard]] Neighbours neighbours_within(const std::vector<Vec3>& points, double reach, const Keep& keep) {
  const CubeOrder order(points, reach);
  std::vector<Vec3> sorted(points.size());
  std::vector<std::uint32_t> number(points.size());
  parallel_for_each(points.size(), [&](std::size_t a) {
    number[a] = order.point(a);
    sorted[a] = points[number[a]];
  });
  constexpr std::size_t kGrain = 2048;
  std::vector<std::vector<std::uint32_t>> found((points.size() + kGrain - 1) / kGrain);
  Neighbours result;
  result.offsets.assign(points.size() + 1, 0);
  parallel_chunks(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& own = found[begin / kGrain];
    std::vector<std::uint32_t> near;
    std::size_t first = 0;
    order.visit_near(
        begin, end,
        [&](std::size_t a, std::size_t row, std::size_t behind) {
          // without branches, which nothing could foretell
          near.resize(std::max(near.size(), behind - row));
          std::size_t count = 0;
          const std::uint32_t i = number[a];
          for (std::size_t b = row; b < behind; ++b) {
            near[count] = number[b];
            count += static_cast<std::size_t>((sorted[b] - sorted[a]).squaredNorm() <= reach * reach) &
                     static_cast<std::size_t>(number[b] > i);
          }
          for (std::size_t n = 0; n < count; ++n)
            if (keep(i, near[n])) own.push_back(near[n]);
        },
        [&](std::size_t a) {
          std::sort(own.begin() + static_cast<std::ptrdiff_t>(first), own.end());
          result.offsets[order.point(a) + 1] = own.size() - first;
          first = own.size();
        });
  });
  for (std::size_t i = 0; i < points.size(); ++i) result.offsets[i + 1] += result.offsets[i];
  result.others.resize(result.offsets.back());
  parallel_chunks(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    const std::uint32_t* from = found[begin / kGrain].data();
    for (std::size_t a = begin; a < end; ++a) {
      const std::uint32_t i = order.point(a);
      const std::size_t count = result.offsets[i + 1] - result.offsets[i];
      std::copy(from, from + count, result.others.begin() + static_cast<std::ptrdiff_t>(result.offsets[i]));
      from += count;
    }
  });
  return result;
}

}  // namespace flexel::simulate
