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

// Three numbers and a zero.
FLEXEL_INLINE void write(const FourDoubles& from, float* to) {
  const FourFloats value = __builtin_convertvector(from, FourFloats);
  const FourFloats padded{value[0], value[1], value[2], 0};
  __builtin_memcpy(to, &padded, sizeof padded);
}

// Four of sixteen lanes, from `first` on.
FLEXEL_INLINE FourDoubles widen(const FloatLanes& lanes, int first) {
  const FourFloats value{lanes[first], lanes[first + 1], lanes[first + 2], lanes[first + 3]};
  return __builtin_convertvector(value, FourDoubles);
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
    write(displacement, rows[i].value);
    for (int k = 0; k < 3; ++k) write(own.gradient[k] - first.gradient[k], rows[i].value + 4 * (k + 1));
  }
}

FLEXEL_CLONES void blend(const BlendedVertices& vertices, const BlendRow* rows, const ElementMotion& first,
                         const Vec3& centre, const Vec3* position, Vec3* displacement) {
  constexpr std::size_t kVerticesAhead = 12;
  constexpr std::uint32_t kWeightsAhead = 256;
  MotionColumns common;
  read(first, common);
  for (std::size_t i = 0; i < vertices.count; ++i) {
    if (i + kVerticesAhead < vertices.listed) {
      const std::uint32_t next = vertices.vertex[i + kVerticesAhead];
      fetch(position + next, sizeof(Vec3));
      fetch(displacement + next, sizeof(Vec3));
    }
    fetch(vertices.weight + vertices.begin[i] + kWeightsAhead, 2 * sizeof(FourDoubles));
    fetch(vertices.element + vertices.begin[i] + kWeightsAhead, sizeof(FourDoubles));
    // Four sums, so that an addition need not wait for the one before it.
    FloatLanes sum[4]{};
    const auto add = [&](std::uint32_t k, int to) __attribute__((always_inline)) {
      sum[to] += vertices.weight[k] * load<FloatLanes>(rows[vertices.element[k]].value);
    };
    const std::uint32_t end = vertices.begin[i + 1];
    std::uint32_t k = vertices.begin[i];
    for (; k + 4 <= end; k += 4) add(k, 0), add(k + 1, 1), add(k + 2, 2), add(k + 3, 3);
    for (; k < end; ++k) add(k, 0);
    const FloatLanes all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    FourDoubles column[4];
    for (int c = 0; c < 4; ++c) column[c] = widen(all, 4 * c);
    const double* at = position[vertices.vertex[i]].data();
    const double offset[3] = {at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]};
    FourDoubles moved = common.displacement, departure = column[0];
    for (int c = 0; c < 3; ++c) {
      moved += common.gradient[c] * offset[c];
      departure += column[c + 1] * offset[c];
    }
    moved += departure;
    double* to = displacement[vertices.vertex[i]].data();
    for (int c = 0; c < 3; ++c) to[c] = moved[c];
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
