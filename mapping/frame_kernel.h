// Bases of full frames, eight at a time, and the vertices that they carry.
#pragma once
#include "mapping/frame.h"

namespace flexel {

// FrameMotion as apply() needs it: the translation, then the columns of the change.
using Carrier = Eigen::Matrix<double, 3, 4>;

// (count) The base that each frame spans in `points`, as rest_base() of mapping/frame.h builds it; what comes
// out for kinds other than full means nothing. `orthonormal`: gram_schmidt, else the edges.
void span_bases(const Frame* frames, std::size_t count, const Vec3* points, bool orthonormal, Mat3* base);

// (count) The motions of frames whose bases at rest span_bases() has built: exactly zero where nothing moved,
// and without change where the base now spans no volume. Kinds other than full are left as they are.
void move_frames(const Frame* frames, std::size_t count, const Mat3* rest_base, const Vec3* rest,
                 const Vec3* position, bool orthonormal, Carrier* carrier);

// (count) Displacements of vertices with these coordinates in the rest bases of their frames. One more
// carrier than there are frames must be there to be read.
void carry(const Carrier* carrier, const std::uint32_t* frame, const Vec3* coordinates, std::size_t count,
           Vec3* displacement);

}  // namespace flexel
