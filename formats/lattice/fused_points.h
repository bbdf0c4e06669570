// Points of a body that were fused (docs/reference/events.md): what joins parts, or pieces of one, beside the lattice.
// They travel in the note "fused", a line each: stiffness, length, and number:weight of its elements.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel {

inline constexpr const char* kFusedNote = "fused";

// A point of one part and a point of another that are held together: with the positions x of the elements the energy
// is 1/2 k (|sum w x| - length)^2.
struct FusedPoint {
  std::vector<std::uint32_t> elements;
  std::vector<double> weights;  // sum 0
  double stiffness = 0;         // N/m
  double length = 0;            // m; 0: the points coincide
};

// Of the note; none without. Throws InputError: the note is damaged.
[[nodiscard]] std::vector<FusedPoint> fused_points(const Body& body);
// Whether one of them holds part `one` to part `other`.
[[nodiscard]] bool are_fused(const Body& body, const std::vector<FusedPoint>& points, std::uint32_t one,
                             std::uint32_t other);
// Sets the note, or takes it away where there are none.
void set_fused_points(Body& body, const std::vector<FusedPoint>& points);

}  // namespace flexel
