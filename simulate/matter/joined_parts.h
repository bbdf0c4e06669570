// Parts that joined while a run went on (simulate/events/joined_bonds.h): fused points hold them where they touched then,
// whatever touches at rest. They travel in the body's note "joined", a number a line.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

inline constexpr const char* kJoinedNote = "joined";
// (parts) 1: it joined. Throws InputError: the note is damaged.
[[nodiscard]] std::vector<std::uint8_t> joined_parts(const Body& body);
// Adds those from number `first` on to the note.
void note_joined_parts(Body& body, std::size_t first);

}  // namespace flexel::simulate
