// Three numbers of a vector, or column of a matrix, are the first three lanes of four; what the fourth holds
// is overwritten or never looked at.
#include "mapping/blend_kernel.h"

#include "mapping/kernel.h"
#include "mapping/lanes.h"

namespace flexel {
namespace {

// The columns of a motion, which has no room behind its last.
struct MotionColumns {
  FourDoubles displacement{}, gradient[3]{};
};
static_assert(sizeof(ElementMotion) == 12 * sizeof(double));

FLEXEL_INLINE void read(const ElementMotion& motion, MotionColumns& columns) {
  const auto* from = reinterpret_cast<const double*>(&motion);
  columns.displacement = load<FourDoubles>(from);
  columns.gradient[0] = load<FourDoubles>(from + 3);
  columns.gradient[1] = load<FourDoubles>(from + 6);
  const FourDoubles last = load<FourDoubles>(from + 8);
  columns.gradient[2] = FourDoubles{last[1], last[2], last[3], 0};
}

}  // namespace

FLEXEL_CLONES void make_blend_rows(const std::uint32_t* elements, std::size_t count, const Vec3* rest,
                                   const std::uint32_t* slot_of, const ElementMotion* motions,
                                   BlendRow* rows) {
  MotionColumns first;
  read(motions[slot_of[elements[0]]], first);
  const double* centre = rest[elements[0]].data();
  for (std::size_t i = 0; i < count; ++i) {
    MotionColumns own;
    read(motions[slot_of[elements[i]]], own);
    const double* at = rest[elements[i]].data();
    FourDoubles displacement = own.displacement - first.displacement;
    for (int k = 0; k < 3; ++k) displacement -= own.gradient[k] * (at[k] - centre[k]);
    double* row = rows[i].value;
    __builtin_memcpy(row, &displacement, sizeof displacement);
    for (int k = 0; k < 2; ++k) {
      const FourDoubles column = own.gradient[k] - first.gradient[k];
      __builtin_memcpy(row + 3 * (k + 1), &column, sizeof column);
    }
    const FourDoubles last = own.gradient[2] - first.gradient[2];
    for (int c = 0; c < 3; ++c) row[9 + c] = last[c];
  }
}

FLEXEL_CLONES void sum_blend_rows(const BlendRow* rows, const std::uint32_t* begin,
                                  const std::uint16_t* element, const float* weight, std::size_t vertices,
                                  BlendRow* sums) {
  for (std::size_t v = 0; v < vertices; ++v) {
    // Two sums, so that an addition need not wait for the one before it.
    Lanes low[2]{};
    FourDoubles high[2]{};
    const auto add = [&](std::uint32_t k, int to) __attribute__((always_inline)) {
      const auto by = static_cast<double>(weight[k]);
      const double* row = rows[element[k]].value;
      low[to] += by * load<Lanes>(row);
      high[to] += by * load<FourDoubles>(row + kLanes);
    };
    std::uint32_t k = begin[v];
    for (; k + 1 < begin[v + 1]; k += 2) add(k, 0), add(k + 1, 1);
    if (k < begin[v + 1]) add(k, 0);
    low[0] += low[1];
    high[0] += high[1];
    __builtin_memcpy(sums[v].value, &low[0], sizeof low[0]);
    __builtin_memcpy(sums[v].value + kLanes, &high[0], sizeof high[0]);
  }
}

FLEXEL_CLONES void weigh_elements(const float* x, const float* y, const float* z, std::size_t count,
                                  const float* point, float* weight) {
  constexpr auto kScale = static_cast<float>(1 / kBlendRadius);
  for (std::size_t i = 0; i < count; i += kFloatLanes) {
    const FloatLanes dx = load<FloatLanes>(x + i) - point[0], dy = load<FloatLanes>(y + i) - point[1],
                     dz = load<FloatLanes>(z + i) - point[2];
    const FloatLanes r = kScale * square_root(dx * dx + dy * dy + dz * dz);
    const FloatLanes left = r < 1 ? 1 - r : FloatLanes{};
    const FloatLanes square = left * left, all = square * square * (4 * r + 1);
    __builtin_memcpy(weight + i, &all, sizeof all);
  }
}

FLEXEL_CLONES void fit_gradients(const std::uint32_t* element, const std::uint32_t* frame, std::size_t count,
                                 const Adjacency& connections, const Vec3* rest, const double* displacement,
                                 const Mat3* inverse_moments, ElementMotion* motion) {
  for (std::size_t i = 0; i < count; ++i) {
    if (frame[i] != kNoSlot) continue;
    const std::uint32_t own = element[i];
    const double* from = rest[own].data();
    const FourDoubles moved = load<FourDoubles>(displacement + 4 * std::size_t{own});
    FourDoubles sum[3]{};
    for (std::uint32_t c = connections.offsets[own]; c < connections.offsets[own + 1]; ++c) {
      const std::uint32_t other = connections.neighbours[c];
      const double* to = rest[other].data();
      const double x = to[0] - from[0], y = to[1] - from[1], z = to[2] - from[2];
      const double squared_length = x * x + y * y + z * z;
      if (!(squared_length > 0)) continue;
      const double inverse = 1 / squared_length;
      const FourDoubles by = load<FourDoubles>(displacement + 4 * std::size_t{other}) - moved;
      sum[0] += by * (x * inverse);
      sum[1] += by * (y * inverse);
      sum[2] += by * (z * inverse);
    }
    const double* moments = inverse_moments[i].data();
    double columns[13];
    for (int k = 0; k < 3; ++k) {
      const FourDoubles column =
          sum[0] * moments[3 * k] + sum[1] * moments[3 * k + 1] + sum[2] * moments[3 * k + 2];
      __builtin_memcpy(columns + 3 * k, &column, sizeof column);
    }
    for (int k = 0; k < 9; ++k) motion[i].gradient.data()[k] = columns[k];
  }
}

}  // namespace flexel
