// The polygons around a vertex, and vertices at one position: for the few vertices whose anchor needs them.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/part/surface.h"

namespace flexel::mapping {

inline constexpr std::uint32_t kNone = 0xffffffffu;
inline constexpr std::size_t kPolygonsAtATime = 1 << 12;  // of a thread

// (vertices) The first polygon around each, kNone where there is none.
[[nodiscard]] std::vector<std::uint32_t> first_polygons(const Surface& surface);

// Polygons around some of the vertices.
struct Around {
  std::vector<std::uint32_t> slot;      // (vertices) kNone: not requested
  std::vector<std::uint32_t> offsets;   // (slots + 1)
  std::vector<std::uint32_t> polygons;  // ascending within a slot
};

// The polygons around each vertex of `wanted` and around all vertices that it represents: `representative`
// (empty: every vertex is its own).
[[nodiscard]] Around polygons_around(const Surface& surface, const std::vector<std::uint32_t>& representative,
                                     const std::vector<std::uint32_t>& wanted);

// The vertices at positions that `wanted` are at, and some others, ascending.
[[nodiscard]] std::vector<std::uint32_t> at_positions_of(const std::vector<Vec3>& vertices,
                                                         const std::vector<std::uint32_t>& wanted);

}  // namespace flexel::mapping
