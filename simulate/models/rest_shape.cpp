// A cell with a rest shape is a cell with other constants: with G = (Cp^-1)^1/2 the energy of F is that of F
// G, whose gradient is H G + (G - I), so gamma_a becomes G gamma_a and G - I is added to the gradient.
// Likewise e_m = q_m - F Q_m = sum_a (s_ma / 8 - gamma_a . Q_m / 4) u_a - Q_m.
#include "simulate/models/rest_shape.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <string_view>

#include "base/error.h"
#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "base/units.h"
#include "formats/lattice/column_names.h"

namespace flexel::simulate {
namespace {

// Throws InputError: there is one of that name with other components, which would be passed over otherwise.
const Column* column_of(const Columns& columns, const char* name, int components) {
  const auto found = columns.find(name);
  if (found == columns.end()) return nullptr;
  if (found->second.components != components)
    throw InputError(fmt::format("column \"{}\" of the body has {} numbers a row: it needs {}", name,
                                 found->second.components, components));
  return &found->second;
}

std::span<const double> row(const Column* column, std::size_t at) {
  if (!column) return {};
  const auto width = static_cast<std::size_t>(column->components);
  return {column->values.data() + width * at, width};
}

bool all_zero(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
}

// S^1/2 - I of S = I + change, without cancellation for a small change.
Mat3 root_less_one(const Mat3& change) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(change);
  const Vec3 values = eigen.eigenvalues().unaryExpr([](double x) { return x / (1 + std::sqrt(1 + x)); });
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

// `values`: see simulate/thermal/free_strain.h; of them `share`.
std::optional<CellKind> freely_strained(const CellKind& kind, const Mat3& axes,
                                        std::span<const double> values, double share) {
  if (share == 0 || all_zero(values)) return std::nullopt;
  Mat3 change;
  for (std::size_t i = 0; i < 6; ++i)
    change(kEntry[i][0], kEntry[i][1]) = change(kEntry[i][1], kEntry[i][0]) = share * values[i];
  std::array<Vec3, 4> q;
  q.fill(Vec3::Zero());
  for (std::size_t m = 0; m < 3; ++m) q[m] = share * (axes * Eigen::Map<const Vec3>(&values[6 + 3 * m]));
  const double volume = 1 / (Mat3::Identity() + change).determinant();
  return with_rest_shape(kind, axes * change * axes.transpose(), volume, q);
}

std::vector<double> factors(const Columns& columns, const char* name, const char* of) {
  std::vector<double> result;
  const Column* change = column_of(columns, name, 1);
  if (!change) return result;
  for (const double value : change->values) {
    if (!(1 + value > 0))
      throw InputError(
          fmt::format("column \"{}\" of {}: {} is {:g}, a factor less 1: it needs to be above -1", name, of,
                      result.size(), value));
    result.push_back(1 + value);
  }
  return result;
}

std::vector<double> shares(const Body& body, const char* name) {
  std::vector<double> result = body.fill;
  const std::vector<double> factor = factors(body.cell_columns, name, "cells");
  for (std::size_t c = 0; c < factor.size(); ++c) result[c] *= factor[c];
  return result;
}

// What nothing takes: a column of cells, connections or radii at elements at corners, and one of elements at cells.
void refuse_misplaced(const Body& body, const char* name, const char* why) {
  const auto found = body.element_columns.find(name);
  if (found == body.element_columns.end()) return;
  for (const Part& part : body.parts) {
    if (part.placement == Placement::centre) continue;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      if (!all_zero(row(&found->second, e)))
        throw InputError(fmt::format(
            "column \"{}\" of elements is not 0 at element {} of part \"{}\", whose elements are at the "
            "voxels' corners: {}",
            name, e, part.name, why));
  }
}

void refuse_at_cells(const Body& body, const char* name) {
  const auto found = body.cell_columns.find(name);
  if (found != body.cell_columns.end() && !all_zero(found->second.values))
    throw InputError(fmt::format(
        "column \"{}\" of cells is not 0, and it is one of elements: write it into the point data", name));
}

void refuse_misplaced_columns(const Body& body) {
  for (const auto& [name, of] : kChangeColumns) {
    if (of == ChangeOf::matter) {
      refuse_misplaced(body, name, "it is one of cells there, so write it into the cell data");
      continue;
    }
    if (of == ChangeOf::radius) refuse_misplaced(body, name, "they have no radius");
    if (of == ChangeOf::connections)
      refuse_misplaced(body, name, "only connections of model \"paper\" have factors of their own");
    refuse_at_cells(body, name);
  }
}

}  // namespace

RestShapes::RestShapes(const Body& body)
    : flow_(column_of(body.cell_columns, "plastic_flow", 6)),
      volume_(column_of(body.cell_columns, "rest_volume", 1)),
      hourglass_(column_of(body.cell_columns, "plastic_hourglass", 12)),
      springs_(column_of(body.cell_columns, "spring_flow", 28)),
      broken_(column_of(body.cell_columns, "broken_springs", 1)),
      connections_(column_of(body.element_columns, "connection_rest", 13)),
      free_(column_of(body.cell_columns, "free_strain", 18)) {
  any_ = flow_ || volume_ || hourglass_ || springs_ || broken_ || connections_ || free_;
}

std::optional<CellKind> RestShapes::of(const CellKind& kind, const Part& part, std::uint32_t cell,
                                       double share) const {
  if (free_) return freely_strained(kind, part.lattice.axes, row(free_, cell), share);
  const std::span<const double> flow = row(flow_, cell), hourglass = row(hourglass_, cell);
  const double volume = volume_ ? volume_->values[cell] : 0;
  if (all_zero(flow) && all_zero(hourglass) && volume == 0) return std::nullopt;
  const Mat3& axes = part.lattice.axes;
  Mat3 change = Mat3::Zero();
  for (std::size_t i = 0; i < flow.size(); ++i)
    change(kEntry[i][0], kEntry[i][1]) = change(kEntry[i][1], kEntry[i][0]) = flow[i];
  std::array<Vec3, 4> q;
  for (std::size_t m = 0; m < 4; ++m)
    q[m] = hourglass.empty() ? Vec3(Vec3::Zero()) : Vec3(axes * Eigen::Map<const Vec3>(&hourglass[3 * m]));
  return with_rest_shape(kind, root_less_one(axes * change * axes.transpose()), 1 + volume, q);
}

std::optional<SpringKind> RestShapes::of(const SpringKind& kind, std::uint32_t cell) const {
  const std::span<const double> flowed = row(springs_, cell);
  const auto broken = broken_ ? static_cast<std::uint64_t>(broken_->values[cell]) : 0;
  if (all_zero(flowed) && broken == 0) return std::nullopt;
  SpringKind own = kind;
  for (std::size_t s = 0; s < own.springs.size(); ++s) {
    if (!flowed.empty()) own.springs[s].flowed = flowed[s];
    if (broken >> s & 1) own.springs[s].stiffness = 0;
  }
  return own;
}

double RestShapes::of_connection(std::uint32_t element, std::size_t bit) const {
  return connections_ ? connections_->values[13 * std::size_t{element} + bit] : 0;
}

void refuse_damaged_columns(const Body& body) {
  (void)RestShapes(body);
  for (const auto& [name, of] : kChangeColumns) {
    if (of == ChangeOf::connections) {
      (void)connection_values(body, name);
    } else if (std::string_view(name) == "stick_change") {  // an absolute value
      (void)element_values(body, name);
    } else {
      (void)element_factors(body, name);
      (void)cell_factors(body, name);
    }
  }
  (void)element_values(body, "plastic_strain");
  (void)column_of(body.element_columns, "settled", 3);
  refuse_misplaced_columns(body);
}

std::vector<Vec3> settled_displacement(const Body& body) {
  std::vector<Vec3> settled;
  if (const Column* column = column_of(body.element_columns, "settled", 3))
    for (std::size_t e = 0; e < body.element_count(); ++e)
      settled.emplace_back(Eigen::Map<const Vec3>(&column->values[3 * e]));
  return settled;
}

std::vector<double> stiffness_shares(const Body& body) {
  return shares(body, "stiffness_change");
}
std::vector<double> mass_shares(const Body& body) {
  return shares(body, "density_change");
}
std::vector<double> stiffness_factors(const Body& body) {
  return element_factors(body, "stiffness_change");
}
std::vector<double> mass_factors(const Body& body) {
  return element_factors(body, "density_change");
}
std::vector<double> element_factors(const Body& body, const char* column) {
  return factors(body.element_columns, column, "elements");
}
std::vector<double> cell_factors(const Body& body, const char* column) {
  return factors(body.cell_columns, column, "cells");
}
std::vector<double> element_values(const Body& body, const char* column) {
  const Column* found = column_of(body.element_columns, column, 1);
  return found ? found->values : std::vector<double>();
}
std::span<const double> connection_values(const Body& body, const char* column) {
  const Column* found = column_of(body.element_columns, column, static_cast<int>(half_neighbourhood.size()));
  return found ? std::span<const double>(found->values) : std::span<const double>();
}

}  // namespace flexel::simulate
