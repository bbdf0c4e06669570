// The cell whose mean edges span the least volume, and the words for it.
#include "simulate/time/folds.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

#include "formats/units.h"

namespace flexel {

std::string folds_at(const char* what, const Vec3& at) {
  return fmt::format(
      "{} near ({}, {}, {}) turned inside out: load it more slowly, damp it ([damping]), or use a "
      "shorter [run] step or a smaller spacing",
      what, human_length(at.x()), human_length(at.y()), human_length(at.z()));
}

std::string where_it_folds(const Body& body, const std::vector<Vec3>& displacement) {
  std::size_t worst = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    if (body.broken[c]) continue;
    std::array<Vec3, 8> x;
    for (std::size_t a = 0; a < 8; ++a)
      x[a] = body.rest[body.cell_elements[c][a]] + displacement[body.cell_elements[c][a]];
    Mat3 edges;
    for (Eigen::Index j = 0; j < 3; ++j) {
      Vec3 sum = Vec3::Zero();
      for (std::size_t a = 0; a < 8; ++a) sum += (a >> j & 1 ? 1.0 : -1.0) * x[a];
      edges.col(j) = sum;
    }
    const double volume = edges.determinant();
    if (!(volume >= least)) {
      least = std::isnan(volume) ? -std::numeric_limits<double>::infinity() : volume;
      worst = c;
    }
  }
  if (body.cell_count() == 0) return "an element's position is not a number";
  return folds_at("a cell", body.rest[body.cell_elements[worst][0]]);
}

}  // namespace flexel
