// Whatever the method, the handedness of the vertex's deformed frame shows an inversion. The Voronoi check
// compares the distance to the origin with those to the elements connected with it: O(1), and sufficient unless
// the body folds onto itself.
#include "mapping/methods/apply.h"

#include <cmath>

#include "base/parallel.h"
#include "mapping/anchors/frame.h"

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
  return binding.kept->apply(binding, body, position);
}

std::vector<std::uint8_t> judge(const Binding& binding, const Body& body, const std::vector<Vec3>& position,
                                const std::vector<Vec3>& displacement) {
  std::vector<std::uint8_t> of_frame(binding.frames.size());
  parallel_for_each(of_frame.size(), [&](std::size_t f) {
    of_frame[f] = frame_motion(binding.frames[f], body.rest, position, false).flags;
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
