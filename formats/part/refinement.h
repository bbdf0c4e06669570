// How polygons were split, so that all that belongs to a surface can be split alike: its columns, the cells under it, the
// file that it came from.
#pragma once
#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "formats/part/surface.h"

namespace flexel {

// Vertices keep their numbers and new ones follow; the pieces of a polygon take its place in the order, and polygons that
// were not split stay as they are.
struct Refinement {
  std::uint32_t vertices = 0;  // before
  // (new vertices) each is half-way between these two, which come before it; both belong to every polygon before that
  // it lies on
  std::vector<std::array<std::uint32_t, 2>> ends;
  std::vector<std::uint32_t> offsets{0}, corners;  // the polygons after, as Surface has them
  std::vector<std::uint32_t> origin;               // (polygons after) the polygon before
  [[nodiscard]] bool changes() const { return !ends.empty(); }
  [[nodiscard]] std::size_t polygon_count() const { return origin.size(); }
  [[nodiscard]] std::array<std::uint32_t, 2> ends_of(std::uint32_t vertex) const {
    return ends[vertex - vertices];
  }
};

// `second` is of what `first` gave: both in one.
[[nodiscard]] Refinement composed(const Refinement& first, const Refinement& second);

// Of a surface that stays as it is.
[[nodiscard]] Refinement unsplit(const Surface& surface);

// (polygons before + 1) the pieces of polygon p are polygons [first[p], first[p + 1]) after.
[[nodiscard]] std::vector<std::uint32_t> first_pieces(const Refinement& refinement);

// The surface with its polygons split: pieces have the face and the columns of their polygon, new vertices the mean of
// their two ends' columns. Sources come without their bytes.
[[nodiscard]] Surface refined(const Surface& surface, const Refinement& refinement);

// What the corners of one polygon's pieces have, where corners of the polygon have something each (texture coordinates
// and normals of their own). `halve(a, b, vertex)`: of the vertex half-way between two that have a and b.
template <class Value, class Halve>
class PieceCorners {
 public:
  PieceCorners(const Refinement& refinement, const Halve& halve) : refinement_(refinement), halve_(halve) {}
  // The polygon's own corner; of two at one vertex the first counts.
  void add(std::uint32_t vertex, const Value& value) { known_.emplace(vertex, value); }
  Value at(std::uint32_t vertex) {
    if (const auto found = known_.find(vertex); found != known_.end()) return found->second;
    const auto [a, b] = refinement_.ends_of(vertex);
    const Value value = halve_(at(a), at(b), vertex);
    known_.emplace(vertex, value);
    return value;
  }

 private:
  const Refinement& refinement_;
  const Halve& halve_;
  std::unordered_map<std::uint32_t, Value> known_;
};

}  // namespace flexel
