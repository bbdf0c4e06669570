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
#include "simulate/matter/surface_points.h"
#include "simulate/scene/coming_parts.h"

namespace flexel::simulate {
namespace {

void add(const InterpolationWeights& carrier, std::vector<std::pair<std::uint32_t, double>>& weights) {
  for (std::uint32_t a = 0; a < carrier.count; ++a)
    weights.emplace_back(carrier.elements[a], carrier.weights[a]);
}

// Throws InputError: further than a spacing from all matter.
ProbePoints place_point(const Probe& probe, const Problem& problem, const PointHomes& homes) {
  const Body& body = problem.body;
  const PointHome home = homes.find(*probe.at);
  if (!(home.distance <= body.parts[home.part].lattice.spacing.maxCoeff()))
    throw InputError(probe.origin,
                     fmt::format("probe \"{}\" lies {} outside the matter; move it onto the part", probe.name,
                                 human_length(home.distance)));
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
  if (!selected.polygons.empty() && !selected.elements.empty())
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
      total += 1;
      points.where += problem.body.rest[e];
      weights[e] += 1;
    }
  if (!(total > 0))
    throw InputError(probe.origin, fmt::format("probe \"{}\": no matter lies under its surface", probe.name));
  points.where /= total;
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
  if (probe.is_to_come()) result.displacement.setConstant(std::numeric_limits<double>::quiet_NaN());
  for (const auto& [element, weight] : probe.weights)
    result.displacement += weight * state.displacement[element];
  return result;
}

}  // namespace flexel::simulate
