// Pairs of carriers along the shared surface, each with a constant matrix. They are few (a layer between two
// parts), so their sums run on one thread in a fixed order.
#include "simulate/effects/bonds.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "base/error.h"
#include "formats/lattice/fused_points.h"
#include "simulate/effects/contact.h"
#include "simulate/input/part_names.h"
#include "simulate/matter/joined_parts.h"
#include "simulate/matter/masses.h"
#include "simulate/models/stability.h"

namespace flexel::simulate {
namespace {

constexpr double kMostOfCells = 2;  // of the square of their frequency, in timed runs

using Weights = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 16, 1>;

std::vector<std::uint32_t> elements_of(const TouchingPoint& point) {
  std::vector<std::uint32_t> elements;
  for (const InterpolationWeights& carrier : point.at)
    elements.insert(elements.end(), carrier.elements.begin(), carrier.elements.begin() + carrier.count);
  return elements;
}

Weights jump(const TouchingPoint& point) {
  Weights weights(point.at[0].count + point.at[1].count);
  for (std::uint32_t a = 0; a < point.at[0].count; ++a) weights[a] = point.at[0].weights[a];
  for (std::uint32_t a = 0; a < point.at[1].count; ++a)
    weights[point.at[0].count + a] = -point.at[1].weights[a];
  return weights;
}

// E / h of the softer side [Pa/m].
double foundation(const TouchingPoint& point, const Problem& problem, const ChangeAround& stiffer) {
  const auto of = [&](std::size_t side) {
    const std::uint32_t part = point.part[side];
    return stiffer.at(point.at[side]) * problem.materials[part].young /
           problem.body.parts[part].lattice.spacing.mean();
  };
  return std::min(of(0), of(1));
}

// Bonds of [[bond]].
std::vector<Bonds::Named> parse_named(TableReader& scene) {
  std::vector<Bonds::Named> named;
  if (const SceneValue::Kind kind = scene.find("bond")->kind;
      kind != SceneValue::Kind::table && kind != SceneValue::Kind::array)
    scene.fail(scene.find("bond")->line, "\"bond\" needs to be true, false or written as [[bond]]");
  for (const SceneValue* table : scene.tables("bond")) {
    TableReader reader(*table, scene.file(), "[[bond]]");
    Bonds::Named one;
    one.origin = reader.place();
    const SceneValue& parts = reader.require("parts", "[\"a\", \"b\"]");
    if (parts.kind != SceneValue::Kind::array || parts.items.size() != 2 ||
        parts.items[0].kind != SceneValue::Kind::string || parts.items[1].kind != SceneValue::Kind::string ||
        parts.items[0].text == parts.items[1].text)
      reader.fail(parts.line, "\"parts\" needs the names of two parts, for example [\"a\", \"b\"]");
    one.parts = {parts.items[0].text, parts.items[1].text};
    one.gap = reader.quantity("gap", Dimension::length).value_or(0);
    if (!(one.gap >= 0)) reader.fail("\"gap\" in [[bond]] needs to be 0 or more");
    reader.finish();
    named.push_back(one);
  }
  return named;
}

TouchingGap named_gap(const Bonds::Named& named, const Body& body) {
  TouchingGap made{{}, named.gap};
  for (std::size_t side = 0; side < 2; ++side)
    made.parts[side] = require_part(body, named.parts[side], named.origin);
  if (made.parts[0] == made.parts[1])
    throw InputError(named.origin,
                     fmt::format("\"{}\" and \"{}\" are one part, which cannot be bonded to itself",
                                 named.parts[0], named.parts[1]));
  std::sort(made.parts.begin(), made.parts.end());
  const double most = 0.5 * std::max(body.parts[made.parts[0]].lattice.spacing.minCoeff(),
                                     body.parts[made.parts[1]].lattice.spacing.minCoeff());
  if (named.gap > most)
    throw InputError(named.origin,
                     fmt::format("the gap of a [[bond]] can be half a spacing, {:.4g} mm here", 1e3 * most));
  return made;
}

// What resists at an element: itself; of a rigid part all of it, and for what turns it a quarter.
struct Resisting {
  std::vector<std::uint32_t> node;  // (elements)
  std::vector<double> mass;         // (elements) kg, of nodes
  std::vector<double> most;         // (elements) 1/s^2, likewise: the square of the frequency that is allowed
};

Resisting resisting(const Problem& problem) {
  const std::vector<double> own = cell_frequencies(problem);
  const QuickerByEdits quicker(problem.body);
  Resisting made{{}, lumped_masses(problem), {}};
  for (std::size_t p = 0; p < own.size(); ++p) {
    const Part& part = problem.body.parts[p];
    const bool rigid = problem.rigidity.size() > p && problem.rigidity[p] != Rigidity::none;
    const double width = part.lattice.spacing.mean();
    // connections of model `paper` give no bound of their own here
    const double omega2 =
        own[p] > 0 ? own[p]
                   : 10 * problem.materials[p].young / (problem.materials[p].density * width * width);
    double whole = 0;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
      whole += made.mass[e];
      made.node.push_back(rigid ? part.element_begin : e);
      made.most.push_back(rigid ? std::numeric_limits<double>::infinity()
                                : kMostOfCells * quicker(e) * omega2);
    }
    if (rigid) made.mass[part.element_begin] = 0.25 * whole;
  }
  return made;
}

}  // namespace

void Bonds::parse(TableReader& scene, Parameters& parameters) {
  const bool contact = asks_for_contact(scene);
  const SceneValue* bond = scene.find("bond");
  if (bond && bond->kind != SceneValue::Kind::boolean) {
    parameters.named = parse_named(scene);
    parameters.bond = !contact;
    return;
  }
  if (bond && bond->flag && contact)
    scene.fail(bond->line,
               "\"bond\" = true, but with contact parts that touch are not bonded; give one of them");
  parameters.bond = bond ? bond->flag : !contact;
}

std::vector<TouchingGap> Bonds::named_gaps(const Parameters& parameters, const Body& body) {
  std::vector<TouchingGap> gaps;
  for (const Named& each : parameters.named) gaps.push_back(named_gap(each, body));
  return gaps;
}

void Bonds::refuse_apart(const Named& named) {
  throw InputError(
      named.origin,
      fmt::format("parts \"{}\" and \"{}\" of a [[bond]] do not touch: no face of one looks "
                  "at one of the other{}",
                  named.parts[0], named.parts[1], named.gap > 0 ? " over its gap" : "; give a \"gap\""));
}

void Bonds::refuse_joined_apart(const Parameters& parameters, const Body& body) {
  if (parameters.named.empty() || !body.notes.contains(kJoinedNote)) return;
  const std::vector<std::uint8_t> joined = joined_parts(body);
  const std::vector<TouchingGap> named = named_gaps(parameters, body);
  const std::vector<FusedPoint> fused = fused_points(body);
  for (std::size_t n = 0; n < named.size(); ++n) {
    const auto& [a, b] = named[n].parts;
    if (!joined[a] && !joined[b]) continue;
    if (!are_fused(body, fused, a, b))
      throw InputError(
          parameters.named[n].origin,
          fmt::format("parts \"{}\" and \"{}\" of a [[bond]]: one joined in an earlier run, and did not "
                      "touch the other then; an [[event]] with do = \"fuse\" holds them together",
                      parameters.named[n].parts[0], parameters.named[n].parts[1]));
  }
}

std::optional<Bonds> Bonds::make(const Parameters& parameters, const Problem& problem) {
  if (!parameters.bond && parameters.named.empty()) return std::nullopt;
  const std::vector<TouchingGap> named = named_gaps(parameters, problem.body);
  const auto is_named = [&](const std::array<std::uint32_t, 2>& parts) {
    return std::any_of(named.begin(), named.end(), [&](const TouchingGap& each) {
      return each.parts == std::array{std::min(parts[0], parts[1]), std::max(parts[0], parts[1])};
    });
  };
  Bonds made;
  using Matrix = decltype(BondedElements::stiffness);
  std::map<std::vector<std::uint32_t>, Matrix> by_elements;
  std::map<std::array<std::uint32_t, 2>, double> area;
  const std::vector<std::uint8_t> joined = joined_parts(problem.body);
  const ChangeAround stiffer(problem.body, "stiffness_change");
  for_each_touching_point(problem, named, [&](const TouchingPoint& point) {
    if (joined[point.part[0]] || joined[point.part[1]] || (!parameters.bond && !is_named(point.part))) return;
    const Weights weights = jump(point);
    auto [entry, fresh] =
        by_elements.try_emplace(elements_of(point), Matrix::Zero(weights.size(), weights.size()));
    entry->second +=
        kPenalty * foundation(point, problem, stiffer) * point.area * weights * weights.transpose();
    area[{std::min(point.part[0], point.part[1]), std::max(point.part[0], point.part[1])}] += point.area;
  });
  for (std::size_t n = 0; n < named.size(); ++n)
    if (!area.contains(named[n].parts) && !joined[named[n].parts[0]] && !joined[named[n].parts[1]])
      refuse_apart(parameters.named[n]);
  if (by_elements.empty()) return std::nullopt;
  for (const auto& [elements, stiffness] : by_elements) made.bonds_.push_back({elements, stiffness});
  for (const auto& [parts, shared] : area)
    made.parts_.push_back({{problem.body.parts[parts[0]].name, problem.body.parts[parts[1]].name}, shared});
  if (problem.duration) made.soften(problem);
  return made;
}

std::vector<double> Bonds::softening(const Problem& problem, const std::vector<Rows>& all) {
  const Resisting resists = resisting(problem);
  std::vector<double> stiff(resists.mass.size(), 0);
  for (const Rows& rows : all)
    for (const auto& [element, sum] : rows) stiff[resists.node[element]] += sum;
  std::vector<double> left(all.size(), 1);
  for (std::size_t n = 0; n < all.size(); ++n)
    for (const auto& [element, sum] : all[n]) {
      const std::uint32_t node = resists.node[element];
      if (stiff[node] > 0) left[n] = std::min(left[n], resists.most[node] * resists.mass[node] / stiff[node]);
    }
  return left;
}

Bonds::Rows Bonds::row_sums(const BondedElements& bond) {
  Rows rows;
  for (Eigen::Index a = 0; a < bond.stiffness.rows(); ++a)
    rows.emplace_back(bond.element(a), bond.stiffness.row(a).cwiseAbs().sum());
  return rows;
}

void Bonds::soften(const Problem& problem) {
  std::vector<Rows> all;
  for (const BondedElements& bond : bonds_) all.push_back(row_sums(bond));
  const std::vector<double> left = softening(problem, all);
  const Resisting resists = resisting(problem);
  std::vector<double> soft(resists.mass.size(), 0);
  for (std::size_t n = 0; n < bonds_.size(); ++n) {
    bonds_[n].stiffness *= left[n];
    for (const auto& [element, sum] : all[n]) soft[resists.node[element]] += left[n] * sum;
  }
  for (std::size_t e = 0; e < soft.size(); ++e)
    if (soft[e] > 0) frequency_ = std::max(frequency_, soft[e] / resists.mass[e]);
}

bool Bonds::holds(std::uint32_t one, std::uint32_t other, const Body& body) const {
  const std::array<std::string, 2> names = {body.parts[std::min(one, other)].name,
                                            body.parts[std::max(one, other)].name};
  return std::any_of(parts_.begin(), parts_.end(),
                     [&](const BondedParts& each) { return each.parts == names; });
}

std::string Bonds::why() const {
  return fmt::format("{} pair(s) of parts touch or are named by [[bond]]", parts_.size());
}

Bonds::Displacements Bonds::displacements(const BondedElements& bond, const State& state) {
  Displacements u(bond.elements.size(), 3);
  for (Eigen::Index a = 0; a < u.rows(); ++a) u.row(a) = state.displacement[bond.element(a)].transpose();
  return u;
}

double Bonds::energy(const State& state) {
  double energy = 0;
  for (const BondedElements& bond : bonds_) {
    const Displacements u = displacements(bond, state);
    energy += 0.5 * (u.transpose() * bond.stiffness * u).trace();
  }
  return energy;
}

void Bonds::add_forces(const State& state, std::vector<Vec3>& forces) {
  for (const BondedElements& bond : bonds_) {
    const Displacements force = bond.stiffness * displacements(bond, state);
    for (Eigen::Index a = 0; a < force.rows(); ++a) forces[bond.element(a)] -= force.row(a).transpose();
  }
}

void Bonds::add_stiffness(const State&, BlockMatrix& matrix) {
  for (const BondedElements& bond : bonds_)
    for (Eigen::Index a = 0; a < bond.stiffness.rows(); ++a)
      for (Eigen::Index b = 0; b < bond.stiffness.cols(); ++b)
        matrix.values[position_of(matrix, bond.element(a), bond.element(b))].diagonal().array() +=
            bond.stiffness(a, b);
}

std::vector<CoupledElements> Bonds::couples() const {
  std::vector<CoupledElements> groups;
  for (const BondedElements& bond : bonds_) {
    groups.push_back(bond.elements);
    std::sort(groups.back().begin(), groups.back().end());
  }
  return groups;
}

void Bonds::report(const State&, const std::vector<Vec3>&, SimulateResult& result) {
  result.bonds = parts_;
}

}  // namespace flexel::simulate
