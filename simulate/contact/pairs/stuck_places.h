// What contact stuck together, for a later run: it travels in the body's note "stuck", a line of numbers each
// (docs/reference/contact.md). formats/lattice/merge.cpp knows where a line names parts.
#pragma once
#include <array>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

inline constexpr const char* kStuckNote = "stuck";

// A connection that contact made: two places of surfaces, each known by its part, position at rest [m] and normal at
// rest, a plane by -1 and its number in the scene; the slip of the spring along the surface [m] and the gap at which
// the connection pulls nothing [m]; and what else contact remembers of the two (PairRecord). As PairMemory has it.
using StuckPlaces = std::array<double, 21>;

// Of the note; none without. Throws InputError: the note is damaged.
[[nodiscard]] std::vector<StuckPlaces> stuck_places(const Body& body);
// Sets the note, or takes it away where there are none.
void set_stuck_places(Body& body, const std::vector<StuckPlaces>& places);

// Of Contacts::transfer_state(): what sticks; and what Contacts::restore_from() takes from a file.
[[nodiscard]] std::vector<StuckPlaces> stuck_in(const std::vector<double>& transfer_state);
[[nodiscard]] std::vector<double> transfer_of(const std::vector<StuckPlaces>& places);

}  // namespace flexel::simulate
