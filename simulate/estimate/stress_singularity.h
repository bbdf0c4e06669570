// Where the largest stress has no limit as the cells get smaller.
#pragma once
#include <array>
#include <numbers>
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

// An edge of the surface at which the matter fills more than half of the space around.
struct ReEntrantEdge {
  std::array<std::uint32_t, 2> vertices{};
  std::array<Vec3, 2> ends;  // m
  double turn = 0;           // rad, from facet to facet
  double width = 0;          // m, of the narrower facet across it
};

// Those that turn by more than `least` [rad]: sharp edges, and those between the facets of a hole or a fillet. In order of their ends.
[[nodiscard]] std::vector<ReEntrantEdge> re_entrant_edges(const Surface& surface, double least);
[[nodiscard]] double distance_to(const ReEntrantEdge& edge, const Vec3& at);  // m

// rad: from here on an edge is sharp; a finer tessellated fillet turns by less from facet to facet.
constexpr double kSharpTurn = std::numbers::pi / 6;

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
