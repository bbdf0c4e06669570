// What happens to Body::moments where bodies change.
#pragma once
#include "formats/lattice/body.h"

namespace flexel {

// Whether every cell of less than the whole fill has moments: they were asked for, or it needs none.
[[nodiscard]] bool has_all_moments(const Body& body);

// Appends those of `other`, whose cells will be appended to those of `body`.
void append_moments(Body& body, const Body& other);

// Keeps those of the cells that `number` gives another number than `gone`, under that number; ascending.
void renumber_moments(Body& body, const std::vector<std::uint32_t>& number, std::uint32_t gone);

}  // namespace flexel
