// The fragments of a body: its connected components.
#pragma once
#include <cstdint>
#include <vector>

#include "base/disjoint_sets.h"
#include "formats/lattice/body.h"

namespace flexel {

struct Component {
  std::uint32_t part = 0;
  std::uint32_t elements = 0;
};

struct Components {
  std::vector<std::uint32_t> of;      // (elements) index into list
  std::vector<Component> list;        // by part, then most elements first, then lowest element
  std::vector<std::uint32_t> offset;  // (parts + 1) a part's fragments in list
  // Debris: an element that nothing holds any more, in a part that has other fragments.
  [[nodiscard]] bool debris(std::uint32_t fragment) const {
    const std::uint32_t part = list[fragment].part;
    return list[fragment].elements == 1 && offset[part + 1] - offset[part] > 1;
  }
  [[nodiscard]] bool in_pieces(std::uint32_t part) const { return offset[part + 1] - offset[part] > 1; }
};

// Sets of elements that `connections` join, directly or through others.
[[nodiscard]] DisjointSets connected_elements(const Adjacency& connections);

// Connected components of `connections`, which element_adjacency(body) gives.
[[nodiscard]] Components find_components(const Body& body, const Adjacency& connections);

// The note that lists the voxels that went: "PART I J K" a line, PART counted from 0, I J K the voxel's
// lattice index.
constexpr const char* kCarvedNote = "carved";

// Whether fragments need looking for: a body without broken cells is spared the search.
[[nodiscard]] bool may_be_broken(const Body& body);

}  // namespace flexel
