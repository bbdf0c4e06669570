// Edges are gathered into SIMD lanes, one lane a frame; the last eight are filled up with copies of the last
// frame.
#include "mapping/anchors/frame_kernel.h"

#include <algorithm>

#include "base/simd.h"

namespace flexel::mapping {
namespace {

using namespace simd;

// By axis of the base, then coordinate.
struct Axes {
  Lanes of[3][3];
};

FLEXEL_INLINE Lanes dot(const Lanes* a, const Lanes* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

FLEXEL_INLINE void gather_edges(const Frame* frames, std::size_t begin, std::size_t count, const Vec3* points,
                                Axes& edges) {
  alignas(64) double value[3][3][kLanes];
  for (std::size_t l = 0; l < kLanes; ++l) {
    const Frame& frame = frames[std::min(begin + l, count - 1)];
    const double* origin = points[frame.elements[0]].data();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double* to = points[frame.elements[axis + 1]].data();
      for (std::size_t c = 0; c < 3; ++c) value[axis][c][l] = to[c] - origin[c];
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t c = 0; c < 3; ++c) edges.of[axis][c] = load_as<Lanes>(value[axis][c]);
}

FLEXEL_INLINE void normalise(Lanes* axis) {
  const Lanes inverse = 1 / square_root(dot(axis, axis));
  for (int c = 0; c < 3; ++c) axis[c] *= inverse;
}

// In place: the first edge's direction, the second's across it, the third's across both.
FLEXEL_INLINE void orthonormalise(Axes& axes) {
  normalise(axes.of[0]);
  const Lanes along = dot(axes.of[1], axes.of[0]);
  for (int c = 0; c < 3; ++c) axes.of[1][c] -= along * axes.of[0][c];
  normalise(axes.of[1]);
  const Lanes first = dot(axes.of[2], axes.of[0]), second = dot(axes.of[2], axes.of[1]);
  for (int c = 0; c < 3; ++c) axes.of[2][c] -= first * axes.of[0][c] + second * axes.of[1][c];
  normalise(axes.of[2]);
}

// True in lanes whose edges span a volume (normalised determinant of kDegenerate or more).
FLEXEL_INLINE auto spans(const Axes& edges) {
  const Lanes *a = edges.of[0], *b = edges.of[1], *c = edges.of[2];
  const Lanes determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                            a[2] * (b[0] * c[1] - b[1] * c[0]);
  const Lanes lengths = dot(a, a) * dot(b, b) * dot(c, c);
  return (determinant * determinant >= kDegenerate * kDegenerate * lengths) & (lengths > 0);
}

// A 3 x 3 matrix times the first three numbers of `by`, summed from the left as Eigen does.
FLEXEL_INLINE FourDoubles product(const double* matrix, const FourDoubles& by) {
  const FourDoubles last = load_as<FourDoubles>(matrix + 5);
  return (load_as<FourDoubles>(matrix) * by[0] + load_as<FourDoubles>(matrix + 3) * by[1]) +
         FourDoubles{last[1], last[2], last[3], 0} * by[2];
}

FLEXEL_INLINE double squared_norm(const FourDoubles& of) {
  return of[0] * of[0] + of[1] * of[1] + of[2] * of[2];
}

}  // namespace

FLEXEL_CLONES void span_bases(const Frame* frames, std::size_t count, const Vec3* points, bool orthonormal,
                              Mat3* base) {
  for (std::size_t begin = 0; begin < count; begin += kLanes) {
    Axes axes;
    gather_edges(frames, begin, count, points, axes);
    if (orthonormal) orthonormalise(axes);
    for (std::size_t f = begin; f < std::min(begin + kLanes, count); ++f)
      for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < 3; ++c) base[f].data()[3 * axis + c] = axes.of[axis][c][f - begin];
  }
}

FLEXEL_CLONES Extremes coordinates_in(const RestFrames& rest, const std::uint32_t* frame,
                                      const Vec3* vertices, const std::uint8_t* referenced, std::size_t count,
                                      Vec3* coordinates) {
  constexpr std::size_t kVerticesAhead = 96, kFramesAhead = 12;
  Extremes largest;
  for (std::size_t v = 0; v < count; ++v) {
    fetch(vertices + v + kVerticesAhead, sizeof(Vec3));
    const std::uint32_t f = frame[v], next = frame[std::min(v + kFramesAhead, count - 1)];
    fetch(&rest.to_base[next], sizeof(AffineMap));
    fetch(&rest.base[next], sizeof(Mat3));
    const double *to_base = rest.to_base[f].data(), *point = vertices[v].data();
    const FourDoubles at{point[0], point[1], point[2], 0}, origin = load_as<FourDoubles>(to_base);
    const FourDoubles away = at - origin, in_base = product(to_base + 3, away);
    if (coordinates)
      for (int c = 0; c < 3; ++c) coordinates[v].data()[c] = in_base[c];
    if (!referenced[v]) continue;
    const FourDoubles residual = origin + product(rest.base[f].data(), in_base) - at;
    const FourDoubles outside = product(rest.to_spacings[rest.part[f]].data(), away);
    largest.include({squared_norm(residual), squared_norm(outside)});
  }
  return largest;
}

FLEXEL_CLONES void move_frames(const Frame* frames, std::size_t count, const Mat3* rest_base,
                               const Vec3* rest, const Vec3* position, bool orthonormal, AffineMap* map) {
  constexpr std::size_t kFramesAhead = 32;
  for (std::size_t begin = 0; begin < count; begin += kLanes) {
    fetch(rest_base + begin + kFramesAhead, kLanes * sizeof(Mat3));
    fetch(map + begin + kFramesAhead, kLanes * sizeof(AffineMap));
    Axes axes;
    gather_edges(frames, begin, count, position, axes);
    const auto spanned = spans(axes);
    if (orthonormal) orthonormalise(axes);
    for (std::size_t f = begin; f < std::min(begin + kLanes, count); ++f) {
      if (frames[f].kind != FrameKind::full) continue;
      const double *now = position[frames[f].elements[0]].data(),
                   *before = rest[frames[f].elements[0]].data();
      double *translation = map[f].data(), *change = translation + 3;
      for (int c = 0; c < 3; ++c) translation[c] = now[c] - before[c];
      for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < 3; ++c)
          change[3 * axis + c] =
              spanned[f - begin] ? axes.of[axis][c][f - begin] - rest_base[f].data()[3 * axis + c] : 0;
    }
  }
}

// Columns are read four numbers at a time, of which the last belongs to what follows. Four vertices are put
// together to twelve numbers without gaps.
FLEXEL_CLONES void apply_affine(const AffineMap* map, const std::uint32_t* frame, const Vec3* coordinates,
                                std::size_t count, Vec3* displacement) {
  constexpr std::size_t kVerticesAhead = 96, kFramesAhead = 16;
  const auto moved = [&](std::size_t v) __attribute__((always_inline)) {
    const double *by = map[frame[v]].data(), *c = coordinates[v].data();
    return load_as<FourDoubles>(by) +
           ((load_as<FourDoubles>(by + 3) * c[0] + load_as<FourDoubles>(by + 6) * c[1]) +
            load_as<FourDoubles>(by + 9) * c[2]);
  };
  const auto write_one = [&](std::size_t v) __attribute__((always_inline)) {
    const FourDoubles value = moved(v);
    __builtin_memcpy(displacement[v].data(), &value, sizeof(Vec3));
  };
  std::size_t v = 0;
  if (count > 0 && reinterpret_cast<std::uintptr_t>(displacement) % 16 != 0) write_one(v++);
  for (; v + 4 <= count; v += 4) {
    fetch(coordinates + v + kVerticesAhead, 4 * sizeof(Vec3));
    fetch(&map[frame[std::min(v + kFramesAhead, count - 1)]], sizeof(AffineMap));
    const FourDoubles a = moved(v), b = moved(v + 1), c = moved(v + 2), d = moved(v + 3);
    double* to = displacement[v].data();
    stream(to, __builtin_shufflevector(a, b, 0, 1, 2, 4));
    stream(to + 4, __builtin_shufflevector(b, c, 1, 2, 4, 5));
    stream(to + 8, __builtin_shufflevector(c, d, 2, 4, 5, 6));
  }
  for (; v < count; ++v) write_one(v);
  finish_streams();
}

}  // namespace flexel::mapping
