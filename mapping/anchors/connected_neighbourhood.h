// The elements that may carry a vertex: those within a few connections of its anchor. `blended`, `smooth` and
// SpaceMap use only these, so no influence crosses a broken or absent connection, or goes to another part.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::mapping {

// Elements, and from which anchors each is reached.
struct Reach {
  std::vector<std::uint32_t> elements;  // anchors first, then by distance in connections
  std::vector<std::uint8_t> from;       // (elements) bit a: from anchor a
};

// Finds them; keeps its memory between calls. One for each thread.
class ReachFinder {
 public:
  // `connections` must outlive this.
  explicit ReachFinder(const Adjacency& connections);

  // The elements that are at most `steps` connections away from one of `anchors` (1 to 8 of them: the corners
  // of a cell, or one element). The reference is good until the next call.
  [[nodiscard]] const Reach& find(std::span<const std::uint32_t> anchors, int steps);

 private:
  struct Entry {
    std::uint32_t number = 0;           // of the element + 1; 0: free
    std::uint8_t from = 0, gained = 0;  // anchors that reached it, and those that do so in this step
  };
  [[nodiscard]] std::size_t insert(std::uint32_t element);
  [[nodiscard]] std::size_t free_slot(std::uint32_t number) const;
  void grow();
  // Anchors `mask` reach `element` in this step.
  void hand(std::uint32_t element, std::uint8_t mask);

  const Adjacency& connections_;
  Reach reach_;
  std::vector<Entry> table_;          // open addressing: an element is where its hash leads, or behind that
  std::vector<std::uint32_t> slots_;  // those that are taken, in the order of Reach::elements
  std::vector<std::uint8_t> mask_;    // (slots) what is handed on in this step
};

}  // namespace flexel::mapping
