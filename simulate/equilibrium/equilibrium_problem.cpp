// Of centre-placed parts that springs hold.
#include "simulate/equilibrium/equilibrium_problem.h"

#include "formats/pieces/other_pieces.h"
#include "simulate/matter/coplanar_elements.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {

Problem equilibrium_problem(const Body& body, const Scene& scene, const Fragments& fragments,
                            std::size_t& unsupported) {
  Problem problem{body,
                  materials_of_parts(scene, body),
                  stray_cells(fragments),
                  models_of_parts(scene, body),
                  hooke_of_parts(scene, body),
                  stray_elements(fragments, body),
                  {},
                  settled_displacement(body)};
  if (other_pieces()) {
    problem.stray_cell.assign(body.cell_count(), 0);  // ghosts: what resists is each process's own
    for (std::uint32_t c = 0; c < body.cell_count(); ++c) problem.stray_cell[c] = !counts_cell(c);
  }
  const std::vector<std::uint8_t> loose = unsupported_elements(problem);
  for (std::size_t e = 0; e < loose.size(); ++e)
    if (loose[e]) {
      problem.stray_element[e] = 1;
      ++unsupported;
    }
  return problem;
}

}  // namespace flexel::simulate
