// Pairs of cells along the shared surface, each with a constant matrix. They are few (a layer between two
// parts), so their sums run on one thread in a fixed order.
#include "simulate/effects/bonds.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "simulate/touching.h"

namespace flexel {
namespace {

using Weights = Eigen::Matrix<double, 16, 1>;

Weights jump(const TouchingPoint& point) {
  Weights weights;
  for (Eigen::Index a = 0; a < 8; ++a) {
    weights[a] = point.at[0].weights[static_cast<std::size_t>(a)];
    weights[8 + a] = -point.at[1].weights[static_cast<std::size_t>(a)];
  }
  return weights;
}

// E / h of the softer side [Pa/m].
double foundation(const TouchingPoint& point, const Setting& setting) {
  const auto of = [&](std::uint32_t part) {
    return setting.materials[part].young / setting.body.parts[part].lattice.spacing.mean();
  };
  return std::min(of(point.part[0]), of(point.part[1]));
}

}  // namespace

void Bonds::parse(TableReader& scene, Parameters& parameters) {
  const auto flag = [&](const char* key, bool fallback) {
    const SceneValue* value = scene.find(key);
    if (!value) return fallback;
    if (value->kind != SceneValue::Kind::boolean)
      scene.fail(value->line, fmt::format("\"{}\" needs to be true or false", key));
    return value->flag;
  };
  parameters.bond = flag("bond", true);
  if (flag("contact", false))
    scene.fail(scene.find("contact")->line,
               "\"contact\" = true needs a timed run, which this version does not have; parts that touch are "
               "bonded, or with bond = false do not feel one another");
}

std::optional<Bonds> Bonds::make(const Parameters& parameters, const Setting& setting) {
  if (!parameters.bond) return std::nullopt;
  const std::vector<TouchingPoint> points = touching_points(setting.body, setting.stray_cell);
  if (points.empty()) return std::nullopt;
  Bonds made;
  made.body_ = &setting.body;
  std::map<CellPair, Eigen::Matrix<double, 16, 16>> by_cells;
  std::map<std::array<std::uint32_t, 2>, double> area;
  for (const TouchingPoint& point : points) {
    const Weights weights = jump(point);
    auto [entry, fresh] =
        by_cells.try_emplace({point.at[0].cell, point.at[1].cell}, Eigen::Matrix<double, 16, 16>::Zero());
    entry->second += kPenalty * foundation(point, setting) * point.area * weights * weights.transpose();
    area[{std::min(point.part[0], point.part[1]), std::max(point.part[0], point.part[1])}] += point.area;
  }
  for (const auto& [cells, stiffness] : by_cells) made.cells_.push_back({cells, stiffness});
  for (const auto& [parts, shared] : area)
    made.parts_.push_back({{setting.body.parts[parts[0]].name, setting.body.parts[parts[1]].name}, shared});
  return made;
}

std::string Bonds::why() const {
  return fmt::format("{} pair(s) of parts touch; bond = false leaves them apart", parts_.size());
}

Eigen::Matrix<double, 16, 3> Bonds::displacements(const BondedCells& bond, const State& state) const {
  Eigen::Matrix<double, 16, 3> u;
  for (Eigen::Index a = 0; a < 16; ++a) u.row(a) = state.displacement[element(bond, a)].transpose();
  return u;
}

double Bonds::energy(const State& state) const {
  double energy = 0;
  for (const BondedCells& bond : cells_) {
    const Eigen::Matrix<double, 16, 3> u = displacements(bond, state);
    energy += 0.5 * (u.transpose() * bond.stiffness * u).trace();
  }
  return energy;
}

void Bonds::add_forces(const State& state, std::vector<Vec3>& forces) const {
  for (const BondedCells& bond : cells_) {
    const Eigen::Matrix<double, 16, 3> force = bond.stiffness * displacements(bond, state);
    for (Eigen::Index a = 0; a < 16; ++a) forces[element(bond, a)] -= force.row(a).transpose();
  }
}

void Bonds::add_stiffness(const State&, const Stencil&, const Body&, BlockMatrix& matrix) const {
  for (const BondedCells& bond : cells_)
    for (Eigen::Index a = 0; a < 16; ++a)
      for (Eigen::Index b = 0; b < 16; ++b)
        matrix.values[position_of(matrix, element(bond, a), element(bond, b))].diagonal().array() +=
            bond.stiffness(a, b);
}

std::vector<CellPair> Bonds::couples() const {
  std::vector<CellPair> pairs;
  for (const BondedCells& bond : cells_) pairs.push_back(bond.cells);
  return pairs;
}

void Bonds::report(const State&, const std::vector<Vec3>&, SimulateResult& result) const {
  result.bonds = parts_;
}

}  // namespace flexel
