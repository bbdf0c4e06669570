// Cells and springs keep what differs from the lattice in columns of the body, by which a later run finds it.
#include "simulate/models/set_rest_shape.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "base/units.h"
#include "simulate/models/paper_model.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

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

}  // namespace flexel::simulate
