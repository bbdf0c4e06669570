// `blended`: the frames of the elements around a vertex, with Wendland's weights.
#pragma once
#include "mapping/anchors/vertex_batches.h"
#include "mapping/methods/element_motion.h"
#include "mapping/methods/method.h"

namespace flexel::mapping {

// Weights of the elements that a block of vertices uses, packed vertex after vertex.
struct BlockWeights {
  std::vector<std::uint32_t> begin;    // (vertices of the block + 1)
  std::vector<std::uint16_t> element;  // number within the group's elements
  std::vector<float> weight;           // relative to each other; a vertex's last may be 0 (kBlendStep)
};

// The data of `blended` at rest.
struct Blend {
  Groups groups;
  MovingElements moving;
  std::vector<BlockWeights> weights;  // (blocks); empty: found again each time, which takes no memory
};

// `keep_weights`: about 150 bytes a vertex, which pays when several states are mapped.
[[nodiscard]] Blend make_blend(const Body& body, const Adjacency& connections,
                               const std::vector<VertexAnchor>& anchors, bool keep_weights);

// (vertices x 3) m. The displacement of vertex x is
//   u(x) = sum_e w_e (d_e + G_e (x - X_e)) / sum_e w_e
// over the elements e of its group, with their motions d_e, G_e, rest positions X_e, and w_e = wendland(|x -
// X_e| / R) times the weight of the anchors that are connected with e. A vertex without an element in the
// radius follows its nearest anchor, the limit of the blend. `motions`: of blend.moving.elements.
[[nodiscard]] std::vector<Vec3> apply(const Blend& blend, const Body& body,
                                      const std::vector<ElementMotion>& motions);

struct BlendBinding final : MethodBinding {
  Blend blend;
  [[nodiscard]] std::vector<Vec3> apply(const Binding& binding, const Body& body,
                                        const std::vector<Vec3>& position) const override;
};
// What a binding of `blended` keeps.
[[nodiscard]] const Blend& blend_of(const Binding& binding);

}  // namespace flexel::mapping
