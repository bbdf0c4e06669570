// gram-schmidt and affine: each distinct frame is rebuilt once from the deformed elements; a vertex then
// moves by a translation and a 3x3 product. With every method, the handedness of the vertex's deformed frame
// shows an inversion. The Voronoi check compares the distance to the origin with those to the elements
// connected with it: O(1), and sufficient unless the body folds onto itself.
#include "mapping/methods/apply.h"

#include <cmath>

#include "base/bucket.h"
#include "mapping/anchors/frame_kernel.h"
#include "mapping/methods/smooth.h"

namespace flexel::mapping {
namespace {

// A vertex within this share of the distance between two elements from the plane half-way between them is as
// near to one as to the other.
constexpr double kTie = 0.01;

// True when an element connected with `origin` is now nearer to the moved vertex, and was farther at rest: a
// vertex that lay half-way between two has no cell that it could leave.
bool left_its_cell(const Binding& binding, const Body& body, const std::vector<Vec3>& position,
                   std::uint32_t origin, const Vec3& rest_vertex, const Vec3& vertex) {
  const double now = (vertex - position[origin]).squaredNorm();
  const double at_rest = (rest_vertex - body.rest[origin]).squaredNorm();
  for (const std::uint32_t other : binding.connections.of(origin)) {
    // The difference of squared distances is twice the distance of the elements times that from the plane.
    const double tie = 2 * kTie * (body.rest[other] - body.rest[origin]).squaredNorm();
    if (now - (vertex - position[other]).squaredNorm() > tie &&
        at_rest - (rest_vertex - body.rest[other]).squaredNorm() < -tie)
      return true;
  }
  return false;
}

}  // namespace

std::vector<Vec3> apply(const Binding& binding, const Body& body, const std::vector<Vec3>& position) {
  if (binding.method == MapMethod::blended)
    return apply(binding.blend, body,
                 element_motions(binding.blend.moving, body, binding.connections, position));
  if (binding.method == MapMethod::smooth)
    return apply_smooth(binding.groups, body, binding.frames, binding.frame, position);
  constexpr std::size_t kFramesAtATime = 1024, kVerticesAtATime = 8192;
  std::vector<Carrier> carrier;
  resize_touched(carrier, binding.frames.size() + 1);
  parallel_chunks(binding.frames.size(), kFramesAtATime, [&](std::size_t begin, std::size_t end) {
    move_frames(&binding.frames[begin], end - begin, &binding.rest_base[begin], body.rest.data(),
                position.data(), binding.method == MapMethod::gram_schmidt, &carrier[begin]);
    for (std::size_t f = begin; f < end; ++f) {
      if (binding.frames[f].kind == FrameKind::full) continue;
      const FrameMotion motion = frame_motion(binding.frames[f], body.rest, position, binding.method);
      carrier[f] << motion.translation, motion.change;
    }
  });
  std::vector<Vec3> displacement;
  resize_touched(displacement, binding.frame.size());
  parallel_chunks(displacement.size(), kVerticesAtATime, [&](std::size_t begin, std::size_t end) {
    carry(carrier.data(), &binding.frame[begin], &binding.coordinates[begin], end - begin,
          &displacement[begin]);
  });
  return displacement;
}

std::vector<std::uint8_t> judge(const Binding& binding, const Body& body, const std::vector<Vec3>& position,
                                const std::vector<Vec3>& displacement) {
  std::vector<std::uint8_t> of_frame(binding.frames.size());
  parallel_for_each(of_frame.size(), [&](std::size_t f) {
    of_frame[f] = frame_motion(binding.frames[f], body.rest, position, binding.method).flags;
  });
  std::vector<std::uint8_t> flags(displacement.size(), 0);
  parallel_for_each(flags.size(), [&](std::size_t v) {
    if (!displacement[v].allFinite()) {
      flags[v] = kNotFinite;
    } else if (binding.referenced[v]) {
      const Vec3& vertex = body.surface.vertices[v];
      const std::uint32_t origin = binding.frames[binding.frame[v]].elements[0];
      flags[v] = of_frame[binding.frame[v]];
      if (left_its_cell(binding, body, position, origin, vertex, vertex + displacement[v]))
        flags[v] |= kVoronoiCellLeft;
    }
  });
  return flags;
}

}  // namespace flexel::mapping
