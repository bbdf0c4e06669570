// What was made between parts of a body, or pieces of one, beside the lattice; each travels in a note, a line each.
// Points that were fused (docs/reference/events.md) in the note "fused": stiffness, length, and number:weight of its
// elements. Places of surfaces that stick to what they touch (docs/reference/contact.md) in the note "stuck".
#pragma once
#include <array>
#include <cstdint>
#include <span>
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
// Sets the note, or takes it away where there are none.
void set_fused_points(Body& body, const std::vector<FusedPoint>& points);

inline constexpr const char* kStuckNote = "stuck";

// A connection that contact made: two places of surfaces, each known by its part, position at rest [m] and normal at
// rest, a plane by -1 and its number in the scene; the slip of the spring along the surface [m] and the gap at which
// the connection pulls nothing [m]; and what else contact remembers of the two (PairRecord).
using StuckPlaces = std::array<double, 21>;

// Of the note; none without. Throws InputError: the note is damaged.
[[nodiscard]] std::vector<StuckPlaces> stuck_places(const Body& body);
// Sets the note, or takes it away where there are none.
void set_stuck_places(Body& body, const std::vector<StuckPlaces>& places);

}  // namespace flexel
