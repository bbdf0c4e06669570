// Displacements of a linear strain field have the second derivatives u_i,jk = e_ij,k + e_ik,j - e_jk,i.
#include "simulate/thermal/free_strain.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/human.h"
#include "base/parallel.h"
#include "base/units.h"
#include "simulate/effects/part_entries.h"

namespace flexel::simulate {
namespace {

constexpr double kLargest = 0.25;  // beyond it nothing is linear, and a unit is wrong
constexpr int kEntries[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

const Column* column_of(const Columns& columns, const std::string& name) {
  const auto found = columns.find(name);
  return found == columns.end() ? nullptr : &found->second;
}

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

Extent extent(const Body& body, std::size_t part, const Vec3& axis) {
  Extent found;
  const Surface& surface = body.surface;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (surface.polygon_part(p) == part)
      for (const std::uint32_t v : surface.polygon(p)) found.add(axis.dot(surface.vertices[v]));
  if (found.high > found.low) return found;
  for (std::uint32_t e = body.parts[part].element_begin; e < body.parts[part].element_end; ++e)
    found.add(axis.dot(body.rest[e]));
  return found;
}

double factor_at(const Shrinkage& shrinkage, double height) {
  const std::vector<double>&at = shrinkage.height, &factor = shrinkage.factor;
  if (at.empty()) return 1;
  const auto next = std::upper_bound(at.begin(), at.end(), height);
  if (next == at.begin()) return factor.front();
  if (next == at.end()) return factor.back();
  const auto i = static_cast<std::size_t>(next - at.begin());
  return factor[i - 1] + (height - at[i - 1]) / (at[i] - at[i - 1]) * (factor[i] - factor[i - 1]);
}

Vec3 lowest_corner(const Body& body, std::uint32_t cell) {
  const Index3& low = body.lattice_index[body.cell_elements[cell][0]];
  return {static_cast<double>(low[0]), static_cast<double>(low[1]), static_cast<double>(low[2])};
}

// Mean and slope by cell coordinates, from Gauss's points; lattice frame.
struct LinearStrain {
  Mat3 mean = Mat3::Zero();
  std::array<Mat3, 3> slope{Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
};

LinearStrain linear_strain(const FreeStrain& strain, const Lattice& lattice, std::uint32_t part,
                           std::uint32_t cell) {
  constexpr double points[3] = {0.1127016653792583, 0.5, 0.8872983346207417};
  constexpr double weights[3] = {5. / 18, 8. / 18, 5. / 18};
  LinearStrain found;
  for (std::size_t k = 0; k < 27; ++k) {
    const Vec3 at(points[k % 3], points[k / 3 % 3], points[k / 9]);
    const double weight = weights[k % 3] * weights[k / 3 % 3] * weights[k / 9];
    const Mat3 here = lattice.axes.transpose() * strain.at(part, cell, at) * lattice.axes;
    found.mean += weight * here;
    for (int axis = 0; axis < 3; ++axis)
      found.slope[static_cast<std::size_t>(axis)] += 12 * weight * (at[axis] - 0.5) * here;
  }
  return found;
}

}  // namespace

FreeStrain::FreeStrain(const Body& body, const ThermalSettings& settings,
                       const std::vector<Material>& materials)
    : body_(&body), changes_(settings.changes), shrinkages_(settings.shrinkages) {
  if (!settings.expands()) return;
  parts_.resize(body.parts.size());
  for (const auto& [change, parts] : entries_of_parts(changes_, body))
    for (const std::uint32_t p : parts) add_change(*change, settings, materials, p);
  for (const auto& [shrinkage, parts] : entries_of_parts(shrinkages_, body))
    for (const std::uint32_t p : parts) {
      parts_[p].shrinkage = shrinkage;
      const Extent high = extent(body, p, shrinkage->axis);
      parts_[p].bottom = high.low;
      parts_[p].layers = std::max(1.0, std::ceil((high.high - high.low) / shrinkage->layer - 1e-6));
    }
  for (std::uint32_t p = 0; p < parts_.size(); ++p) check(p);
}

void FreeStrain::add_change(const TemperatureChange& change, const ThermalSettings& settings,
                            const std::vector<Material>& materials, std::size_t p) {
  const ThermalFigures figures = thermal_figures(settings, materials[p]);
  if (!figures.expansion)
    throw InputError(change.origin,
                     fmt::format("part \"{}\": {} has no coefficient of expansion: write [materials.NAME] "
                                 "expansion = \"12e-6 /K\"",
                                 body_->parts[p].name, materials[p].name));
  parts_[p].change = &change;
  parts_[p].expansion = *figures.expansion;
  parts_[p].element = parts_[p].cell = nullptr;
  find_column(change, settings.conducts(), parts_[p]);
}

void FreeStrain::find_column(const TemperatureChange& change, bool conducts, PartStrain& part) const {
  const std::string name = !change.column.empty()         ? change.column
                           : conducts && change.reference ? kTemperatureColumn
                                                          : "";
  if (name.empty()) return;
  part.reference = change.reference.value_or(0);
  part.element = column_of(body_->element_columns, name);
  if (part.element == nullptr) part.cell = column_of(body_->cell_columns, name);
  const Column* found = part.element != nullptr ? part.element : part.cell;
  if (found == nullptr)
    throw InputError(change.origin,
                     fmt::format("the body has no column \"{}\" of its elements or cells", name));
  if (found->components != 1)
    throw InputError(change.origin, fmt::format("column \"{}\" has {} components, and a temperature has one",
                                                name, found->components));
  if (!std::all_of(found->values.begin(), found->values.end(),
                   [](double value) { return std::isfinite(value); }))
    throw InputError(change.origin,
                     fmt::format("column \"{}\" holds a temperature that is not finite", name));
}

void FreeStrain::check(std::uint32_t p) const {
  const Part& part = body_->parts[p];
  double most = 0;
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
    most = std::max(most, at(p, c, Vec3::Constant(0.5)).cwiseAbs().maxCoeff());
  if (most <= kLargest) return;
  throw InputError(parts_[p].change != nullptr ? parts_[p].change->origin : parts_[p].shrinkage->origin,
                   fmt::format("part \"{}\" would be strained by {} if it were free: check expansion, "
                               "temperatures and their units",
                               part.name, human_share(most)));
}

double FreeStrain::warmer_by(const PartStrain& part, std::uint32_t cell, const Vec3& at,
                             const Vec3& place) const {
  if (part.change == nullptr) return 0;
  double sum = part.change->change + part.change->gradient.dot(place - part.change->about);
  if (part.cell != nullptr) sum += part.cell->values[cell] - part.reference;
  if (part.element == nullptr) return sum;
  for (std::uint32_t a = 0; a < 8; ++a) {
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= a >> axis & 1u ? at[axis] : 1 - at[axis];
    sum += weight * (part.element->values[body_->cell_elements[cell][a]] - part.reference);
  }
  return sum;
}

Mat3 FreeStrain::at(std::uint32_t p, std::uint32_t cell, const Vec3& at) const {
  const PartStrain& part = parts_[p];
  const Vec3 place = body_->parts[p].lattice.to_world(lowest_corner(*body_, cell) + at);
  Mat3 strain = part.expansion * warmer_by(part, cell, at, place) * Mat3::Identity();
  if (part.shrinkage == nullptr) return strain;
  const Shrinkage& printed = *part.shrinkage;
  // layers have that of their middle, which rounding and the points of an integral would blur: linear between the middles
  const double in_layers = (printed.axis.dot(place) - part.bottom) / printed.layer - 0.5;
  const double layer = std::clamp(in_layers, 0.0, part.layers - 1);
  const double factor = factor_at(printed, (layer + 0.5) * printed.layer);
  const Mat3 along = printed.axis * printed.axis.transpose();
  return strain + factor * (printed.along * along + printed.across * (Mat3::Identity() - along));
}

Column free_strain_column(const Body& body, const FreeStrain& strain) {
  constexpr std::size_t kValues = 18;
  Column column{kValues, std::vector<double>(kValues * body.cell_count(), 0)};
  const std::vector<std::uint32_t> part = cell_parts(body);
  parallel_for_each(body.cell_count(), [&](std::size_t c) {
    const Lattice& lattice = body.parts[part[c]].lattice;
    const LinearStrain e = linear_strain(strain, lattice, part[c], static_cast<std::uint32_t>(c));
    const Mat3 change = -(Mat3::Identity() + e.mean).inverse() * e.mean;
    double* to = &column.values[kValues * c];
    for (const auto& entry : kEntries) *to++ = change(entry[0], entry[1]);
    const Vec3& h = lattice.spacing;
    for (const auto& [j, k] : {std::pair{0, 1}, {1, 2}, {2, 0}}) {
      const Mat3 &by_j = e.slope[static_cast<std::size_t>(j)], &by_k = e.slope[static_cast<std::size_t>(k)];
      for (int i = 0; i < 3; ++i) {
        const double by_i = e.slope[static_cast<std::size_t>(i)](j, k) / h[i];
        *to++ = 0.25 * h[j] * h[k] * (by_k(i, j) / h[k] + by_j(i, k) / h[j] - by_i);
      }
    }
  });
  return column;
}

}  // namespace flexel::simulate
