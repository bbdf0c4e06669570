// Pairs of adjacent elements that a fracture disconnected, although they may still be connected elsewhere:
// the faces of cracks that end inside a part.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/lattice/fragments_of_body.h"

namespace flexel::mapping {

class PartedPairs {
 public:
  // `connections`: element_adjacency(body); must outlive this.
  PartedPairs(const Body& body, const Components& fragments, const Adjacency& connections);
  [[nodiscard]] bool connected(std::uint32_t a, std::uint32_t b) const;
  // In corner placement: a broken cell holds both, and no whole one. In centre placement none are known: a
  // connection that broke and one that never was (across a slot) look the same in a body.
  [[nodiscard]] bool contains(std::uint32_t a, std::uint32_t b) const;
  // True when some are neighbours along an axis and of one fragment.
  [[nodiscard]] bool inside(std::uint32_t part) const { return inside_[part] != 0; }

 private:
  const Adjacency& connections_;
  std::vector<std::uint64_t> pairs_;  // lower element << 32 | higher; ascending
  std::vector<std::uint8_t> inside_;  // (parts)
};

}  // namespace flexel::mapping
