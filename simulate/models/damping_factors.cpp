// Columns that hold a factor less 1.
#include "simulate/models/damping_factors.h"

#include "simulate/models/rest_shape.h"

namespace flexel::simulate {

std::vector<double> damping_factors(const Body& body) {
  return cell_factors(body, "damping_change");
}

std::vector<double> element_damping_factors(const Body& body) {
  return element_factors(body, "damping_change");
}

bool edits_damping(const Body& body) {
  return body.cell_columns.contains("damping_change") || body.element_columns.contains("damping_change");
}

}  // namespace flexel::simulate
