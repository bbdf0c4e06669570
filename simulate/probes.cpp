// A probe at a point is carried by the cell whose voxel is nearest, with trilinear weights; a probe of a
// selection is the mean over its surface points by area, or over its elements.
#include "simulate/probes.h"

#include <fmt/format.h>

#include <map>

#include "formats/error.h"
#include "formats/units.h"
#include "simulate/surface_points.h"

namespace flexel {
namespace {

// Distance [m] of a point from a cell's voxel.
double distance_from_cell(const Body& body, const Lattice& lattice, std::uint32_t cell, const Vec3& point) {
  const Index3& at = body.lattice_index[body.cell_elements[cell][0]];
  const Vec3 low(at[0], at[1], at[2]);
  const Vec3 inside = lattice.to_lattice(point) - low;
  const Vec3 outside = (-inside).cwiseMax(inside - Vec3::Ones()).cwiseMax(0.0);
  return outside.cwiseProduct(lattice.spacing).norm();
}

ProbePoints place_point(const Probe& probe, const Body& body, const std::vector<std::uint8_t>& stray_cell) {
  double least = 1e300, spacing = 0;
  std::uint32_t nearest = 0;
  for (const Part& part : body.parts)
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
      const double distance = distance_from_cell(body, part.lattice, c, *probe.at);
      if (distance >= least || stray_cell[c]) continue;
      least = distance;
      nearest = c;
      spacing = part.lattice.spacing.maxCoeff();
    }
  if (!(least <= spacing))
    throw InputError(probe.origin,
                     fmt::format("probe \"{}\" lies {} outside the matter; move it onto the part", probe.name,
                                 human_length(least)));
  const CellPoint at = cell_point(body, nearest, *probe.at);
  ProbePoints points{probe.name, *probe.at, {}};
  for (std::size_t a = 0; a < 8; ++a)
    points.weights.emplace_back(body.cell_elements[nearest][a], at.weights[a]);
  return points;
}

ProbePoints place_selection(const Probe& probe, const Body& body,
                            const std::vector<std::uint8_t>& stray_cell) {
  const Selected selected = resolve(*probe.where, body);
  std::map<std::uint32_t, double> weights;
  double total = 0;
  ProbePoints points{probe.name, Vec3::Zero(), {}};
  for (const SurfacePoint& point : surface_points(body, selected.polygons, stray_cell)) {
    const double area = point.area_vector.norm();
    total += area;
    points.where += area * point.position;
    for (std::size_t a = 0; a < 8; ++a)
      weights[body.cell_elements[point.at.cell][a]] += area * point.at.weights[a];
  }
  if (total == 0)  // elements only
    for (const std::uint32_t e : selected.elements) {
      total += 1;
      points.where += body.rest[e];
      weights[e] += 1;
    }
  if (!(total > 0))
    throw InputError(probe.origin, fmt::format("probe \"{}\": no cell lies under its surface", probe.name));
  points.where /= total;
  for (const auto& [element, weight] : weights) points.weights.emplace_back(element, weight / total);
  return points;
}

}  // namespace

std::vector<ProbePoints> place_probes(const Scene& scene, const Body& body,
                                      const std::vector<std::uint8_t>& stray_cell) {
  std::vector<ProbePoints> placed;
  for (const Probe& probe : scene.probes)
    placed.push_back(probe.at ? place_point(probe, body, stray_cell)
                              : place_selection(probe, body, stray_cell));
  return placed;
}

ProbeResult measure(const ProbePoints& probe, const State& state) {
  ProbeResult result{probe.name, probe.where, Vec3::Zero()};
  for (const auto& [element, weight] : probe.weights)
    result.displacement += weight * state.displacement[element];
  return result;
}

}  // namespace flexel
