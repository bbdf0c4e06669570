// Breadth first, from all anchors at once: a byte an element tells which anchors reach it, and a step hands
// on what the step before has brought.
#include "mapping/reach.h"

#include <algorithm>

namespace flexel {
namespace {

constexpr std::size_t kTable = 1024;  // a power of two; twice what three steps from a whole cell reach

}  // namespace

ReachFinder::ReachFinder(const Adjacency& connections) : connections_(connections), table_(kTable, 0) {}

std::uint32_t ReachFinder::number_of(std::uint32_t element) {
  const std::size_t last = table_.size() - 1;
  std::size_t at = (element * std::size_t{0x9e3779b97f4a7c15u} >> 20) & last;
  for (; table_[at] != 0; at = (at + 1) & last)
    if (reach_.elements[table_[at] - 1] == element) return table_[at] - 1;
  reach_.elements.push_back(element);
  reach_.from.push_back(0);
  gained_.push_back(0);
  table_[at] = static_cast<std::uint32_t>(reach_.elements.size());
  if (2 * reach_.elements.size() > table_.size()) grow();
  return static_cast<std::uint32_t>(reach_.elements.size() - 1);
}

void ReachFinder::grow() {
  table_.assign(2 * table_.size(), 0);
  const std::size_t last = table_.size() - 1;
  for (std::size_t i = 0; i < reach_.elements.size(); ++i) {
    std::size_t at = (reach_.elements[i] * std::size_t{0x9e3779b97f4a7c15u} >> 20) & last;
    while (table_[at] != 0) at = (at + 1) & last;
    table_[at] = static_cast<std::uint32_t>(i + 1);
  }
}

void ReachFinder::spread(std::uint32_t from, std::uint8_t mask) {
  for (const std::uint32_t neighbour : connections_.of(from)) {
    const std::uint32_t number = number_of(neighbour);
    gained_[number] = static_cast<std::uint8_t>(gained_[number] | (mask & ~reach_.from[number]));
  }
}

const Reach& ReachFinder::find(std::span<const std::uint32_t> anchors, int steps) {
  std::fill(table_.begin(), table_.end(), 0u);
  reach_.elements.clear();
  reach_.from.clear();
  gained_.clear();
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    const std::uint32_t number = number_of(anchors[a]);
    gained_[number] = static_cast<std::uint8_t>(gained_[number] | 1u << a);
  }
  std::vector<std::uint8_t> mask;
  for (int step = 0;; ++step) {
    mask = gained_;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      reach_.from[i] = static_cast<std::uint8_t>(reach_.from[i] | mask[i]);
      gained_[i] = 0;
    }
    if (step == steps) return reach_;
    for (std::size_t i = 0; i < mask.size(); ++i)
      if (mask[i] != 0) spread(reach_.elements[i], mask[i]);
  }
}

}  // namespace flexel
