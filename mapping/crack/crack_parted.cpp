// The 28 pairs of corners of every broken cell, less those that a whole cell still joins.
#include "mapping/crack/crack_parted.h"

#include <algorithm>
#include <bit>

namespace flexel::mapping {

PartedPairs::PartedPairs(const Body& body, const Components& fragments, const Adjacency& connections)
    : connections_(connections), inside_(body.parts.size(), 0) {
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    if (!body.broken[c]) continue;
    const auto& corners = body.cell_elements[c];
    for (unsigned i = 0; i < 8; ++i)
      for (unsigned j = 0; j < i; ++j) {
        const auto [low, high] = std::minmax(corners[i], corners[j]);
        if (connected(low, high)) continue;
        pairs_.push_back(std::uint64_t{low} << 32 | high);
        if (std::has_single_bit(i ^ j) && fragments.of[low] == fragments.of[high])
          inside_[fragments.list[fragments.of[low]].part] = 1;
      }
  }
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
}

bool PartedPairs::connected(std::uint32_t a, std::uint32_t b) const {
  const auto around = connections_.of(a);
  return a == b || std::find(around.begin(), around.end(), b) != around.end();
}

bool PartedPairs::contains(std::uint32_t a, std::uint32_t b) const {
  const auto [low, high] = std::minmax(a, b);
  return std::binary_search(pairs_.begin(), pairs_.end(), std::uint64_t{low} << 32 | high);
}

}  // namespace flexel::mapping
