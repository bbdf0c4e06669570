// Largest values are found in parallel by chunks that keep the first of equal ones.
#include "formats/lattice/fields.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "formats/lattice/quadratic_field.h"

namespace flexel {
namespace {

constexpr double kWholeCell = 1 - 1e-9;  // fill
constexpr double kNoStrain = std::numeric_limits<double>::quiet_NaN();

struct FirstLargest {
  double squared = -1;
  Vec3 displacement = Vec3::Zero(), at = Vec3::Zero();
  FirstLargest& operator+=(const FirstLargest& other) {
    if (other.squared > squared) *this = other;
    return *this;
  }
};

FirstLargest moved(const Vec3& displacement, const Vec3& at) {
  return {displacement.squaredNorm(), displacement, at};
}

Mat3 mean_gradient(const Body& body, const Part& part, std::size_t cell) {
  Mat3 gradient = Mat3::Zero();
  for (std::size_t a = 0; a < 8; ++a) {
    const Vec3 side((a & 1) != 0 ? 1 : -1, (a & 2) != 0 ? 1 : -1, (a & 4) != 0 ? 1 : -1);
    gradient +=
        body.position[body.cell_elements[cell][a]] * side.cwiseQuotient(4 * part.lattice.spacing).transpose();
  }
  return gradient;
}

Mat3 gradient_of_connections(const Body& body, const Adjacency& adjacency, std::uint32_t element) {
  Mat3 now = Mat3::Zero(), rest = Mat3::Zero();
  for (const std::uint32_t other : adjacency.of(element)) {
    const Vec3 arm = body.rest[other] - body.rest[element];
    now += (body.position[other] - body.position[element]) * arm.transpose();
    rest += arm * arm.transpose();
  }
  const double scale = rest.trace() / 3;
  if (!(rest.determinant() > 1e-6 * scale * scale * scale)) return Mat3::Constant(kNoStrain);
  return now * rest.inverse();
}

}  // namespace

std::vector<std::uint8_t> elements_in_matter(const Body& body) {
  std::vector<std::uint8_t> inside(body.element_count(), 0);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    if (body.fill[c] >= kWholeCell)
      for (const std::uint32_t e : body.cell_elements[c]) inside[e] = 1;
  for (const Part& part : body.parts)
    if (part.placement == Placement::centre)
      std::fill(inside.begin() + part.element_begin, inside.begin() + part.element_end, std::uint8_t{1});
  return inside;
}

std::vector<std::uint32_t> polygons_around_vertices(const Body& body) {
  const Surface& surface = body.surface;
  std::vector<std::uint32_t> polygon(surface.vertices.size(), kNoPolygonAround);
  if (body.surface_cell_offsets.size() != surface.polygon_count() + 1) return polygon;
  for (std::uint32_t p = 0; p < surface.polygon_count(); ++p)
    if (body.surface_cell_offsets[p + 1] > body.surface_cell_offsets[p])
      for (const std::uint32_t v : surface.polygon(p))
        if (polygon[v] == kNoPolygonAround) polygon[v] = p;
  return polygon;
}

LargestDisplacement largest_displacement(const Body& body, const std::vector<Vec3>& displacement) {
  std::vector<std::uint8_t> inside = elements_in_matter(body);
  const std::vector<std::uint32_t> around = polygons_around_vertices(body);
  std::optional<QuadraticField> field;
  if (QuadraticField::is_in(body)) field.emplace(body, displacement);
  FirstLargest largest = parallel_sum<FirstLargest>(around.size(), [&](std::size_t v) {
    if (around[v] == kNoPolygonAround) return FirstLargest{};
    const Vec3& vertex = body.surface.vertices[v];
    const auto at = locate_on_surface(body, around[v], vertex);
    if (!at) return FirstLargest{};
    if (!field) return moved(interpolate(*at, body, displacement), vertex);
    const Part& part = body.parts[body.surface.polygon_part(around[v])];
    return moved(field->displacement(at->cell, cell_coordinates(body, part, at->cell, vertex)), vertex);
  });
  if (largest.squared < 0 && std::find(inside.begin(), inside.end(), 1) == inside.end())
    std::fill(inside.begin(), inside.end(), std::uint8_t{1});
  largest += parallel_sum<FirstLargest>(inside.size(), [&](std::size_t e) {
    return inside[e] != 0 ? moved(displacement[e], body.rest[e]) : FirstLargest{};
  });
  return {largest.displacement, largest.at};
}

LargestDisplacement largest_displacement(const Body& body) {
  std::vector<Vec3> displacement(body.element_count());
  parallel_for_each(displacement.size(),
                    [&](std::size_t e) { displacement[e] = body.position[e] - body.rest[e]; });
  return largest_displacement(body, displacement);
}

double equivalent_strain(const Mat3& gradient) {
  if (!gradient.allFinite() || !(gradient.determinant() > 0)) return kNoStrain;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(gradient.transpose() * gradient, Eigen::EigenvaluesOnly);
  if (!(solver.eigenvalues().minCoeff() > 0)) return kNoStrain;
  const Vec3 logarithms = 0.5 * solver.eigenvalues().array().log();
  return std::sqrt(2.0 / 3.0) * (logarithms.array() - logarithms.mean()).matrix().norm();
}

std::vector<double> strains(const Body& body) {
  if (body.cell_count() == 0) {
    const Adjacency adjacency = element_adjacency(body);
    std::vector<double> result(body.element_count());
    parallel_for_each(result.size(), [&](std::size_t e) {
      result[e] = equivalent_strain(gradient_of_connections(body, adjacency, static_cast<std::uint32_t>(e)));
    });
    return result;
  }
  std::vector<double> result(body.cell_count(), kNoStrain);
  for (const Part& part : body.parts)
    parallel_for_each(part.cell_end - part.cell_begin, [&](std::size_t i) {
      result[part.cell_begin + i] = equivalent_strain(mean_gradient(body, part, part.cell_begin + i));
    });
  return result;
}

double largest_strain(const Body& body) {
  const std::vector<double> all = strains(body);
  double largest = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool broken = body.cell_count() > 0 && !body.broken.empty() && body.broken[i] != 0;
    if (!broken && all[i] > largest) largest = all[i];
  }
  return largest;
}

}  // namespace flexel
