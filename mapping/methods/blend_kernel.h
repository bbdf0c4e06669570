// The arithmetic of `blended`, by SIMD.
#pragma once
#include <cstdint>

#include "formats/lattice/body.h"
#include "mapping/types/element_motion.h"

namespace flexel::mapping {

// The difference of an element's motion from that of its group's first element, about that element:
// displacement, then 1 (which sums up the weights), then the gradient by columns, a zero after each.
struct alignas(64) BlendRow {
  double value[16];
};

// (count) `elements`: the group's; `slot_of` leads to their motions.
void make_blend_rows(const std::uint32_t* elements, std::size_t count, const Vec3* rest,
                     const std::uint32_t* slot_of, const ElementMotion* motions, BlendRow* rows);

// The list of elements of a vertex is padded to a multiple of this, with weight 0.
constexpr std::size_t kBlendStep = 4;

// The vertices of a block. Vertex i is carried by the elements element[begin[i]] to element[begin[i + 1] -
// 1].
struct BlendedVertices {
  const std::uint32_t* vertex;  // (count)
  std::size_t count, listed;    // `listed`: how many `vertex` goes on to list, which will be next
  const std::uint32_t* begin;   // (count + 1)
  const std::uint16_t* element;
  const float* weight;
};

// blend() fetches weights this far ahead; those before that of a block are for its caller to fetch.
constexpr std::uint32_t kWeightsFetched = 256;

// The displacements of these vertices, which are at `position` at rest: by the motion of their group's first
// element, which is at `centre`, and the blend of how the others depart from it.
void blend(const BlendedVertices& vertices, const BlendRow* rows, const ElementMotion& first,
           const Vec3& centre, const Vec3* position, Vec3* displacement);

// (count, a multiple of 16) wendland(|x - point| / kBlendRadius), all in spacings.
void weigh_elements(const float* x, const float* y, const float* z, std::size_t count, const float* point,
                    float* weight);

// The elements within the radius of one vertex, by their number in the group.
struct ElementsInRadius {
  std::uint16_t* element;
  float* weight;
  std::size_t count;
};

// Appends the elements whose weight (count, a multiple of 16) is not 0. `in_radius` must have space for sixteen
// more than it will hold.
void collect_in_radius(const float* weight, std::size_t count, ElementsInRadius& in_radius);

// The least-squares gradients of `count` elements: element[i]'s from the displacements (x, y, z, 0; m) of
// what it is connected with. `inverse_moments`, `motion`: (count); see mapping/methods/element_motion.h.
// Elements with a frame (frame[i] other than kNoSlot) are left out.
void fit_gradients(const std::uint32_t* element, const std::uint32_t* frame, std::size_t count,
                   const Adjacency& connections, const Vec3* rest, const double* displacement,
                   const Mat3* inverse_moments, ElementMotion* motion);

}  // namespace flexel::mapping
