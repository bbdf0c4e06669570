// A radix sort by the keys of the cubes, least digits first, which keeps the order of equal ones.
#include "simulate/contact/points/broad_phase.h"

#include <bit>
#include <cmath>

namespace flexel::simulate {
namespace {

constexpr double kMostCubes = 1 << 20;  // along an axis, so that a key has room
constexpr int kDigit = 11;              // bits

struct Keyed {
  std::uint64_t key = 0;
  std::uint32_t point = 0;
};

void sort_by_key(std::vector<Keyed>& values, std::uint64_t largest) {
  std::vector<Keyed> other(values.size());
  for (int shift = 0; shift < static_cast<int>(std::bit_width(largest)); shift += kDigit) {
    const auto digit = [&](const Keyed& value) { return value.key >> shift & ((1u << kDigit) - 1); };
    std::array<std::size_t, (1 << kDigit) + 1> begin{};
    for (const Keyed& value : values) ++begin[digit(value) + 1];
    for (std::size_t d = 0; d + 1 < begin.size(); ++d) begin[d + 1] += begin[d];
    for (const Keyed& value : values) other[begin[digit(value)]++] = value;
    values.swap(other);
  }
}

}  // namespace

CubeOrder::CubeOrder(const std::vector<Vec3>& points, double width) {
  Box box;
  for (const Vec3& point : points) box.add(point);
  if (points.empty()) box.add(Vec3::Zero());
  const Vec3 size = box.max - box.min;
  const double per_width = 1 / std::max(width * (1 + 1e-9), size.maxCoeff() / kMostCubes);
  // an empty cube on either side of a row keeps rows apart
  std::array<std::uint64_t, 3> count{};
  for (int axis = 0; axis < 3; ++axis)
    count[static_cast<std::size_t>(axis)] = static_cast<std::uint64_t>(size[axis] * per_width) + 3;
  std::vector<Keyed> values(points.size());
  parallel_for_each(points.size(), [&](std::size_t i) {
    const Vec3 at = (points[i] - box.min) * per_width;
    const auto cube = [&](int axis) { return static_cast<std::uint64_t>(at[axis]) + 1; };
    values[i] = {(cube(2) * count[1] + cube(1)) * count[0] + cube(0), static_cast<std::uint32_t>(i)};
  });
  sort_by_key(values, count[0] * count[1] * count[2]);
  keys_.resize(points.size());
  points_.resize(points.size());
  for (std::size_t a = 0; a < values.size(); ++a) {
    keys_[a] = values[a].key;
    points_[a] = values[a].point;
  }
  for (std::uint64_t r = 0; r < 9; ++r) {
    const std::uint64_t ahead = (r / 3 * count[1] + r % 3) * count[0];
    rows_[r] = ahead - (count[1] + 1) * count[0] - 1;  // wraps: added to a key it does again
  }
}

}  // namespace flexel::simulate
