// Breadth-first search from all anchors at once: one byte an element holds a bit for each anchor that reached
// it, and each step propagates the bits that the step before added.
#include "mapping/anchors/connected_neighbourhood.h"

#include <algorithm>

namespace flexel::mapping {
namespace {

constexpr std::size_t kTable = 1024;  // a power of two; twice what three steps from a whole cell reach

std::size_t hash_of_element(std::uint32_t element) {
  return element * std::size_t{0x9e3779b97f4a7c15u} >> 20;
}

}  // namespace

ReachFinder::ReachFinder(const Adjacency& connections) : connections_(connections), table_(kTable) {}

std::size_t ReachFinder::free_slot(std::uint32_t number) const {
  const std::size_t last = table_.size() - 1;
  std::size_t at = hash_of_element(number - 1) & last;
  while (table_[at].number != 0) at = (at + 1) & last;
  return at;
}

std::size_t ReachFinder::insert(std::uint32_t element) {
  if (2 * (slots_.size() + 1) > table_.size()) grow();
  const std::size_t at = free_slot(element + 1);
  table_[at].number = element + 1;
  slots_.push_back(static_cast<std::uint32_t>(at));
  return at;
}

inline void ReachFinder::hand(std::uint32_t element, std::uint8_t mask) {
  const std::size_t last = table_.size() - 1;
  const Entry* table = table_.data();
  std::size_t at = hash_of_element(element) & last;
  while (table[at].number != element + 1 && table[at].number != 0) at = (at + 1) & last;
  if (table[at].number == 0) at = insert(element);
  Entry& entry = table_[at];
  entry.gained = static_cast<std::uint8_t>(entry.gained | (mask & ~entry.from));
}

void ReachFinder::grow() {
  std::vector<Entry> taken;
  for (const std::uint32_t slot : slots_) taken.push_back(table_[slot]);
  table_.assign(2 * table_.size(), {});
  for (std::size_t i = 0; i < taken.size(); ++i) {
    slots_[i] = static_cast<std::uint32_t>(free_slot(taken[i].number));
    table_[slots_[i]] = taken[i];
  }
}

const Reach& ReachFinder::find(std::span<const std::uint32_t> anchors, int steps) {
  for (const std::uint32_t slot : slots_) table_[slot] = {};
  slots_.clear();
  for (std::size_t a = 0; a < anchors.size(); ++a) hand(anchors[a], static_cast<std::uint8_t>(1u << a));
  for (int step = 0;; ++step) {
    mask_.clear();
    for (const std::uint32_t slot : slots_) {
      Entry& entry = table_[slot];
      mask_.push_back(entry.gained);
      entry.from = static_cast<std::uint8_t>(entry.from | entry.gained);
      entry.gained = 0;
    }
    if (step == steps) break;
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      if (mask_[i] == 0) continue;
      for (const std::uint32_t neighbour : connections_.of(table_[slots_[i]].number - 1))
        hand(neighbour, mask_[i]);
    }
  }
  reach_.elements.clear();
  reach_.from.clear();
  for (const std::uint32_t slot : slots_) {
    reach_.elements.push_back(table_[slot].number - 1);
    reach_.from.push_back(table_[slot].from);
  }
  return reach_;
}

}  // namespace flexel::mapping
