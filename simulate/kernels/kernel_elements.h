// Elements of a chunk: their state into columns in the lattice frame, and what the forces make of it. Along a
// row of the lattice the body has them one after the other, eight vectors in 24 doubles. Included by
// kernel_table.cpp alone.
#pragma once
#include "simulate/kernels/kernel_state.h"

namespace flexel::simulate::step {
namespace {

template <class T>
struct Triple {
  T at[3];
};

template <class T>
FLEXEL_INLINE Triple<T> to_lattice(const CellConstants& k, const Triple<T>& world) {
  if (k.aligned) return world;
  Triple<T> out;
  for (int j = 0; j < 3; ++j)
    out.at[j] =
        k.axes[3 * j] * world.at[0] + k.axes[3 * j + 1] * world.at[1] + k.axes[3 * j + 2] * world.at[2];
  return out;
}

template <class T>
FLEXEL_INLINE Triple<T> to_world(const CellConstants& k, const Triple<T>& lattice) {
  if (k.aligned) return lattice;
  Triple<T> out;
  for (int i = 0; i < 3; ++i)
    out.at[i] = k.axes[i] * lattice.at[0] + k.axes[3 + i] * lattice.at[1] + k.axes[6 + i] * lattice.at[2];
  return out;
}

// Whether eight ascending numbers follow one another.
template <class T>
FLEXEL_INLINE bool is_row(const T* numbers, std::size_t at, std::size_t count) {
  return at + kLanes <= count && numbers[at + kLanes - 1] - numbers[at] == kLanes - 1;
}

// The vectors of eight elements that follow one another, 24 doubles: their x, y and z, and back.
FLEXEL_INLINE Triple<Lanes> split(const double* from) {
  const Lanes m0 = load(from), m1 = load(from + kLanes), m2 = load(from + 2 * kLanes);
  const auto pick = [&](const LaneBits& of_two, const LaneBits& of_last) __attribute__((always_inline)) {
    return shuffle(shuffle(m0, m1, of_two), m2, of_last);
  };
  return {{pick(LaneBits{0, 3, 6, 9, 12, 15, 0, 0}, LaneBits{0, 1, 2, 3, 4, 5, 10, 13}),
           pick(LaneBits{1, 4, 7, 10, 13, 0, 0, 0}, LaneBits{0, 1, 2, 3, 4, 8, 11, 14}),
           pick(LaneBits{2, 5, 8, 11, 14, 0, 0, 0}, LaneBits{0, 1, 2, 3, 4, 9, 12, 15})}};
}

FLEXEL_INLINE Triple<Lanes> join(const Triple<Lanes>& v) {
  const auto pick = [&](const LaneBits& of_two, const LaneBits& of_last) __attribute__((always_inline)) {
    return shuffle(shuffle(v.at[0], v.at[1], of_two), v.at[2], of_last);
  };
  return {{pick(LaneBits{0, 8, 0, 1, 9, 0, 2, 10}, LaneBits{0, 1, 8, 3, 4, 9, 6, 7}),
           pick(LaneBits{0, 3, 11, 0, 4, 12, 0, 5}, LaneBits{10, 1, 2, 11, 4, 5, 12, 7}),
           pick(LaneBits{13, 0, 6, 14, 0, 7, 15, 0}, LaneBits{0, 13, 2, 3, 14, 5, 6, 15})}};
}

FLEXEL_INLINE void read_row(const ChunkView& chunk, const double* from, std::size_t l,
                            double* const* column) {
  const std::size_t e = 3 * static_cast<std::size_t>(chunk.elements[l]);
  const Triple<Lanes> value = to_lattice(*chunk.constants, split(from + e));
  for (int c = 0; c < 3; ++c) store(column[c] + l, value.at[c]);
}

FLEXEL_INLINE void read_one(const ChunkView& chunk, const double* from, std::size_t l,
                            double* const* column) {
  const double* own = from + 3 * static_cast<std::size_t>(chunk.elements[l]);
  const Triple<double> value = to_lattice(*chunk.constants, Triple<double>{{own[0], own[1], own[2]}});
  for (int c = 0; c < 3; ++c) column[c][l] = value.at[c];
}

template <Damping damping>
void read_elements(const ChunkView& chunk, const StateView& state, const Scratch& scratch) {
  for (std::size_t l = 0; l < chunk.count;) {
    if (is_row(chunk.elements, l, chunk.count)) {
      read_row(chunk, state.displacement, l, scratch.column + kDisplacement);
      if constexpr (damping != Damping::none) read_row(chunk, state.velocity, l, scratch.column + kVelocity);
      l += kLanes;
    } else {
      read_one(chunk, state.displacement, l, scratch.column + kDisplacement);
      if constexpr (damping != Damping::none) read_one(chunk, state.velocity, l, scratch.column + kVelocity);
      ++l;
    }
  }
}

FLEXEL_INLINE Triple<Lanes> row_of(const CellConstants& k, double* const* column, std::size_t l) {
  return join(to_world(k, Triple<Lanes>{{load(column[0] + l), load(column[1] + l), load(column[2] + l)}}));
}

FLEXEL_INLINE Triple<double> one_of(const CellConstants& k, double* const* column, std::size_t l) {
  return to_world(k, Triple<double>{{column[0][l], column[1][l], column[2][l]}});
}

template <Damping damping>
FLEXEL_INLINE void advance_row(const ChunkView& chunk, const StateView& state, const Advance& advance,
                               const Scratch& scratch, std::size_t l) {
  const CellConstants& k = *chunk.constants;
  const std::size_t first = chunk.elements[l], e = 3 * first;
  const Triple<Lanes> force = row_of(k, scratch.column + kForce, l);
  const Lanes gain = advance.kick * load(state.inverse_mass + first);
  constexpr LaneBits own[3] = {{0, 0, 0, 1, 1, 1, 2, 2}, {2, 3, 3, 3, 4, 4, 4, 5}, {5, 5, 6, 6, 6, 7, 7, 7}};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t at = e + c * kLanes;
    Lanes total = force.at[c];
    if (state.outer) total += load(state.outer + at);
    const Lanes before = load(state.velocity + at);
    const Lanes after = before + shuffle(gain, gain, own[c]) * total;
    store(state.velocity + at, after);
    store(state.displacement + at,
          load(state.displacement + at) + advance.drift * (advance.explicit_drift ? before : after));
  }
  if constexpr (damping == Damping::book) {
    const Triple<Lanes> damped = row_of(k, scratch.column + kDampingForce, l);
    for (std::size_t c = 0; c < 3; ++c) store(state.damping_force + e + c * kLanes, damped.at[c]);
  }
}

template <Damping damping>
FLEXEL_INLINE void advance_one(const ChunkView& chunk, const StateView& state, const Advance& advance,
                               const Scratch& scratch, std::size_t l) {
  const CellConstants& k = *chunk.constants;
  const std::size_t e = chunk.elements[l];
  Triple<double> force = one_of(k, scratch.column + kForce, l);
  double* u = state.displacement + 3 * e;
  double* v = state.velocity + 3 * e;
  const double gain = advance.kick * state.inverse_mass[e];
  for (std::size_t c = 0; c < 3; ++c) {
    if (state.outer) force.at[c] += state.outer[3 * e + c];
    const double before = v[c];
    v[c] = before + gain * force.at[c];
    u[c] += advance.drift * (advance.explicit_drift ? before : v[c]);
  }
  if constexpr (damping == Damping::book) {
    const Triple<double> damped = one_of(k, scratch.column + kDampingForce, l);
    for (std::size_t c = 0; c < 3; ++c) state.damping_force[3 * e + c] = damped.at[c];
  }
}

template <Damping damping>
void advance_owned(const ChunkView& chunk, const StateView& state, const Advance& advance,
                   const Scratch& scratch) {
  for (std::size_t o = 0; o < chunk.owned_count;) {
    const std::size_t l = chunk.owned[o];
    if (is_row(chunk.owned, o, chunk.owned_count) && is_row(chunk.elements, l, chunk.count)) {
      advance_row<damping>(chunk, state, advance, scratch, l);
      o += kLanes;
    } else {
      advance_one<damping>(chunk, state, advance, scratch, l);
      ++o;
    }
  }
}

void hand_over_shared(const ChunkView& chunk, double* const* column, double* out) {
  for (std::size_t s = 0; s < chunk.shared_count; ++s) {
    const Triple<double> force = one_of(*chunk.constants, column, chunk.shared[s]);
    for (int c = 0; c < 3; ++c) out[3 * s + c] = force.at[c];
  }
}

}  // namespace
}  // namespace flexel::simulate::step
