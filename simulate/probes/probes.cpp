// A probe at a point is carried by the cell whose voxel is nearest, with trilinear weights, or by the nearest
// element and its gradient (centre placement); a probe of a selection is the mean over its surface points by
// area, or over its elements.
#include "simulate/probes/probes.h"

#include <fmt/format.h>

#include <limits>

#include "base/error.h"
#include "base/units.h"
#include "simulate/matter/surface_points.h"
#include "simulate/scene/coming_parts.h"

namespace flexel::simulate {
namespace {

// Distance [m] of a point from the voxel at a lattice index.
double distance_from_voxel(const Lattice& lattice, const Index3& at, const Vec3& point) {
  const Vec3 inside = lattice.to_lattice(point) - Vec3(at[0], at[1], at[2]);
  const Vec3 outside = (-inside).cwiseMax(inside - Vec3::Ones()).cwiseMax(0.0);
  return outside.cwiseProduct(lattice.spacing).norm();
}

const Index3& lowest_corner(const Body& body, std::uint32_t cell) {
  return body.lattice_index[body.cell_elements[cell][0]];
}

void add(const InterpolationWeights& carrier, std::vector<std::pair<std::uint32_t, double>>& weights) {
  for (std::uint32_t a = 0; a < carrier.count; ++a)
    weights.emplace_back(carrier.elements[a], carrier.weights[a]);
}

// The voxel nearest to a probe.
struct Found {
  double distance = 1e300;  // m, from the voxel that is nearest
  double spacing = 0;       // m, of its part
  std::uint32_t part = 0;
  std::uint32_t cell = 0;  // of a corner-placed part
};

ProbePoints place_point(const Probe& probe, const Problem& problem) {
  const Body& body = problem.body;
  Found found;
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const double spacing = part.lattice.spacing.maxCoeff();
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
      const double distance = distance_from_voxel(part.lattice, lowest_corner(body, c), *probe.at);
      if (distance < found.distance && !(c < problem.stray_cell.size() && problem.stray_cell[c]))
        found = {distance, spacing, p, c};
    }
    if (part.placement == Placement::corner) continue;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
      const double distance = distance_from_voxel(part.lattice, body.lattice_index[e], *probe.at);
      if (distance < found.distance && !(e < problem.stray_element.size() && problem.stray_element[e]))
        found = {distance, spacing, p, 0};
    }
  }
  if (!(found.distance <= found.spacing))
    throw InputError(probe.origin,
                     fmt::format("probe \"{}\" lies {} outside the matter; move it onto the part", probe.name,
                                 human_length(found.distance)));
  ProbePoints points{probe.name, *probe.at, {}};
  if (body.parts[found.part].placement == Placement::corner) {
    add(cell_carrier(body, cell_point(body, found.cell, *probe.at)), points.weights);
    points.cell = found.cell;
  } else {
    // Within a spacing of a voxel there is an element within two.
    const auto element = nearest_element(problem, found.part, *probe.at, Vec3::Zero());
    add(with_gradient(problem, {{*element}, {1}, 1}, *probe.at), points.weights);
  }
  return points;
}

ProbePoints place_selection(const Probe& probe, const Problem& problem) {
  const Selected selected = resolve(*probe.where, problem.body);
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
  if (total == 0)  // elements only
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
  for (const Probe& probe :
       scene.coming_parts.empty() ? scene.probes : without_coming_probes(scene, problem.body))
    placed.push_back(probe.at      ? place_point(probe, problem)
                     : probe.where ? place_selection(probe, problem)
                                   : ProbePoints{probe.name});
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
