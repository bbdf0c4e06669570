// Cells first, then elements; both in parallel, each written by one thread in a fixed order.
#include "simulate/matter/stress.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/math/dense.h"
#include "base/math/distance.h"
#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "formats/lattice/cell_moments.h"
#include "formats/lattice/column_names.h"
#include "formats/lattice/fields.h"
#include "simulate/models/cells.h"
#include "simulate/models/central_spring.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr const char* kOfCell = "cell_";  // before a name: in the middle of each cell
// Of the patch's weight, on the squared gradient per spacing: where the cells lie in one layer the field is
// constant across it.
constexpr double kRidge = 1e-3;
constexpr std::size_t kStressGrain = 256;

SymmetricStress components(const Mat3& m) {
  SymmetricStress s;
  s << m(0, 0), m(1, 1), m(2, 2), 0.5 * (m(0, 1) + m(1, 0)), 0.5 * (m(1, 2) + m(2, 1)),
      0.5 * (m(2, 0) + m(0, 2));
  return s;
}

Mat3 matrix(const SymmetricStress& s) {
  Mat3 m;
  m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
  return m;
}

// From the cell's own rest shape.
Mat3 cauchy(const CellKind& kind, const CellVectors& u) {
  return cauchy_stress(kind.law, displacement_gradient(kind, u));
}

Mat3 virial(const SpringKind& kind, const CellVectors& u, double volume) {
  Mat3 sum = Mat3::Zero();
  for (const Spring& spring : kind.springs) {
    const Stretch now = stretch(spring.rest, u[spring.b] - u[spring.a]);
    const Vec3 way = spring.rest + u[spring.b] - u[spring.a];
    if (!(now.length > 0)) continue;  // two elements at one place: no arm
    sum += spring.stiffness * (now.elongation - spring.flowed) * now.direction * way.transpose();
  }
  return volume > 0 ? Mat3(sum / volume) : Mat3::Zero();  // a folded cell has none
}

std::vector<SymmetricStress> cell_stresses(const Problem& problem, const State& state,
                                           const std::vector<std::uint8_t>& active) {
  const Body& body = problem.body;
  const RestShapes rest_shapes(body);
  const std::vector<double> share = stiffness_shares(body);
  std::vector<SymmetricStress> result(body.cell_count(), SymmetricStress::Zero());
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    if (part.cell_begin == part.cell_end) continue;
    const CellKind kind = cell_kind(part.lattice, problem.materials[p]);
    std::optional<SpringKind> springs;
    if (p < problem.models.size() && problem.models[p] == Model::springs)
      springs = spring_kind(part.lattice, problem.materials[p]);
    const auto stress_of = [&](std::uint32_t c) {
      CellVectors u;
      for (std::size_t a = 0; a < 8; ++a) u[a] = state.displacement[body.cell_elements[c][a]];
      if (springs)
        return virial(rest_shapes.any() ? rest_shapes.of(*springs, c).value_or(*springs) : *springs, u,
                      kind.volume * (1 + volume_change(displacement_gradient(kind, u))));
      const std::optional<CellKind> own = rest_shapes.any() ? rest_shapes.of(kind, part, c) : std::nullopt;
      return cauchy(own ? *own : kind, u);
    };
    parallel_for_each(
        part.cell_end - part.cell_begin,
        [&](std::size_t n) {
          const auto c = static_cast<std::uint32_t>(part.cell_begin + n);
          if (active[c]) result[c] = components(share[c] / body.fill[c] * stress_of(c));
        },
        kStressGrain);
  }
  return result;
}

// Which cells resist at each element (compressed rows, ascending).
struct CellsOfElements {
  std::vector<std::uint32_t> offsets, cells;
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t e) const {
    return {cells.data() + offsets[e], offsets[e + 1] - offsets[e]};
  }
};

CellsOfElements cells_of_elements(const Body& body, const std::vector<std::uint8_t>& active) {
  CellsOfElements result;
  result.offsets.assign(body.element_count() + 1, 0);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    if (active[c])
      for (const std::uint32_t e : body.cell_elements[c]) ++result.offsets[e + 1];
  for (std::size_t e = 0; e < body.element_count(); ++e) result.offsets[e + 1] += result.offsets[e];
  result.cells.resize(result.offsets.back());
  std::vector<std::uint32_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (active[c])
      for (const std::uint32_t e : body.cell_elements[c]) result.cells[next[e]++] = c;
  return result;
}

// The part's surface in each cell (compressed rows).
class SurfaceOfCells {
 public:
  explicit SurfaceOfCells(const Body& body)
      : body_(body), triangles_(triangulate(body.surface)), offsets_(body.cell_count() + 1, 0) {
    const bool known = body.surface_cell_offsets.size() == body.surface.polygon_count() + 1;
    const auto for_each = [&](const auto& each) {
      for (std::uint32_t t = 0; known && t < triangles_.polygon.size(); ++t)
        for (std::uint32_t i = body.surface_cell_offsets[triangles_.polygon[t]];
             i < body.surface_cell_offsets[triangles_.polygon[t] + 1]; ++i)
          each(body.surface_cells[i], t);
    };
    for_each([&](std::uint32_t c, std::uint32_t) { ++offsets_[c + 1]; });
    for (std::size_t c = 0; c < body.cell_count(); ++c) offsets_[c + 1] += offsets_[c];
    list_.resize(offsets_.back());
    std::vector<std::uint32_t> next(offsets_.begin(), offsets_.end() - 1);
    for_each([&](std::uint32_t c, std::uint32_t t) { list_[next[c]++] = t; });
  }

  // The point of the surface in `cells` that is nearest to `point`.
  [[nodiscard]] std::optional<Vec3> nearest(std::span<const std::uint32_t> cells, const Vec3& point) const {
    std::optional<Vec3> found;
    for (const std::uint32_t c : cells)
      for (std::uint32_t i = offsets_[c]; i < offsets_[c + 1]; ++i) {
        const auto& corners = triangles_.corners[list_[i]];
        const std::vector<Vec3>& at = body_.surface.vertices;
        const Vec3 here = nearest_of_triangle(point, at[corners[0]], at[corners[1]], at[corners[2]]);
        if (!found || (here - point).squaredNorm() < (*found - point).squaredNorm()) found = here;
      }
    return found;
  }

 private:
  const Body& body_;
  Triangles triangles_;
  std::vector<std::uint32_t> offsets_, list_;
};

// Recovers the stress at an element, or at a point beside it.
class Recovery {
 public:
  Recovery(const Body& body, const CellsOfElements& around, const std::vector<SymmetricStress>& cell)
      : body_(body), around_(around), cell_(cell) {}

  // `beside`: where, from the element, in spacings of the lattice.
  [[nodiscard]] SymmetricStress operator()(std::uint32_t e, const Vec3& beside) const {
    const std::span<const std::uint32_t> near = around_.of(e);
    if (near.empty()) return SymmetricStress::Zero();
    const bool full = near.size() == 8 && std::all_of(near.begin(), near.end(), [&](std::uint32_t c) {
                        return body_.fill[c] >= kWholeFill;
                      });
    if (!full) return fitted(e, beside, patch(near));
    SymmetricStress sum = SymmetricStress::Zero();
    for (const std::uint32_t c : near) sum += cell_[c];
    return sum / 8;
  }

 private:
  // The cells around an element, and those that share an element with one of them; ascending.
  [[nodiscard]] std::vector<std::uint32_t> patch(std::span<const std::uint32_t> near) const {
    thread_local std::vector<std::uint8_t> seen;  // all 0 between two uses
    if (seen.size() < body_.cell_count()) seen.resize(body_.cell_count(), 0);
    std::vector<std::uint32_t> cells;
    for (const std::uint32_t c : near)
      for (const std::uint32_t e : body_.cell_elements[c])
        for (const std::uint32_t other : around_.of(e)) {
          if (seen[other]) continue;
          seen[other] = 1;
          cells.push_back(other);
        }
    for (const std::uint32_t c : cells) seen[c] = 0;
    std::sort(cells.begin(), cells.end());
    return cells;
  }

  [[nodiscard]] SymmetricStress fitted(std::uint32_t e, const Vec3& beside,
                                       const std::vector<std::uint32_t>& cells) const {
    using Vec4 = Eigen::Vector4d;
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, 4, 6> values = Eigen::Matrix<double, 4, 6>::Zero();
    const Index3& home = body_.lattice_index[e];
    for (const std::uint32_t c : cells) {
      const Index3& low = body_.lattice_index[body_.cell_elements[c][0]];
      const Vec4 at(1, low[0] + 0.5 - home[0], low[1] + 0.5 - home[1], low[2] + 0.5 - home[2]);
      const double weight = body_.fill[c] * std::exp(-at.tail<3>().squaredNorm());
      moments += weight * at * at.transpose();
      values += weight * at * cell_[c].transpose();
    }
    const double ridge = kRidge * moments(0, 0);
    // About the patch's middle, so that the ridge acts on the gradient alone.
    const Vec3 middle = moments.block<3, 1>(1, 0) / moments(0, 0);
    const Eigen::Matrix<double, 1, 6> mean = values.row(0) / moments(0, 0);
    Mat3 spread = moments.block<3, 3>(1, 1) - moments(0, 0) * middle * middle.transpose();
    spread.diagonal().array() += ridge;
    const Eigen::Matrix<double, 3, 6> about = values.bottomRows<3>() - moments(0, 0) * middle * mean;
    const Eigen::Matrix<double, 3, 6> slope = solve_symmetric_3(spread, about);
    return (mean + (beside - middle).transpose() * slope).transpose();
  }

  const Body& body_;
  const CellsOfElements& around_;
  const std::vector<SymmetricStress>& cell_;
};

void add_columns(const std::vector<SymmetricStress>& stress, const std::string& before, Columns& columns) {
  Column mises{1, std::vector<double>(stress.size())}, principal{3, std::vector<double>(3 * stress.size())};
  parallel_for_each(stress.size(), [&](std::size_t i) {
    mises.values[i] = von_mises(stress[i]);
    const Vec3 each = principal_stresses(stress[i]);
    std::copy(each.begin(), each.end(), principal.values.begin() + static_cast<std::ptrdiff_t>(3 * i));
  });
  columns[before + kVonMisesColumn] = std::move(mises);
  columns[before + kPrincipalColumn] = std::move(principal);
}

}  // namespace

Stresses stresses(const Problem& problem, const State& state) {
  const Body& body = problem.body;
  const std::vector<std::uint8_t> active = active_cells(problem);
  Stresses result;
  result.cell = cell_stresses(problem, state, active);
  const CellsOfElements around = cells_of_elements(body, active);
  result.element.assign(body.element_count(), SymmetricStress::Zero());
  result.element_at = body.rest;
  const Recovery recover(body, around, result.cell);
  const std::vector<std::uint8_t> inside = elements_in_matter(body);
  const std::vector<std::uint32_t> part = element_parts(body);
  std::optional<SurfaceOfCells> surface;
  if (std::find(inside.begin(), inside.end(), 0) != inside.end()) surface.emplace(body);
  parallel_for_each(
      body.element_count(),
      [&](std::size_t i) {
        const auto e = static_cast<std::uint32_t>(i);
        if (inside[e] == 0)
          result.element_at[e] = surface->nearest(around.of(e), body.rest[e]).value_or(body.rest[e]);
        const Lattice& lattice = body.parts[part[e]].lattice;
        result.element[e] = recover(e, (lattice.axes.transpose() * (result.element_at[e] - body.rest[e]))
                                           .cwiseQuotient(lattice.spacing));
      },
      kStressGrain);
  return result;
}

double von_mises(const SymmetricStress& s) {
  const double x = s[0] - s[1], y = s[1] - s[2], z = s[2] - s[0];
  return std::sqrt(0.5 * (x * x + y * y + z * z) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

Vec3 principal_stresses(const SymmetricStress& stress) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(matrix(stress), Eigen::EigenvaluesOnly);
  return solver.eigenvalues().reverse();
}

std::optional<LargestStress> largest_stress(const Body& body, const Stresses& stresses) {
  std::optional<LargestStress> largest;
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    if (body.parts[p].placement == Placement::centre) continue;
    for (std::uint32_t e = body.parts[p].element_begin; e < body.parts[p].element_end; ++e)
      if (const double value = von_mises(stresses.element[e]); !largest || value > largest->value)
        largest = LargestStress{value, stresses.element_at[e], p,
                                stresses.element_doubt.empty() ? 0 : stresses.element_doubt[e]};
  }
  return largest;
}

void write_stress_columns(const Stresses& stresses, Body& body) {
  add_columns(stresses.cell, kOfCell, body.cell_columns);
  add_columns(stresses.element, "", body.element_columns);
  if (!stresses.vertex.empty()) add_columns(stresses.vertex, "", body.surface.vertex_columns);
}

bool is_stress_column(const std::string& name) {
  for (const std::string column : {kVonMisesColumn, kPrincipalColumn})
    if (name == column || name == kOfCell + column) return true;
  return false;
}

void erase_stress_columns(Body& body) {
  if (has_surface_stress(body)) erase_surface_stress(body.surface.vertex_columns);
  for (Columns* columns : {&body.cell_columns, &body.element_columns})
    std::erase_if(*columns, [](const auto& column) { return is_stress_column(column.first); });
}

}  // namespace flexel::simulate
