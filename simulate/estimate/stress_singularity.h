// Where the largest stress has no limit as the cells get smaller.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

// What lies within `reach` [m] of `at` (m, rest) and makes stresses there grow without bound as cells get
// smaller (Williams, J. Appl. Mech. 19, 1952): "a support", an element that `tied` (elements) says is held in
// all directions (2), "a bond" of parts (3), or "a re-entrant edge" of the surface, turning by more than 30 degrees. ""
// for none.
[[nodiscard]] std::string singular_beside(const Body& body, const std::vector<std::uint8_t>& tied,
                                          const Vec3& at, double reach);

// Says it of the largest stress of `result`, if there is one: within so many spacings, for coarse cells put the peak of a
// support or an edge that far from it.
constexpr double kBesideInCells = 5,
                 kBesideInField = 1.5;  // model `quadratic`: its field peaks at the place itself
void mark_singular(const Body& body, const std::vector<std::uint8_t>& tied, SimulateResult& result,
                   double spacings = kBesideInCells);

}  // namespace flexel::simulate
