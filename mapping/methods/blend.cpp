// The vertices of a block share their elements, whose motions (twelve numbers each) are gathered once; a
// vertex then needs one weighted sum of them and the sum of weights. Only differences from the first
// element's motion are summed (mapping/methods/blend_kernel.h), so a motion that all elements share is exact
// although weights are single precision.
#include "mapping/methods/blend.h"

#include <algorithm>
#include <cmath>

#include "base/bucket.h"
#include "base/simd.h"
#include "mapping/anchors/blend_weights.h"
#include "mapping/methods/bind.h"
#include "mapping/methods/blend_kernel.h"

namespace flexel::mapping {
namespace {

using namespace simd;

constexpr std::size_t kBlocksAtATime = 8;

// The elements that may carry a group's vertices, as arrays for loops of sixteen at a time.
struct Around {
  std::size_t count = 0;
  std::vector<float> x, y, z;  // in spacings, from the group's home; padded by points outside the radius
  std::vector<float> weight;
  std::vector<std::uint8_t> from;

  void gather(const Body& body, const Groups& groups, const Group& group) {
    constexpr std::size_t kStep = 16;
    constexpr float kNowhere = 1e6f;
    count = group.reach_end - group.reach_begin;
    const std::size_t padded = (count + kStep - 1) / kStep * kStep;
    for (std::vector<float>* column : {&x, &y, &z, &weight}) column->assign(padded, kNowhere);
    from.assign(groups.from.begin() + static_cast<std::ptrdiff_t>(group.reach_begin),
                groups.from.begin() + static_cast<std::ptrdiff_t>(group.reach_end));
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f at = offset(body, group, groups.elements[group.reach_begin + i]).cast<float>();
      x[i] = at.x(), y[i] = at.y(), z[i] = at.z();
    }
  }
};

// An element that only some corners are connected with counts by the weights of those corners.
void apply_shares(const std::array<double, 8>& share, const std::vector<std::uint8_t>& from,
                  ElementsInRadius in_radius) {
  constexpr std::uint8_t kAll = 0xff;
  for (std::size_t k = 0; k < in_radius.count; ++k) {
    const unsigned corners = from[in_radius.element[k]];
    if (corners == kAll) continue;
    double sum = 0;
    for (unsigned a = 0; a < 8; ++a) sum += corners >> a & 1 ? share[a] : 0;
    in_radius.weight[k] *= static_cast<float>(sum);
  }
}

void weigh_block(const Body& body, const Groups& groups, const Groups::Block& block, Around& around,
                 BlockWeights& weights) {
  constexpr std::size_t kRoom = 16, kVerticesAhead = 12;
  const Group& group = groups.groups[block.group];
  around.gather(body, groups, group);
  weights.begin.assign(1, 0);
  std::size_t used = 0;
  for (std::uint32_t i = block.begin; i < block.end; ++i) {
    if (i + kVerticesAhead < groups.vertices.size())
      __builtin_prefetch(&body.surface.vertices[groups.vertices[i + kVerticesAhead]]);
    const Vec3 point = within(body, group, body.surface.vertices[groups.vertices[i]]);
    const Eigen::Vector3f at = point.cast<float>();
    weigh_elements(around.x.data(), around.y.data(), around.z.data(), around.weight.size(), at.data(),
                   around.weight.data());
    if (weights.weight.size() < used + around.weight.size() + kRoom) {
      weights.weight.resize(2 * (used + around.weight.size() + kRoom));
      weights.element.resize(weights.weight.size());
    }
    ElementsInRadius in_radius{&weights.element[used], &weights.weight[used], 0};
    collect_in_radius(around.weight.data(), around.weight.size(), in_radius);
    if (group.in_cell) apply_shares(shares(group, point), around.from, in_radius);
    if (std::none_of(in_radius.weight, in_radius.weight + in_radius.count,
                     [](float weight) { return weight > 0; }))
      in_radius.count = 0;
    for (; in_radius.count % kBlendStep != 0; ++in_radius.count) {
      in_radius.element[in_radius.count] = in_radius.element[0];
      in_radius.weight[in_radius.count] = 0;
    }
    used += in_radius.count;
    weights.begin.push_back(static_cast<std::uint32_t>(used));
  }
}

// For a vertex outside the radius of all elements: the motion of the nearest anchor, the limit of the blend.
Vec3 follow_nearest(const Body& body, const Blend& blend, const Group& group,
                    const std::vector<ElementMotion>& motions, const Vec3& vertex) {
  const std::uint32_t* anchor = blend.groups.elements.data() + group.reach_begin;
  const std::uint32_t nearest =
      *std::min_element(anchor, anchor + (group.in_cell ? 8 : 1), [&](std::uint32_t a, std::uint32_t b) {
        return (body.rest[a] - vertex).squaredNorm() < (body.rest[b] - vertex).squaredNorm();
      });
  const ElementMotion& motion = motions[blend.moving.slot_of[nearest]];
  return motion.displacement + motion.gradient * (vertex - body.rest[nearest]);
}

}  // namespace

Blend make_blend(const Body& body, const Adjacency& connections, const std::vector<VertexAnchor>& anchors,
                 bool keep_weights) {
  Blend blend;
  blend.groups = group_vertices(body, connections, anchors, kBlendSteps, kBlendRadius);
  blend.moving = find_moving_elements(body, connections, blend.groups.elements);
  if (!keep_weights) return blend;
  blend.weights.resize(blend.groups.blocks.size());
  parallel_chunks(blend.weights.size(), kBlocksAtATime, [&](std::size_t begin, std::size_t end) {
    Around around;
    BlockWeights scratch;
    for (std::size_t b = begin; b < end; ++b) {
      weigh_block(body, blend.groups, blend.groups.blocks[b], around, scratch);
      BlockWeights& kept = blend.weights[b];
      const auto used = static_cast<std::ptrdiff_t>(scratch.begin.back());
      kept.begin = scratch.begin;
      kept.element.assign(scratch.element.begin(), scratch.element.begin() + used);
      kept.weight.assign(scratch.weight.begin(), scratch.weight.begin() + used);
    }
  });
  return blend;
}

std::vector<Vec3> apply(const Blend& blend, const Body& body, const std::vector<ElementMotion>& motions) {
  const Groups& groups = blend.groups;
  std::vector<Vec3> displacement;
  resize_touched(displacement, groups.vertices.size());
  parallel_chunks(groups.blocks.size(), kBlocksAtATime, [&](std::size_t begin, std::size_t end) {
    Around around;
    BlockWeights found;
    std::vector<BlendRow> rows;
    std::uint32_t gathered = kNoSlot;  // the group whose rows these are
    for (std::size_t b = begin; b < end; ++b) {
      const Groups::Block& block = groups.blocks[b];
      const Group& group = groups.groups[block.group];
      const std::uint32_t* element = &groups.elements[group.reach_begin];
      const Vec3& centre = body.rest[*element];
      const ElementMotion& first = motions[blend.moving.slot_of[*element]];
      if (gathered != block.group) {
        rows.resize(group.reach_end - group.reach_begin);
        make_blend_rows(element, rows.size(), body.rest.data(), blend.moving.slot_of.data(), motions.data(),
                        rows.data());
      }
      gathered = block.group;
      if (blend.weights.empty()) weigh_block(body, groups, block, around, found);
      const BlockWeights& weights = blend.weights.empty() ? found : blend.weights[b];
      if (b + 1 < blend.weights.size()) {
        fetch(blend.weights[b + 1].weight.data(), kWeightsFetched * sizeof(float));
        fetch(blend.weights[b + 1].element.data(), kWeightsFetched * sizeof(std::uint16_t));
      }
      mapping::blend(
          {&groups.vertices[block.begin], block.end - block.begin, groups.vertices.size() - block.begin,
           weights.begin.data(), weights.element.data(), weights.weight.data()},
          rows.data(), first, centre, body.surface.vertices.data(), displacement.data());
      for (std::uint32_t i = block.begin; i < block.end; ++i)
        if (weights.begin[i - block.begin] == weights.begin[i - block.begin + 1]) {
          const std::uint32_t v = groups.vertices[i];
          displacement[v] = follow_nearest(body, blend, group, motions, body.surface.vertices[v]);
        }
    }
  });
  return displacement;
}

std::vector<Vec3> BlendBinding::apply(const Binding& binding, const Body& body,
                                      const std::vector<Vec3>& position) const {
  return mapping::apply(blend, body, element_motions(blend.moving, body, binding.connections, position));
}

const Blend& blend_of(const Binding& binding) {
  return dynamic_cast<const BlendBinding&>(*binding.kept).blend;
}

namespace {

std::shared_ptr<const MethodBinding> bind_blended(MethodInput& input) {
  auto kept = std::make_shared<BlendBinding>();
  kept->blend = make_blend(input.body, input.connections, input.anchors, input.states > 1);
  return kept;
}

}  // namespace

constinit const MappingMethod kBlended{.name = "blended", .bind = bind_blended};

}  // namespace flexel::mapping
