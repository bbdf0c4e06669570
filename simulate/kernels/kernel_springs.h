// Model `springs` where they flow or break, eight cells at a time; kernel_table.cpp has the formulas. Included by
// kernel_table.cpp alone.
//
// Fracture: a spring ends where its length passes t = l (1 + `elongation`) (Jansson and Vergeest, equation
// 2). Each cell that holds a share of it sees the same length and decides the same. A cell whose springs
// leave its elements in two or more pieces breaks as a whole.
//
// Plasticity: a cell has the Kirchhoff stress of its springs, tau = 1/V sum k e d n (x) n, e = d - l - p the stretch, n
// the direction. Its deviator s is kept within |s| <= sqrt(2/3) sigma_y(a), a the equivalent plastic strain,
// by a flow g N, N = s / |s|, that the rest lengths follow: dp = g l n N n. What a spring is stretched beside the mean of
// those parallel to it, as in bending, is kept within max(3/2 (1 - m^2), 1/20) of yield / E, m the share of the yield stress
// that the mean stress takes (simulate/kernels/kernel_plastic.h has the same for cells).
#pragma once
#include "simulate/kernels/kernel_plastic.h"

namespace flexel::simulate::step {
namespace {

// One spring of a block's cells: from corner a to corner b.
struct SpringLanes {
  Lanes d[3];  // m, from a to b
  Lanes off;   // d^2 - l^2
  double rest_square;
  int kind;  // 0 along an edge, 1 across a face, 2 through the centre
};

FLEXEL_INLINE SpringLanes spring_of(const Corners& u, int a, int b, const CellConstants& k) {
  SpringLanes s;
  s.kind = __builtin_popcount(static_cast<unsigned>(a ^ b)) - 1;
  s.off = Lanes{};
  s.rest_square = 0;
  for (int c = 0; c < 3; ++c) {
    const double rest = (((b >> c) & 1) - ((a >> c) & 1)) * k.spacing[c];
    const Lanes moved = u.at[b][c] - u.at[a][c];
    s.d[c] = rest + moved;
    s.off += moved * (2 * rest + moved);
    s.rest_square += rest * rest;
  }
  return s;
}

// The springs in order, for loops that are not unrolled: fracture and plasticity do much per spring, and
// their kernels would take minutes to compile.
struct SpringEnds {
  int a[28], b[28];
};
constexpr SpringEnds kEnds = [] {
  SpringEnds ends{};
  int number = 0;
  for (int a = 0; a < 8; ++a)
    for (int b = a + 1; b < 8; ++b, ++number) {
      ends.a[number] = a;
      ends.b[number] = b;
    }
  return ends;
}();

// Whether the springs that are left join all eight elements.
inline bool holds_together(std::uint64_t broken) {
  unsigned reached = 1;
  for (int sweep = 0; sweep < 7; ++sweep) {
    int number = 0;
    for (int a = 0; a < 8; ++a)
      for (int b = a + 1; b < 8; ++b, ++number)
        if (!(broken >> number & 1) && ((reached >> a | reached >> b) & 1)) reached |= 1u << a | 1u << b;
  }
  return reached == 0xff;
}

FLEXEL_INLINE LaneBits load_bits(const std::uint64_t* from) {
  LaneBits bits;
  __builtin_memcpy(&bits, from, sizeof bits);
  return bits;
}

// Breaks what is too long; gives the springs that broke before this step.
FLEXEL_INLINE LaneBits break_springs(const Corners& u, const CellConstants& k, CellBlock& block,
                                     SpringBlock& memory, Sums& sums) {
  const LaneBits before = load_bits(memory.broken);
  LaneBits now = before;
  const double longest = k.elongation * (2 + k.elongation);
#pragma GCC unroll 1
  for (int number = 0; number < 28; ++number) {
    const SpringLanes s = spring_of(u, kEnds.a[number], kEnds.b[number], k);
    now = s.off > longest * s.rest_square ? now | (LaneBits{} + (1LL << number)) : now;
  }
  for (std::size_t l = 0; l < kLanes; ++l) {
    if (now[l] == before[l] || !(block.fill[l] > 0)) continue;
    memory.broken[l] = static_cast<std::uint64_t>(now[l]);
    if (holds_together(memory.broken[l])) continue;
    memory.broken[l] = kAllSprings;
    block.fill[l] = 0;
    ++sums.broken;
  }
  return before;
}

// What the springs of a block's cells are like: stretch less what flowed [m], unit direction, length [m], stiffness
// without fill [N/m], 0 of broken ones.
struct SpringSet {
  Lanes stretch[28], unit[28][3], length[28], stiffness[28];
  double rest[28];
};

FLEXEL_INLINE void read_springs(const Corners& u, const CellConstants& k, const LaneBits& gone,
                                const SpringFlow& memory, SpringSet& springs) {
#pragma GCC unroll 1
  for (int n = 0; n < 28; ++n) {
    const SpringLanes s = spring_of(u, kEnds.a[n], kEnds.b[n], k);
    Lanes square = {};
    for (int c = 0; c < 3; ++c) square += s.d[c] * s.d[c];
    springs.length[n] = square_root(square);
    springs.rest[n] = __builtin_sqrt(s.rest_square);
    springs.stretch[n] = s.off / (springs.length[n] + springs.rest[n]) - load(memory.flowed[n]);
    springs.stiffness[n] = (gone >> n & 1) != 0 ? Lanes{} : Lanes{} + k.spring[s.kind];
    for (int c = 0; c < 3; ++c) springs.unit[n][c] = s.d[c] / springs.length[n];
  }
}

// n T n; T: xx, yy, zz, xy, yz, zx.
FLEXEL_INLINE Lanes along(const Lanes* n, const Lanes* tensor) {
  return n[0] * n[0] * tensor[0] + n[1] * n[1] * tensor[1] + n[2] * n[2] * tensor[2] +
         2 * (n[0] * n[1] * tensor[3] + n[1] * n[2] * tensor[4] + n[2] * n[0] * tensor[5]);
}

FLEXEL_INLINE Lanes smaller(const Lanes& a, const Lanes& b) {
  return a < b ? a : b;
}

// Springs of a cell that are parallel: a direction each of the half-neighbourhood, and how many it has.
struct SpringFamilies {
  int of[28], size[13];
};
constexpr SpringFamilies kFamilies = [] {
  SpringFamilies families{};
  int known[13] = {}, count = 0;
  for (int n = 0; n < 28; ++n) {
    int direction = 0;
    for (int c = 2; c >= 0; --c) direction = 3 * direction + (kEnds.b[n] >> c & 1) - (kEnds.a[n] >> c & 1);
    int family = 0;
    while (family < count && known[family] != direction) ++family;
    if (family == count) known[count++] = direction;
    families.of[n] = family;
    ++families.size[family];
  }
  return families;
}();

// Leads the rest lengths by the flow `flowed` along `normal` (0: none), and those of springs that are stretched too
// much beside the mean of their family, where all springs are left (`whole`), so that the mean stays. `share`: of the
// yield stress that the mean stress takes; `strain`: yield / E.
FLEXEL_INLINE void move(const SpringSet& springs, const Lanes* normal, const Lanes& flowed,
                        const Lanes& share, const Lanes& strain, const LaneMask& whole, const Lanes& fill,
                        SpringFlow& memory, Sums& sums) {
  const Lanes left = 1.5 * (1 - share * share);
  const Lanes most = (left < 0.05 ? Lanes{} + 0.05 : left) * strain;
  Lanes moved[28], mean[13] = {}, excess[13] = {};
#pragma GCC unroll 1
  for (int n = 0; n < 28; ++n) mean[kFamilies.of[n]] += springs.stretch[n] / kFamilies.size[kFamilies.of[n]];
#pragma GCC unroll 1
  for (int n = 0; n < 28; ++n) {
    const int family = kFamilies.of[n];
    const Lanes beside = springs.stretch[n] - mean[family], bound = springs.rest[n] * most;
    const Lanes over = beside > bound ? beside - bound : beside < -bound ? beside + bound : Lanes{};
    moved[n] = whole ? over : Lanes{};
    excess[family] += moved[n] / kFamilies.size[family];
  }
#pragma GCC unroll 1
  for (int n = 0; n < 28; ++n) {
    const Lanes by_flow = springs.rest[n] * flowed * along(springs.unit[n], normal);
    moved[n] = fill > 0 ? moved[n] + by_flow - excess[kFamilies.of[n]] : Lanes{};
    store(memory.flowed[n], load(memory.flowed[n]) + moved[n]);
    sums.plastic_work +=
        fill > 0 ? springs.stiffness[n] * fill * moved[n] * (springs.stretch[n] - moved[n]) : Lanes{};
  }
}

// Lets the cells flow whose mean stress, or whose springs beside it, pass the yield stress.
FLEXEL_INLINE void flow(const Corners& u, const CellConstants& k, const Lanes& fill, const LaneBits& gone,
                        SpringFlow& memory, Sums& sums) {
  constexpr double kRoot = 0.81649658092772603;  // of 2/3
  const double volume = k.spacing[0] * k.spacing[1] * k.spacing[2];
  const double young = (4 * k.spring[0] + 2 * k.spring[1]) / (0.8 * k.spacing[0]);
  SpringSet springs;
  read_springs(u, k, gone, memory, springs);
  Lanes stress[6] = {};
#pragma GCC unroll 1
  for (int n = 0; n < 28; ++n) {
    const Lanes pull = springs.stiffness[n] * springs.stretch[n] * springs.length[n] / volume;
    for (int c = 0; c < 3; ++c) {
      stress[c] += pull * springs.unit[n][c] * springs.unit[n][c];
      stress[3 + c] += pull * springs.unit[n][c] * springs.unit[n][(c + 1) % 3];
    }
  }
  const Lanes mean = (stress[0] + stress[1] + stress[2]) / 3;
  Lanes deviator[6], square = {};
  for (int c = 0; c < 6; ++c) {
    deviator[c] = c < 3 ? stress[c] - mean : stress[c];
    square += (c < 3 ? 1 : 2) * deviator[c] * deviator[c];
  }
  const Lanes size = square_root(square), strain = load(memory.strain[0]);
  const FlowStress yield = flow_stress(k, strain);
  const Lanes bound = kRoot * yield.stress;
  const LaneMask yields = (size > bound) & (fill > 0);
  Lanes flowed = {};
  for (int c = 0; c < 6; ++c) deviator[c] = yields ? deviator[c] / size : Lanes{};
  if (any(yields)) {
    Lanes softening = {};
#pragma GCC unroll 1
    for (int n = 0; n < 28; ++n) {
      const Lanes part = along(springs.unit[n], deviator);
      softening += springs.stiffness[n] * springs.length[n] * springs.rest[n] * part * part / volume;
    }
    flowed = yields ? (size - bound) / (softening + 2 * yield.slope / 3) : Lanes{};
    const Lanes now = strain + kRoot * flowed;
    for (int n = 0; n < 28; ++n) store(memory.strain[n], now);
  }
  move(springs, deviator, flowed, smaller(size / bound, Lanes{} + 1), bound / (kRoot * young),
       (gone == 0) & (fill > 0), fill, memory, sums);
}

struct SpringsModel {
  static constexpr bool by_connection = false;

  template <Composition has>
  FLEXEL_INLINE static void add_block(const ChunkView& chunk, std::size_t number, const Advance& advance,
                                      const Scratch& scratch, Sums& sums) {
    constexpr Damping damping = has.damping;
    CellBlock& block = chunk.blocks[number];
    const CellConstants& k = *chunk.constants;
    const Lanes fill = load(block.fill);
    Corners u, v, force = {}, damped = {};
    read_corners(chunk, block, scratch.column + kDisplacement, u);
    if constexpr (damping != Damping::none) read_corners(chunk, block, scratch.column + kVelocity, v);
    [[maybe_unused]] LaneBits before = {}, broken = {};
    if constexpr (has.fracture) {
      before = break_springs(u, k, block, chunk.springs[number], sums);
      broken = load_bits(chunk.springs[number].broken);
    }
    if constexpr (has.plasticity)
      if (k.yield < __builtin_huge_val()) flow(u, k, fill, before, chunk.spring_flow[number], sums);
    const auto add_spring = [&](int a, int b, [[maybe_unused]] int spring) __attribute__((always_inline)) {
      const SpringLanes s = spring_of(u, a, b, k);
      Lanes square = {};
      for (int c = 0; c < 3; ++c) square += s.d[c] * s.d[c];
      const double rest_length = __builtin_sqrt(s.rest_square);
      const Lanes length = square_root(square);
      const Lanes stiffness = k.spring[s.kind] * fill;
      Lanes pull;  // force on a along d, over |d|
      [[maybe_unused]] Lanes viscous = {}, along = {};
      Lanes stretch = s.off / (length + rest_length);
      if constexpr (has.plasticity) {
        SpringFlow& memory = chunk.spring_flow[number];
        stretch -= load(memory.flowed[spring]);
        pull = stiffness * stretch / length;
      } else if constexpr (damping == Damping::none) {
        pull = stiffness * s.off / (length * (length + rest_length));
      }
      if constexpr (damping != Damping::none) {
        for (int c = 0; c < 3; ++c) along += (v.at[b][c] - v.at[a][c]) * s.d[c];
        const Lanes both = length * (length + rest_length);
        const Lanes inverse = 1 / (both * square);
        viscous = stiffness * (k.damping * along * (both * inverse));
        if constexpr (!has.plasticity) pull = stiffness * (s.off * (square * inverse));
      }
      if constexpr (has.fracture) {
        const LaneMask gone = (broken >> spring & 1) != 0;
        if constexpr (damping == Damping::book) {
          // As cells do (kernel_table.cpp): the energy of half a step ago.
          const Lanes released = 0.5 * stiffness * stretch * stretch - 0.5 * advance.kick * pull * along;
          sums.released += (gone & ((before >> spring & 1) == 0) & (fill > 0)) ? released : Lanes{};
        }
        pull = gone ? Lanes{} : pull;
        viscous = gone ? Lanes{} : viscous;
        stretch = gone ? Lanes{} : stretch;
      }
      if constexpr (damping == Damping::book) sums.elastic += 0.5 * stiffness * stretch * stretch;
      if constexpr (damping == Damping::book)
        for (int c = 0; c < 3; ++c) {
          damped.at[a][c] += viscous * s.d[c];
          damped.at[b][c] -= viscous * s.d[c];
        }
      if constexpr (damping != Damping::none) pull = pull + viscous;
      for (int c = 0; c < 3; ++c) {
        force.at[a][c] += pull * s.d[c];
        force.at[b][c] -= pull * s.d[c];
      }
    };
#pragma GCC unroll 1
    for (int n = 0; n < 28; ++n) add_spring(kEnds.a[n], kEnds.b[n], n);
    // A length that is not a number makes the forces so; the first one tells.
    const Lanes told = fill > 0 ? 1 + 0 * force.at[0][0] : Lanes{} + __builtin_huge_val();
    sums.smallest_jacobian = told >= sums.smallest_jacobian ? sums.smallest_jacobian : told;
    if constexpr (damping == Damping::book)
      add_to_corners(chunk, block, damped, scratch.column + kDampingForce);
    add_to_corners(chunk, block, force, scratch.column + kForce);
  }
};

}  // namespace
}  // namespace flexel::simulate::step
