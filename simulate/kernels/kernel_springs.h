// Model `springs` where they flow or break, eight cells at a time; kernel_table.cpp has the formulas. Included by
// kernel_table.cpp alone.
//
// Fracture: a spring ends where its length passes t = l (1 + `elongation`) (Jansson and Vergeest, equation
// 2). Each cell that holds a share of it sees the same length and decides the same. A cell whose springs
// leave its elements in two or more pieces breaks as a whole.
//
// Plasticity: a spring's rest length follows it where its stretch e = d - l - p passes l (`yield` +
// `hardening` a), both here in strain, a the sum of |dp| / l.
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

// Stretch that a spring resists; flows where it is too large.
FLEXEL_INLINE Lanes flow(Lanes stretch, double rest, double stiffness, const CellConstants& k,
                         const Lanes& fill, double* flowed, double* strain, Sums& sums) {
  stretch -= load(flowed);
  const Lanes plastic = load(strain), size = stretch > 0 ? stretch : -stretch;
  const Lanes bound = rest * (k.yield + k.hardening * plastic);
  const LaneMask yields = (size > bound) & (fill > 0);
  if (!any(yields)) return stretch;
  const Lanes moved = yields ? (size - bound) / (1 + k.hardening) : Lanes{};
  const Lanes signed_move = stretch > 0 ? moved : -moved;
  store(flowed, load(flowed) + signed_move);
  store(strain, plastic + moved / rest);
  sums.plastic_work += stiffness * fill * moved * (bound + 0.5 * k.hardening * moved);
  return stretch - signed_move;
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
        Lanes resists = fill;
        if constexpr (has.fracture) resists = (before >> spring & 1) != 0 ? Lanes{} : fill;
        stretch = flow(stretch, rest_length, k.spring[s.kind], k, resists, memory.flowed[spring],
                       memory.strain[spring], sums);
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
