// A column that has not one number a row is someone else's.
#include "simulate/models/damping_factors.h"

namespace flexel::simulate {
namespace {

std::vector<double> factors(const Columns& columns) {
  std::vector<double> result;
  const auto found = columns.find("damping_change");
  if (found != columns.end() && found->second.components == 1)
    for (const double change : found->second.values) result.push_back(1 + change);
  return result;
}

}  // namespace

std::vector<double> damping_factors(const Body& body) {
  return factors(body.cell_columns);
}

std::vector<double> element_damping_factors(const Body& body) {
  return factors(body.element_columns);
}

bool edits_damping(const Body& body) {
  return body.cell_columns.contains("damping_change") || body.element_columns.contains("damping_change");
}

}  // namespace flexel::simulate
