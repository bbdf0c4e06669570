// Figures of the unknowns.
#include "simulate/modes/vibrating_body.h"

#include <algorithm>
#include <bit>

#include "simulate/models/cells.h"

namespace flexel::simulate {

std::size_t VibratingNodes::freedoms() const {
  std::size_t free = 3 * held.size();
  for (const std::uint8_t mask : held) free -= static_cast<std::size_t>(std::popcount(mask));
  return free;
}

void show_elements(const Fragments& fragments, const Problem& problem, const Stencil& stencil, State& state,
                   Body& body) {
  carry_strays(fragments, problem, stencil, state);
  for (std::size_t e = 0; e < state.displacement.size(); ++e)
    body.position[e] = body.rest[e] + state.displacement[e];
}

// Of linear cells: 4 c^2 / h^2 along each axis, c the speed of compression.
double largest_eigenvalue(const Problem& problem) {
  double largest = 0;
  for (std::size_t p = 0; p < problem.materials.size(); ++p) {
    const Law law = law_of(problem.materials[p]);
    const double stiffest = law.name == LawName::orthotropic ? law.stiffest : law.lambda + 2 * law.mu;
    const double h = problem.body.parts[p].lattice.spacing.minCoeff();
    largest = std::max(largest, 12 * stiffest / problem.materials[p].density / (h * h));
  }
  return largest;
}

}  // namespace flexel::simulate
