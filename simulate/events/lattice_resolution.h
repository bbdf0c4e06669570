// Lattices of half and of twice the spacing: each cell becomes eight, or each eight become one (Jansson and
// Vergeest, section 3.1).
//
// Finer. Cells are split at their middle, axis by axis; the eight have the fill of the one. Elements that
// were there stay as they are. A new one lies in the middle of an edge, and gets from the elements f(0), f(1)
// at its ends and the next ones of that row
//     (-f(-1) + 9 f(0) + 9 f(1) - f(2)) / 16      cubic
//     (3 f(0) + 6 f(1) - f(2)) / 8                parabola, at an end of the row
//     (f(0) + f(1)) / 2                           between two elements alone.
// Between the elements of a bent row a line would not do: its kinks shear each of the smaller cells by what
// their model leaves out of the large one.
//
// Coarser. Elements at every second place stay as they are, the others go. Eight cells become one with the
// mean of their fills. So coarser after finer gives back what was there before, to the bit.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

enum class ResolutionChange { finer, coarser };

// The lattices of `body`, those of the parts with changed[part] != 0 finer or coarser, at rest, with the
// cells under each polygon: of smaller ones those that it touches. Without surface, notes, columns and
// moments. `fields` (fields x elements x 3) become those of its elements. Throws InputError: a part has
// elements at the centres of its voxels or broken cells; or, coarser, cells that eight by eight make no
// larger ones.
[[nodiscard]] Body at_resolution(const Body& body, const std::vector<std::uint8_t>& changed,
                                 ResolutionChange to, std::vector<std::vector<Vec3>>& fields);

// How many elements `part`, of corner placement, would have with cells of half the spacing.
[[nodiscard]] std::size_t finer_element_count(const Body& body, const Part& part);

// J: elastic, and kinetic but of the motion of all as one; all kinetic. What a change of resolution is judged
// by.
[[nodiscard]] std::array<double, 2> internal_and_kinetic(const Problem& problem, const State& state);
// Share of both, in the contacts of a part, beyond which it cannot change: contacts store by the size of
// their cells.
inline constexpr double kMostStored = 1e-3;
// Share of the first beyond which a warning tells of a change.
inline constexpr double kLargestEnergyChange = 0.01;

}  // namespace flexel::simulate
