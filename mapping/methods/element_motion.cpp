// Displacements, not positions, are fitted: what did not move gives exactly nothing. The fit of a rigid or
// affine motion is exact, whatever the weights.
#include "mapping/methods/element_motion.h"

#include <Eigen/LU>
#include <numeric>

#include "base/bucket.h"
#include "mapping/anchors/search.h"
#include "mapping/methods/blend_kernel.h"

namespace flexel::mapping {
namespace {

// The moments of three unit edges have the square of their normalised determinant.
constexpr double kSmallestMoments = kWellConditioned * kWellConditioned;

constexpr std::size_t kElementsAtATime = 1024;

// Sum of e e^T over the edges' directions e.
Mat3 moments(const Body& body, const Adjacency& connections, std::uint32_t element) {
  Mat3 sum = Mat3::Zero();
  for (const std::uint32_t other : connections.of(element)) {
    const Vec3 edge = body.rest[other] - body.rest[element];
    const double squared_length = edge.squaredNorm();
    if (squared_length > 0) sum += edge * edge.transpose() / squared_length;
  }
  return sum;
}

bool spans_space(const Mat3& moments) {
  const double mean = moments.trace() / 3;
  return mean > 0 && (moments / mean).determinant() >= kSmallestMoments;
}

Mat3 frame_gradient(const Body& body, const Frame& frame, const std::vector<Vec3>& position) {
  const FrameMotion motion = frame_motion(frame, body.rest, position, false);
  return motion.change * rest_base(frame, body.rest, false).inverse();
}

}  // namespace

MovingElements find_moving_elements(const Body& body, const Adjacency& connections,
                                    const std::vector<std::uint32_t>& wanted) {
  constexpr int kOctant = 7;  // whichever: the frame stands for all sides of the element
  MovingElements moving;
  moving.slot_of.assign(body.element_count(), kNoSlot);
  for (const std::uint32_t element : wanted) moving.slot_of[element] = 0;
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    if (moving.slot_of[e] == 0) {
      moving.slot_of[e] = static_cast<std::uint32_t>(moving.elements.size());
      moving.elements.push_back(e);
    }
  const std::size_t n = moving.elements.size();
  moving.inverse_moments.resize(n);
  moving.frame.assign(n, kNoSlot);
  std::vector<std::uint8_t> flat(n, 0);
  parallel_for_each(n, [&](std::size_t i) {
    const Mat3 sum = moments(body, connections, moving.elements[i]);
    flat[i] = !spans_space(sum);
    moving.inverse_moments[i] = flat[i] ? Mat3(Mat3::Zero()) : Mat3(sum.inverse());
  });
  const std::vector<std::uint32_t> part = element_parts(body);
  for (std::size_t i = 0; i < n; ++i) {
    if (!flat[i]) continue;
    const std::uint32_t element = moving.elements[i];
    moving.frame[i] = static_cast<std::uint32_t>(moving.frames.size());
    moving.frames.push_back(find_frame(body, connections, body.parts[part[element]], element, kOctant));
  }
  return moving;
}

std::vector<ElementMotion> element_motions(const MovingElements& moving, const Body& body,
                                           const Adjacency& connections, const std::vector<Vec3>& position) {
  const std::size_t n = moving.elements.size();
  std::vector<ElementMotion> motions;
  resize_touched(motions, n);
  std::vector<double> displacement;  // (elements x 4) m
  resize_touched(displacement, 4 * position.size());
  parallel_for_each(position.size(), [&](std::size_t e) {
    for (int axis = 0; axis < 3; ++axis) displacement[4 * e + axis] = position[e][axis] - body.rest[e][axis];
  });
  parallel_chunks(n, kElementsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      motions[i].displacement = position[moving.elements[i]] - body.rest[moving.elements[i]];
      if (moving.frame[i] != kNoSlot)
        motions[i].gradient = frame_gradient(body, moving.frames[moving.frame[i]], position);
    }
    fit_gradients(&moving.elements[begin], &moving.frame[begin], end - begin, connections, body.rest.data(),
                  displacement.data(), &moving.inverse_moments[begin], &motions[begin]);
  });
  return motions;
}

}  // namespace flexel::mapping
