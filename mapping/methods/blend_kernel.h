// The arithmetic of `blended`, many numbers at a time.
#pragma once
#include <cstdint>

#include "mapping/methods/element_motion.h"

namespace flexel::mapping {

// How far the motion of an element departs from that of its group's first element, seen from that element:
// displacement, 1 (whose sum is that of the weights), then the gradient by columns, each with a zero behind
// it.
struct alignas(64) BlendRow {
  double value[16];
};

// (count) `elements`: the group's; `slot_of` leads to their motions.
void make_blend_rows(const std::uint32_t* elements, std::size_t count, const Vec3* rest,
                     const std::uint32_t* slot_of, const ElementMotion* motions, BlendRow* rows);

// A vertex hears this many elements, or a multiple: with weight 0 what is missing.
constexpr std::size_t kBlendStep = 4;

// The vertices of a block, and the elements that each hears: those that `element` lists from begin[i] to
// begin[i + 1].
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

// What one vertex hears: elements by their number in the group.
struct ElementsInRadius {
  std::uint16_t* element;
  float* weight;
  std::size_t count;
};

// Lists the elements whose weight (count, a multiple of 16) is not 0, behind which there must be room for
// sixteen more.
void collect_in_radius(const float* weight, std::size_t count, ElementsInRadius& heard);

// The least-squares gradients of `count` elements: element[i]'s from the displacements (x, y, z, 0; m) of
// what it is connected with. `inverse_moments`, `motion`: (count); see mapping/methods/element_motion.h. Elements
// with a frame (frame[i] other than kNoSlot) are left out.
void fit_gradients(const std::uint32_t* element, const std::uint32_t* frame, std::size_t count,
                   const Adjacency& connections, const Vec3* rest, const double* displacement,
                   const Mat3* inverse_moments, ElementMotion* motion);

}  // namespace flexel::mapping
