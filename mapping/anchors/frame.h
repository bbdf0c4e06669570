// Frames: the elements that carry a vertex, and the base that they span.
#pragma once
#include "formats/lattice/body.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// A base with a smaller normalised determinant is not taken at rest ...
constexpr double kWellConditioned = 0.1;
// ... and one below this, once deformed, spans no volume any more.
constexpr double kDegenerate = 1e-6;

// Determinant of the three edges over the product of their lengths: 1 for orthogonal edges, 0 for edges in a
// plane; negative when left-handed.
[[nodiscard]] double normalised_determinant(const Vec3& a, const Vec3& b, const Vec3& c);
// Sine of the angle between two edges.
[[nodiscard]] double sine(const Vec3& a, const Vec3& b);

// The base of a frame, columns in m (affine edges) or unit length (orthonormal axes), world frame.
// `orthonormal`: the paper's base (section 6.1.2); else the edges themselves.
// Kinds with fewer than four elements complete it: a plane by its unit normal, a line by the two axes that
// the smallest rotation from its direction at rest carries along (the axes at rest are arbitrary but fixed);
// a rigid frame has the world's axes, whatever its elements do.
[[nodiscard]] Mat3 rest_base(const Frame& frame, const std::vector<Vec3>& rest, bool orthonormal);

// How a frame has moved. A vertex with coordinates c in the rest base moves by translation + change * c:
// exactly zero where its elements did not move.
struct FrameMotion {
  Vec3 translation = Vec3::Zero();  // of the origin, m
  Mat3 change = Mat3::Zero();       // deformed base - rest base
  std::uint8_t flags = 0;           // kFrameInverted, kFrameDegenerate
};
// `flags` are the same for both bases.
[[nodiscard]] FrameMotion frame_motion(const Frame& frame, const std::vector<Vec3>& rest,
                                       const std::vector<Vec3>& position, bool orthonormal);

// (frames) The deformation gradient of each, by its edges: the identity where nothing moved.
[[nodiscard]] std::vector<Mat3> deformation_gradients(const std::vector<Frame>& frames,
                                                      const std::vector<Vec3>& rest,
                                                      const std::vector<Vec3>& position);

// Half a voxel's diagonal, in spacings.
constexpr double kHalfDiagonal = 0.86602540378443864676;
// Distance in spacings of `point` from the frame's origin at rest, less half a voxel's diagonal.
[[nodiscard]] double distance_outside(const Body& body, const Frame& frame, const Vec3& point);

}  // namespace flexel::mapping
