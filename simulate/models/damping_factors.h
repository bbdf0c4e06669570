// What edits made of the damping time of cells, and of elements at centre placement: factors, kept in the
// columns "damping_change" less 1 (docs/reference/events.md).
#pragma once
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

[[nodiscard]] std::vector<double> damping_factors(const Body& body);          // (cells); empty: none
[[nodiscard]] std::vector<double> element_damping_factors(const Body& body);  // (elements); empty: none
[[nodiscard]] bool edits_damping(const Body& body);                           // whether it has either column

}  // namespace flexel::simulate
