// The weights of the elements' displacements do not depend on the state, but are too many to keep (about 60 a
// vertex): they are found again for each state, a block of vertices at a time, eight vertices at once
// (mapping/methods/smooth_fit.h).
#include "mapping/methods/smooth.h"

#include <Eigen/LU>
#include <algorithm>

#include "base/parallel.h"
#include "mapping/anchors/blend_weights.h"
#include "mapping/anchors/frame.h"
#include "mapping/methods/bind.h"
#include "mapping/methods/smooth_fit.h"

namespace flexel::mapping {
namespace {

constexpr std::size_t kBlocksAtATime = 4;

// How the quadruple of a vertex moves: A(y) = displacement + gradient (y - origin).
struct FrameField {
  Vec3 displacement = Vec3::Zero(), origin = Vec3::Zero();
  Mat3 gradient = Mat3::Zero();
  [[nodiscard]] Vec3 at(const Vec3& point) const { return displacement + gradient * (point - origin); }
};

// The displacements of what the group reaches, less `reference` at the group's first element.
void gather(const Body& body, const Groups& groups, const Group& group, const std::vector<Vec3>& position,
            const FrameField& reference, std::vector<SmoothNeighbour>& neighbours) {
  neighbours.clear();
  const Vec3& centre = body.rest[groups.elements[group.reach_begin]];
  for (std::uint64_t i = group.reach_begin; i < group.reach_end; ++i) {
    const std::uint32_t e = groups.elements[i];
    neighbours.push_back({offset(body, group, e), body.rest[e] - centre,
                          position[e] - body.rest[e] - reference.at(body.rest[e]),
                          group.in_cell ? groups.from[i] : std::uint8_t{0xff}});
  }
}

// Eight vertices of a group, or what is left of them.
struct Octet {
  std::array<std::uint32_t, kSmoothLanes> vertex{};
  int count = 0;
  SmoothPoints points{};
  Vec3 low, high;  // of the points, in spacings

  Octet(const Body& body, const Groups& groups, const Group& group, std::uint32_t begin, std::uint32_t end) {
    count = static_cast<int>(std::min<std::uint32_t>(end - begin, kSmoothLanes));
    for (int l = 0; l < kSmoothLanes; ++l) {
      vertex[l] = groups.vertices[begin + static_cast<std::uint32_t>(std::min(l, count - 1))];
      const Vec3 point = within(body, group, body.surface.vertices[vertex[l]]);
      for (int axis = 0; axis < 3; ++axis) points.at[axis][l] = point[axis];
      const std::array<double, 8> share = shares(group, point);
      for (std::size_t a = 0; a < 8; ++a) points.share[a][l] = share[a];
      low = l == 0 ? point : Vec3(low.cwiseMin(point));
      high = l == 0 ? point : Vec3(high.cwiseMax(point));
    }
  }

  // Those of `all` within the radius of the points' bounding box.
  void choose(const std::vector<SmoothNeighbour>& all, std::vector<SmoothNeighbour>& chosen) const {
    chosen.clear();
    for (const SmoothNeighbour& neighbour : all)
      if ((neighbour.at - neighbour.at.cwiseMax(low).cwiseMin(high)).squaredNorm() <
          kSmoothRadius * kSmoothRadius)
        chosen.push_back(neighbour);
  }
};

// Displacement of vertex `l` of the octet, which rests at `vertex`. What is fitted is what its own field
// leaves over: sum_e c_e (u_e - A(X_e)), with u_e and A less `reference` both.
Vec3 evaluate(const SmoothFit& fit, int l, const FrameField& field, const FrameField& reference,
              const Vec3& centre, const Vec3& vertex) {
  const Vec3 along = field.at(vertex);
  if (!(fit.weight[l] > 0)) return along;
  const Vec3 at_centre = field.at(centre) - reference.at(centre);
  const Mat3 gradient = field.gradient - reference.gradient;
  const Vec3 rest(fit.rest[0][l], fit.rest[1][l], fit.rest[2][l]);
  const Vec3 displacement(fit.displacement[0][l], fit.displacement[1][l], fit.displacement[2][l]);
  return along + displacement - fit.value[l] * at_centre - gradient * rest;
}

std::vector<FrameField> frame_fields(const Body& body, const std::vector<Frame>& frames,
                                     const std::vector<Vec3>& position) {
  std::vector<FrameField> fields(frames.size());
  parallel_for_each(frames.size(), [&](std::size_t f) {
    const FrameMotion motion = frame_motion(frames[f], body.rest, position, false);
    fields[f] = {motion.translation, body.rest[frames[f].elements[0]],
                 motion.change * rest_base(frames[f], body.rest, false).inverse()};
  });
  return fields;
}

}  // namespace

std::vector<Vec3> SmoothBinding::apply(const Binding& binding, const Body& body,
                                       const std::vector<Vec3>& position) const {
  const std::vector<std::uint32_t>& frame_of = binding.frame;
  const std::vector<FrameField> fields = frame_fields(body, binding.frames, position);
  std::vector<Vec3> displacement(groups.vertices.size());
  parallel_chunks(groups.blocks.size(), kBlocksAtATime, [&](std::size_t begin, std::size_t end) {
    std::vector<SmoothNeighbour> neighbours, chosen;
    std::vector<double> weights;
    SmoothFit fit;
    for (std::size_t b = begin; b < end; ++b) {
      const Groups::Block& block = groups.blocks[b];
      const Group& group = groups.groups[block.group];
      const Vec3& centre = body.rest[groups.elements[group.reach_begin]];
      // All vertices of a cell use the elements of its frames, so what did not move stays exactly at rest.
      const FrameField reference =
          group.in_cell ? fields[frame_of[groups.vertices[block.begin]]] : FrameField{};
      gather(body, groups, group, position, reference, neighbours);
      for (std::uint32_t i = block.begin; i < block.end; i += kSmoothLanes) {
        const Octet octet(body, groups, group, i, block.end);
        octet.choose(neighbours, chosen);
        fit_quadratics(chosen.data(), chosen.size(), octet.points, weights, fit);
        for (int l = 0; l < octet.count; ++l) {
          const std::uint32_t v = octet.vertex[l];
          displacement[v] =
              evaluate(fit, l, fields[frame_of[v]], reference, centre, body.surface.vertices[v]);
        }
      }
    }
  });
  return displacement;
}

namespace {

std::shared_ptr<const MethodBinding> bind_smooth(MethodInput& input) {
  auto kept = std::make_shared<SmoothBinding>();
  kept->groups = group_vertices(input.body, input.connections, input.anchors, kSmoothSteps, kSmoothRadius);
  return kept;
}

}  // namespace

constinit const MappingMethod kSmooth{.name = "smooth", .bind = bind_smooth};

}  // namespace flexel::mapping
