// Which elements a vertex may use: those that a short way along connections joins to where it sits.
// Everything that looks farther than one frame (blended, smooth, the evaluator) asks here, so that nothing
// reaches across a broken or absent connection or to another part.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "formats/body.h"

namespace flexel {

// Elements, and from which anchors each is reached.
struct Reach {
  std::vector<std::uint32_t> elements;  // anchors first, then by distance in connections
  std::vector<std::uint8_t> from;       // (elements) bit a: from anchor a
};

// Finds reaches; keeps its room between calls. One for each thread.
class ReachFinder {
 public:
  // `connections` must outlive this.
  explicit ReachFinder(const Adjacency& connections);

  // The elements that are at most `steps` connections away from one of `anchors` (1 to 8 of them: the corners
  // of a cell, or one element). The reference is good until the next call.
  [[nodiscard]] const Reach& find(std::span<const std::uint32_t> anchors, int steps);

 private:
  [[nodiscard]] std::uint32_t number_of(std::uint32_t element);
  void grow();
  void spread(std::uint32_t from, std::uint8_t mask);

  const Adjacency& connections_;
  Reach reach_;
  std::vector<std::uint32_t>
      table_;  // open addressing: number + 1 of the element whose hash leads here, or 0
  std::vector<std::uint8_t> gained_;  // (elements) anchors that reached it in this step
};

}  // namespace flexel
