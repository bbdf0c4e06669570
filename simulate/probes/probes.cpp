// A probe at a point is carried by the cell whose matter it is of (formats/lattice/locate.h), with trilinear weights, or by
// the nearest element and its gradient (centre placement); a probe of a selection is the mean over its surface points by
// area, or over its elements.
#include "simulate/probes/probes.h"

#include <fmt/format.h>

#include <limits>
#include <optional>

#include "base/error.h"
#include "base/units.h"
#include "formats/lattice/locate.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/matter/surface_points.h"
#include "simulate/scene/coming_parts.h"

namespace flexel::simulate {
namespace {

void add(const InterpolationWeights& carrier, std::vector<std::pair<std::uint32_t, double>>& weights) {
  for (std::uint32_t a = 0; a < carrier.count; ++a)
    weights.emplace_back(carrier.elements[a], carrier.weights[a]);
}

[[noreturn]] void fail_outside(const Probe& probe, double distance) {
  throw InputError(probe.origin, fmt::format("probe \"{}\" lies {} outside the matter; move it onto the part",
                                             probe.name, human_length(distance)));
}

// Where the cell that carries a point is this process's own, and of several such processes the one to which it is nearest, or the
// first.
ProbePoints place_on_pieces(const Probe& probe, const Problem& problem, const PointHome& home) {
  constexpr double kNone = 1e300;
  const double own = counts_cell(*home.cell) ? home.distance : kNone;
  double nearest = own;
  const bool here = other_pieces()->take_of_largest(-own, std::span(&nearest, 1));
  if (!(nearest <= problem.body.parts[home.part].lattice.spacing.maxCoeff())) fail_outside(probe, nearest);
  ProbePoints points{probe.name, *probe.at, {}};
  if (here) add(cell_carrier(problem.body, cell_point(problem.body, *home.cell, *probe.at)), points.weights);
  return points;
}

// Throws InputError: further than a spacing from all matter.
ProbePoints place_point(const Probe& probe, const Problem& problem, const PointHomes& homes) {
  const Body& body = problem.body;
  const PointHome home = homes.find(*probe.at);
  if (other_pieces()) return place_on_pieces(probe, problem, home);
  if (!(home.distance <= body.parts[home.part].lattice.spacing.maxCoeff()))
    fail_outside(probe, home.distance);
  ProbePoints points{probe.name, *probe.at, {}};
  points.cell = home.cell;
  if (home.cell) {
    add(cell_carrier(body, cell_point(body, *home.cell, *probe.at)), points.weights);
  } else {
    // Within a spacing of a voxel there is an element within two.
    const auto element = nearest_element(problem, home.part, *probe.at, Vec3::Zero());
    add(with_gradient(problem, {{*element}, {1}, 1}, *probe.at), points.weights);
  }
  return points;
}

ProbePoints place_selection(const Probe& probe, const Problem& problem) {
  const Selected selected = resolve(*probe.where, problem.body);
  if (!selected.polygons.empty() && over_pieces(static_cast<double>(selected.elements.size())) > 0)
    throw InputError(probe.origin,
                     fmt::format("probe \"{}\" mixes surface and elements; write two probes", probe.name));
  std::vector<double> weights(problem.body.element_count(), 0);
  double total = 0;
  ProbePoints points{probe.name, Vec3::Zero(), {}};
  for (const SurfacePoint& point : gathered_surface_points(problem, selected.polygons)) {
    const double area = point.area_vector.norm();
    total += area;
    points.where += area * point.position;
    const InterpolationWeights carrier = with_gradient(problem, point.at, point.position);
    for (std::uint32_t a = 0; a < carrier.count; ++a)
      weights[carrier.elements[a]] += area * carrier.weights[a];
  }
  if (selected.polygons.empty())
    for (const std::uint32_t e : selected.elements) {
      if (!counts_element(e)) continue;
      total += 1;
      points.where += problem.body.rest[e];
      weights[e] += 1;
    }
  total = over_pieces(total);
  if (!(total > 0))
    throw InputError(probe.origin, fmt::format("probe \"{}\": no matter lies under its surface", probe.name));
  points.where = over_pieces(points.where) / total;
  for (std::uint32_t e = 0; e < weights.size(); ++e)
    if (weights[e] != 0) points.weights.emplace_back(e, weights[e] / total);
  return points;
}

}  // namespace

std::vector<ProbePoints> place_probes(const Scene& scene, const Problem& problem) {
  std::vector<ProbePoints> placed;
  std::optional<PointHomes> homes;  // a probe at a point needs them
  for (const Probe& probe :
       scene.coming_parts.empty() ? scene.probes : without_coming_probes(scene, problem.body)) {
    if (probe.at && !homes && other_pieces()) homes.emplace(problem.body);
    if (probe.at && !homes)
      homes.emplace(problem.body, problem.stray_cell, problem.stray_element, scene.probes.size());
    placed.push_back(probe.at      ? place_point(probe, problem, *homes)
                     : probe.where ? place_selection(probe, problem)
                                   : ProbePoints{probe.name});
  }
  return placed;
}

ProbeResult measure(const ProbePoints& probe, const State& state) {
  ProbeResult result{probe.name, probe.where, Vec3::Zero()};
  if (probe.is_to_come() && !other_pieces())
    result.displacement.setConstant(std::numeric_limits<double>::quiet_NaN());
  for (const auto& [element, weight] : probe.weights)
    result.displacement += weight * state.displacement[element];
  result.displacement = over_pieces(result.displacement);
  return result;
}

}  // namespace flexel::simulate
