// Shape functions are products of the three quadratic Lagrange polynomials along each axis.
#include "formats/lattice/quadratic_field.h"

namespace flexel {
namespace {

struct Along {
  std::array<double, 3> value{}, slope{};
};

Along quadratic_lagrange(double x) {
  return {{(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)}, {4 * x - 3, 4 - 8 * x, 4 * x - 1}};
}

}  // namespace

QuadraticShape quadratic_shape(const Vec3& at) {
  const Along x = quadratic_lagrange(at.x()), y = quadratic_lagrange(at.y()), z = quadratic_lagrange(at.z());
  QuadraticShape shape;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    const std::size_t i = n % 3, j = n / 3 % 3, k = n / 9;
    shape.value[n] = x.value[i] * y.value[j] * z.value[k];
    shape.gradient[n] = {x.slope[i] * y.value[j] * z.value[k], x.value[i] * y.slope[j] * z.value[k],
                         x.value[i] * y.value[j] * z.slope[k]};
  }
  return shape;
}

Vec3 cell_coordinates(const Body& body, const Part& part, std::uint32_t cell, const Vec3& point) {
  const Index3& low = body.lattice_index[body.cell_elements[cell][0]];
  return part.lattice.to_lattice(point) - Vec3(low[0], low[1], low[2]);
}

bool QuadraticField::is_in(const Body& body) {
  const auto found = body.cell_columns.find(kQuadraticColumn);
  return found != body.cell_columns.end() &&
         found->second.components == 3 * static_cast<int>(kBetweenNodes) &&
         found->second.values.size() == 3 * kBetweenNodes * body.cell_count();
}

QuadraticField::QuadraticField(const Body& body, const std::vector<Vec3>& displacement)
    : body_(body), displacement_(displacement), between_(body.cell_columns.at(kQuadraticColumn).values) {}

std::array<Vec3, kQuadraticNodes> QuadraticField::nodes(std::uint32_t cell) const {
  std::array<Vec3, kQuadraticNodes> u;
  const double* next = &between_[3 * kBetweenNodes * cell];
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    if (const std::size_t corner = corner_of_node(n); corner < 8) {
      u[n] = displacement_[body_.cell_elements[cell][corner]];
      continue;
    }
    u[n] = Vec3(next[0], next[1], next[2]);
    next += 3;
  }
  return u;
}

Vec3 QuadraticField::displacement(std::uint32_t cell, const Vec3& at) const {
  const QuadraticShape shape = quadratic_shape(at);
  const auto u = nodes(cell);
  Vec3 sum = Vec3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) sum += shape.value[n] * u[n];
  return sum;
}

}  // namespace flexel
