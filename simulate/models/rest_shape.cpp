// A cell with a rest shape is a cell with other constants: with G = (Cp^-1)^1/2 the energy of F is that of F
// G, whose gradient is H G + (G - I), so gamma_a becomes G gamma_a and G - I is added to the gradient.
// Likewise e_m = q_m - F Q_m = sum_a (s_ma / 8 - gamma_a . Q_m / 4) u_a - Q_m.
#include "simulate/models/rest_shape.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "base/units.h"
#include "simulate/models/paper_model.h"

namespace flexel::simulate {
namespace {

constexpr int kEntry[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

const Column* column_of(const Columns& columns, const char* name, int components) {
  const auto found = columns.find(name);
  return found != columns.end() && found->second.components == components ? &found->second : nullptr;
}

std::span<const double> row(const Column* column, std::size_t at) {
  if (!column) return {};
  const auto width = static_cast<std::size_t>(column->components);
  return {column->values.data() + width * at, width};
}

bool all_zero(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
}

// A column of `count` rows, made of zeros where the body has none.
std::vector<double>& values_of(Columns& columns, const char* name, int components, std::size_t count) {
  Column& column = columns[name];
  if (column.components != components || column.values.size() != count * static_cast<std::size_t>(components))
    column = {components, std::vector<double>(count * static_cast<std::size_t>(components), 0)};
  return column.values;
}

CellVectors corners_of(const Body& body, std::uint32_t cell, const std::vector<Vec3>& values) {
  CellVectors u;
  for (std::size_t a = 0; a < 8; ++a) u[a] = values[body.cell_elements[cell][a]];
  return u;
}

// S^1/2 - I of S = I + change, without cancellation for a small change.
Mat3 root_less_one(const Mat3& change) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(change);
  const Vec3 values = eigen.eigenvalues().unaryExpr([](double x) { return x / (1 + std::sqrt(1 + x)); });
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

std::vector<double> shares(const Body& body, const char* name) {
  std::vector<double> result = body.fill;
  if (const Column* change = column_of(body.cell_columns, name, 1))
    for (std::size_t c = 0; c < result.size(); ++c) result[c] *= 1 + change->values[c];
  return result;
}

std::vector<double> factors(const Body& body, const char* name) {
  std::vector<double> result;
  if (const Column* change = column_of(body.element_columns, name, 1))
    for (const double value : change->values) result.push_back(1 + value);
  return result;
}

[[noreturn]] void refuse_inverted(const char* what, const Vec3& at) {
  throw DivergedError(
      fmt::format("renormalise: {} near ({}, {}, {}) is turned inside out, and no rest shape can be", what,
                  human_length(at.x()), human_length(at.y()), human_length(at.z())));
}

// What one cell of model `cells` remembers of its present shape.
void remember_cell(const CellKind& kind, const Mat3& axes, const CellVectors& u, double* flow, double* volume,
                   double* hourglass) {
  const Mat3 h = displacement_gradient(kind, u);
  const Mat3 inverse = (Mat3::Identity() + h).inverse();
  const Mat3 change = -(inverse * (h + h.transpose() + h * h.transpose()) * inverse.transpose());
  const Mat3 local = axes.transpose() * change * axes;
  for (std::size_t i = 0; i < 6; ++i) flow[i] = local(kEntry[i][0], kEntry[i][1]);
  *volume = volume_change(h);
  for (int mode = 0; mode < 4; ++mode) {
    Vec3 q = Vec3::Zero();
    for (int a = 0; a < 8; ++a) q += hourglass_sign(mode, a) / 8 * u[static_cast<std::size_t>(a)];
    const Vec3 drawn_back = axes.transpose() * (inverse * q);
    std::copy(drawn_back.begin(), drawn_back.end(), hourglass + 3 * mode);
  }
}

}  // namespace

RestShapes::RestShapes(const Body& body)
    : flow_(column_of(body.cell_columns, "plastic_flow", 6)),
      volume_(column_of(body.cell_columns, "rest_volume", 1)),
      hourglass_(column_of(body.cell_columns, "plastic_hourglass", 12)),
      springs_(column_of(body.cell_columns, "spring_flow", 28)),
      broken_(column_of(body.cell_columns, "broken_springs", 1)),
      connections_(column_of(body.element_columns, "connection_rest", 13)) {
  any_ = flow_ || volume_ || hourglass_ || springs_ || broken_ || connections_;
}

std::optional<CellKind> RestShapes::of(const CellKind& kind, const Part& part, std::uint32_t cell) const {
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

namespace {

// Before anything is changed.
void refuse_inverted_cells(const Body& body, const std::vector<Vec3>& displacement,
                           const std::vector<std::uint8_t>& cells) {
  for (const Part& part : body.parts) {
    const CellKind kind = cell_kind(part.lattice, Material{"", 1, 0, 1, ""});
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      if (cells[c] && !body.broken[c] &&
          !(volume_change(displacement_gradient(kind, corners_of(body, c, displacement))) > -1))
        refuse_inverted("a cell", body.rest[body.cell_elements[c][0]]);
  }
}

void renormalise_cells(Body& body, const Problem& problem, const std::vector<Vec3>& displacement,
                       const std::vector<std::uint8_t>& cells) {
  const std::size_t count = body.cell_count();
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    if (part.cell_begin == part.cell_end) continue;
    const bool by_springs = problem.models.size() > p && problem.models[p] == Model::springs;
    const CellKind kind = cell_kind(part.lattice, problem.materials[p]);
    std::vector<double>*flow = nullptr, *volume = nullptr, *hourglass = nullptr, *springs = nullptr;
    std::optional<SpringKind> spring;
    if (by_springs) {
      spring = spring_kind(part.lattice, problem.materials[p]);
      springs = &values_of(body.cell_columns, "spring_flow", 28, count);
    } else {
      flow = &values_of(body.cell_columns, "plastic_flow", 6, count);
      volume = &values_of(body.cell_columns, "rest_volume", 1, count);
      hourglass = &values_of(body.cell_columns, "plastic_hourglass", 12, count);
    }
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
      if (!cells[c] || body.broken[c]) continue;
      const CellVectors u = corners_of(body, c, displacement);
      if (by_springs)
        for (std::size_t s = 0; s < 28; ++s) {
          const Spring& each = spring->springs[s];
          (*springs)[28 * std::size_t{c} + s] = stretch(each.rest, u[each.b] - u[each.a]).elongation;
        }
      else
        remember_cell(kind, part.lattice.axes, u, &(*flow)[6 * std::size_t{c}], &(*volume)[c],
                      &(*hourglass)[12 * std::size_t{c}]);
    }
  }
}

void renormalise_connections(Body& body, const Problem& problem, const std::vector<Vec3>& displacement,
                             const std::vector<std::uint8_t>& elements) {
  const Connections connections = make_connections(problem);
  if (connections.size() == 0) return;
  const PaperModel model(problem);
  if (const PaperModel::SmallestVolume least = model.smallest_volume({displacement}); !(least.value > 0))
    refuse_inverted("an element", body.rest[least.element]);
  std::vector<double>& rest = values_of(body.element_columns, "connection_rest", 13, body.element_count());
  for (const PartConnections& part : connections.parts)
    for (std::uint32_t c = part.begin; c < part.end; ++c) {
      const std::uint32_t a = connections.a[c], b = connections.b[c];
      if (!elements[a] || !elements[b]) continue;
      rest[13 * std::size_t{a} + connections.kind[c] - 1] =
          stretch(part.kinds[connections.kind[c]].rest, displacement[b] - displacement[a]).elongation;
    }
}

}  // namespace

void renormalise(Body& body, const Problem& problem, const std::vector<Vec3>& displacement,
                 const std::vector<std::uint8_t>& cells, const std::vector<std::uint8_t>& elements) {
  refuse_inverted_cells(body, displacement, cells);
  renormalise_connections(body, problem, displacement, elements);
  renormalise_cells(body, problem, displacement, cells);
  std::vector<std::uint8_t> settles = elements;
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (cells[c])
      for (const std::uint32_t e : body.cell_elements[c]) settles[e] = 1;
  std::vector<double>& settled = values_of(body.element_columns, "settled", 3, body.element_count());
  for (std::size_t e = 0; e < settles.size(); ++e)
    if (settles[e])
      std::copy(displacement[e].begin(), displacement[e].end(),
                settled.begin() + 3 * static_cast<std::ptrdiff_t>(e));
}

void renormalise_all(Body& body, const Problem& problem, const std::vector<Vec3>& displacement) {
  std::vector<std::uint8_t> cells(body.cell_count(), 1), elements(body.element_count(), 1);
  for (std::size_t c = 0; c < problem.stray_cell.size(); ++c) cells[c] = !problem.stray_cell[c];
  for (std::size_t e = 0; e < problem.stray_element.size(); ++e) elements[e] = !problem.stray_element[e];
  renormalise(body, problem, displacement, cells, elements);
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
  return factors(body, "stiffness_change");
}
std::vector<double> mass_factors(const Body& body) {
  return factors(body, "density_change");
}

}  // namespace flexel::simulate
