// A vector, or a column of a matrix, is the first three of four lanes; the fourth is overwritten or unused.
#include "mapping/methods/blend_kernel.h"

#ifdef __x86_64__
#include <immintrin.h>
#endif

#include "base/simd.h"
#include "mapping/anchors/blend_weights.h"

namespace flexel::mapping {
namespace {

using namespace simd;

// The columns of a motion. The last is loaded one number earlier, since nothing may be read past it.
struct MotionColumns {
  FourDoubles displacement{}, gradient[3]{};
};
static_assert(sizeof(ElementMotion) == 12 * sizeof(double));

FLEXEL_INLINE void read(const ElementMotion& motion, MotionColumns& columns) {
  const auto* from = reinterpret_cast<const double*>(&motion);
  columns.displacement = load_as<FourDoubles>(from);
  columns.gradient[0] = load_as<FourDoubles>(from + 3);
  columns.gradient[1] = load_as<FourDoubles>(from + 6);
  const FourDoubles last = load_as<FourDoubles>(from + 8);
  columns.gradient[2] = FourDoubles{last[1], last[2], last[3], 0};
}

// Three numbers, then `behind`.
FLEXEL_INLINE void write(const FourDoubles& from, double behind, double* to) {
  const FourDoubles padded{from[0], from[1], from[2], behind};
  __builtin_memcpy(to, &padded, sizeof padded);
}

#ifdef FLEXEL_AVX512
// collect_in_radius(): sixteen at a time are pushed together.
FLEXEL_AVX512 void collect_by_sixteen(const float* weight, std::size_t count, ElementsInRadius& in_radius) {
  std::size_t used = 0;
  __m512i number = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  for (std::size_t e = 0; e < count; e += 16) {
    const __m512 here = _mm512_loadu_ps(weight + e);
    const __mmask16 is_in_radius = _mm512_cmp_ps_mask(here, _mm512_setzero_ps(), _CMP_GT_OQ);
    _mm512_storeu_ps(in_radius.weight + used, _mm512_maskz_compress_ps(is_in_radius, here));
    const __m256i elements =
        _mm512_maskz_cvtepi32_epi16(0xffff, _mm512_maskz_compress_epi32(is_in_radius, number));
    __builtin_memcpy(in_radius.element + used, &elements, sizeof elements);
    used += static_cast<std::size_t>(__builtin_popcount(is_in_radius));
    number = _mm512_add_epi32(number, _mm512_set1_epi32(16));
  }
  in_radius.count = used;
}
#endif

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
    write(displacement, 1, rows[i].value);
    for (int k = 0; k < 3; ++k) write(own.gradient[k] - first.gradient[k], 0, rows[i].value + 4 * (k + 1));
  }
}

FLEXEL_CLONES void blend(const BlendedVertices& vertices, const BlendRow* rows, const ElementMotion& first,
                         const Vec3& centre, const Vec3* position, Vec3* displacement) {
  constexpr std::size_t kVerticesAhead = 12;
  constexpr std::uint32_t kWeightsAhead = kWeightsFetched;
  MotionColumns common;
  read(first, common);
  for (std::size_t i = 0; i < vertices.count; ++i) {
    if (i + kVerticesAhead < vertices.listed) {
      const std::uint32_t next = vertices.vertex[i + kVerticesAhead];
      fetch(position + next, sizeof(Vec3));
      fetch(displacement + next, sizeof(Vec3));
    }
    fetch(vertices.weight + vertices.begin[i] + kWeightsAhead, 128);
    fetch(vertices.element + vertices.begin[i] + kWeightsAhead, 64);
    // Two sums, so that an addition need not wait for the one before it.
    Lanes low[2]{}, high[2]{};
    const auto add = [&](std::uint32_t k, int to) __attribute__((always_inline)) {
      const auto by = static_cast<double>(vertices.weight[k]);
      const double* row = rows[vertices.element[k]].value;
      low[to] += by * load_as<Lanes>(row);
      high[to] += by * load_as<Lanes>(row + kLanes);
    };
    static_assert(kBlendStep == 4);
    for (std::uint32_t k = vertices.begin[i]; k < vertices.begin[i + 1]; k += kBlendStep)
      add(k, 0), add(k + 1, 1), add(k + 2, 0), add(k + 3, 1);
    const Lanes sum[2] = {low[0] + low[1], high[0] + high[1]};
    FourDoubles column[4];
    __builtin_memcpy(column, sum, sizeof sum);
    const double share = 1 / column[0][3];
    const double* at = position[vertices.vertex[i]].data();
    const double offset[3] = {at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]};
    FourDoubles moved = common.displacement, departure = column[0];
    for (int c = 0; c < 3; ++c) {
      moved += common.gradient[c] * offset[c];
      departure += column[c + 1] * offset[c];
    }
    moved += share * departure;
    double* to = displacement[vertices.vertex[i]].data();
    for (int c = 0; c < 3; ++c) to[c] = moved[c];
  }
}

FLEXEL_CLONES void weigh_elements(const float* x, const float* y, const float* z, std::size_t count,
                                  const float* point, float* weight) {
  constexpr auto kScale = static_cast<float>(1 / kBlendRadius);
  for (std::size_t i = 0; i < count; i += kFloatLanes) {
    const FloatLanes dx = load_as<FloatLanes>(x + i) - point[0], dy = load_as<FloatLanes>(y + i) - point[1],
                     dz = load_as<FloatLanes>(z + i) - point[2];
    const FloatLanes r = kScale * square_root(dx * dx + dy * dy + dz * dz);
    const FloatLanes left = r < 1 ? 1 - r : FloatLanes{};
    const FloatLanes square = left * left, all = square * square * (4 * r + 1);
    __builtin_memcpy(weight + i, &all, sizeof all);
  }
}

void collect_in_radius(const float* weight, std::size_t count, ElementsInRadius& in_radius) {
#ifdef FLEXEL_AVX512
  static const bool by_sixteen = __builtin_cpu_supports("avx512f");
  if (by_sixteen) return collect_by_sixteen(weight, count, in_radius);
#endif
  std::size_t used = 0;
  for (std::size_t e = 0; e < count; ++e) {  // every one is written; those of weight 0 are overwritten
    in_radius.element[used] = static_cast<std::uint16_t>(e);
    in_radius.weight[used] = weight[e];
    used += weight[e] > 0;
  }
  in_radius.count = used;
}

FLEXEL_CLONES void fit_gradients(const std::uint32_t* element, const std::uint32_t* frame, std::size_t count,
                                 const Adjacency& connections, const Vec3* rest, const double* displacement,
                                 const Mat3* inverse_moments, ElementMotion* motion) {
  for (std::size_t i = 0; i < count; ++i) {
    if (frame[i] != kNoSlot) continue;
    const std::uint32_t own = element[i];
    const double* from = rest[own].data();
    const FourDoubles moved = load_as<FourDoubles>(displacement + 4 * std::size_t{own});
    FourDoubles sum[3]{};
    for (std::uint32_t c = connections.offsets[own]; c < connections.offsets[own + 1]; ++c) {
      const std::uint32_t other = connections.neighbours[c];
      const double* to = rest[other].data();
      const double x = to[0] - from[0], y = to[1] - from[1], z = to[2] - from[2];
      const double squared_length = x * x + y * y + z * z;
      if (!(squared_length > 0)) continue;
      const double inverse = 1 / squared_length;
      const FourDoubles by = load_as<FourDoubles>(displacement + 4 * std::size_t{other}) - moved;
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

}  // namespace flexel::mapping
