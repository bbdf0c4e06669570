// Bases of full frames, eight at a time.
#pragma once
#include "mapping/frame.h"

namespace flexel {

// (count) The base that each frame spans in `points`, as rest_base() of mapping/frame.h builds it; what comes
// out for kinds other than full means nothing. `orthonormal`: gram_schmidt, else the edges.
void span_bases(const Frame* frames, std::size_t count, const Vec3* points, bool orthonormal, Mat3* base);

// (count) The motions of frames whose bases at rest span_bases() has built: exactly zero where nothing moved,
// and without change where the base now spans no volume. Flags stay 0; kinds other than full are left as they
// are.
void move_frames(const Frame* frames, std::size_t count, const Mat3* rest_base, const Vec3* rest,
                 const Vec3* position, bool orthonormal, FrameMotion* motion);

}  // namespace flexel
