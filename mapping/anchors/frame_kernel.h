// Bases of full frames, eight at a time, and the vertices that they carry.
#pragma once
#include <algorithm>

#include "mapping/anchors/frame.h"

namespace flexel::mapping {

// FrameMotion as apply() needs it: the translation, then the columns of the change.
using AffineMap = Eigen::Matrix<double, 3, 4>;

// (count) The base that each frame spans in `points`, as rest_base() of mapping/anchors/frame.h builds it; what comes
// out for kinds other than full means nothing. `orthonormal`: gram_schmidt, else the edges.
void span_bases(const Frame* frames, std::size_t count, const Vec3* points, bool orthonormal, Mat3* base);

// The frames as binding needs them.
struct RestFrames {
  std::vector<Mat3> base;           // (frames) at rest
  std::vector<AffineMap> to_base;   // (frames + 1) the origin at rest, then the inverse of the base
  std::vector<std::uint32_t> part;  // (frames)
  std::vector<Mat3> to_spacings;    // (parts) world frame, m -> the lattice's axes, spacings
};

// Largest values over vertices: of the squared distance of a vertex, rebuilt from its coordinates, from
// itself (m^2), and of that from the origin of its frame (spacings^2).
struct Extremes {
  double squared_residual = 0, squared_outside = 0;
  void include(const Extremes& other) {
    squared_residual = std::max(squared_residual, other.squared_residual);
    squared_outside = std::max(squared_outside, other.squared_outside);
  }
};

// (count) The coordinates of vertices in the rest bases of their frames, written where there is room
// (`coordinates` may be null); extremes over those that are referenced.
Extremes coordinates_in(const RestFrames& rest, const std::uint32_t* frame, const Vec3* vertices,
                        const std::uint8_t* referenced, std::size_t count, Vec3* coordinates);

// (count) The motions of frames whose bases at rest span_bases() has built: exactly zero where nothing moved,
// and without change where the base now spans no volume. Kinds other than full are left as they are.
void move_frames(const Frame* frames, std::size_t count, const Mat3* rest_base, const Vec3* rest,
                 const Vec3* position, bool orthonormal, AffineMap* map);

// (count) Displacements of vertices with these coordinates in the rest bases of their frames. One more
// map than there are frames must be there to be read.
void apply_affine(const AffineMap* map, const std::uint32_t* frame, const Vec3* coordinates,
                  std::size_t count, Vec3* displacement);

}  // namespace flexel::mapping
