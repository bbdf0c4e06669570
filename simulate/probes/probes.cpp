// A probe at a point is carried by the cell whose voxel is nearest, with trilinear weights, or by the nearest
// element and its gradient (centre placement); a probe of a selection is the mean over its surface points by
// area, or over its elements. Where voxels of several pieces of matter or parts hold the
// point, as of two walls nearer to each other than a cell, it is of the one that the surface nearest to it bounds: the way
// to any other's crosses its own.
#include "simulate/probes/probes.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/math/distance.h"
#include "base/units.h"
#include "simulate/matter/surface_points.h"
#include "simulate/scene/coming_parts.h"

namespace flexel::simulate {
namespace {

constexpr double kSame = 1e-6;  // spacings: distances that differ by rounding

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

bool is_stray(const std::vector<std::uint8_t>& stray, std::uint32_t which) {
  return which < stray.size() && stray[which];
}

// m, of a point from the nearest voxel of a part that a cell, or an element at its centre, is of.
double distance_from_part(const Problem& problem, const Part& part, const Vec3& point) {
  const Body& body = problem.body;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
    if (!is_stray(problem.stray_cell, c))
      least = std::min(least, distance_from_voxel(part.lattice, lowest_corner(body, c), point));
  if (part.placement == Placement::corner) return least;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    if (!is_stray(problem.stray_element, e))
      least = std::min(least, distance_from_voxel(part.lattice, body.lattice_index[e], point));
  return least;
}

// The polygon nearest to the point of those that count; of polygons that touch there one on whose inner side it is.
template <class Counts>
std::optional<std::uint32_t> nearest_polygon(const Surface& surface, double same, const Vec3& point,
                                             const Counts& counts) {
  const Triangles triangles = triangulate(surface);
  double least = std::numeric_limits<double>::infinity();
  std::optional<std::uint32_t> nearest;
  for (std::size_t t = 0; t < triangles.polygon.size(); ++t) {
    if (!counts(triangles.polygon[t])) continue;
    const auto at = [&](std::size_t corner) { return surface.vertices[triangles.corners[t][corner]]; };
    const Vec3 away = point - nearest_of_triangle(point, at(0), at(1), at(2));
    const bool outside = away.dot((at(1) - at(0)).cross(at(2) - at(0))) > 0;
    const double distance = away.norm() + (outside ? same : 0);
    if (!(distance < least)) continue;
    least = distance;
    nearest = triangles.polygon[t];
  }
  return nearest;
}

// The part whose voxels are nearest to the point; of several the one whose surface is. Throws InputError: further than a
// spacing from all.
std::uint32_t part_of_point(const Probe& probe, const Problem& problem) {
  const Body& body = problem.body;
  std::vector<double> distance;
  for (const Part& part : body.parts) distance.push_back(distance_from_part(problem, part, *probe.at));
  const auto nearest =
      static_cast<std::uint32_t>(std::min_element(distance.begin(), distance.end()) - distance.begin());
  const double spacing = body.parts[nearest].lattice.spacing.maxCoeff(), same = kSame * spacing;
  if (!(distance[nearest] <= spacing))
    throw InputError(probe.origin,
                     fmt::format("probe \"{}\" lies {} outside the matter; move it onto the part", probe.name,
                                 human_length(distance[nearest])));
  const auto as_near = [&](std::uint32_t part) { return distance[part] <= distance[nearest] + same; };
  std::size_t count = 0;
  for (std::uint32_t part = 0; part < distance.size(); ++part) count += as_near(part) ? 1 : 0;
  if (count == 1) return nearest;
  const auto polygon = nearest_polygon(body.surface, same, *probe.at, [&](std::uint32_t each) {
    return as_near(body.surface.polygon_part(each));
  });
  return polygon ? body.surface.polygon_part(*polygon) : nearest;
}

// Cells of a part whose voxels are as near to the point as the nearest.
std::vector<std::uint32_t> nearest_cells(const Problem& problem, const Part& part, const Vec3& point) {
  const double least = distance_from_part(problem, part, point) + kSame * part.lattice.spacing.maxCoeff();
  std::vector<std::uint32_t> cells;
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
    if (!is_stray(problem.stray_cell, c) &&
        distance_from_voxel(part.lattice, lowest_corner(problem.body, c), point) <= least)
      cells.push_back(c);
  return cells;
}

// (polygons) the one of these cells (ascending) that each bounds; nothing where it bounds none, or two pieces of one voxel.
std::vector<std::optional<std::uint32_t>> bounded_cells(const Body& body,
                                                        const std::vector<std::uint32_t>& cells) {
  std::vector<std::optional<std::uint32_t>> bounds(body.surface.polygon_count());
  for (std::size_t p = 0; p + 1 < body.surface_cell_offsets.size(); ++p)
    for (std::uint32_t i = body.surface_cell_offsets[p]; i < body.surface_cell_offsets[p + 1]; ++i) {
      const std::uint32_t cell = body.surface_cells[i];
      if (!std::binary_search(cells.begin(), cells.end(), cell)) continue;
      if (bounds[p] && lowest_corner(body, *bounds[p]) == lowest_corner(body, cell)) {
        bounds[p].reset();
        break;
      }
      bounds[p] = cell;
    }
  return bounds;
}

// The cell of a part whose matter the point is of.
std::uint32_t cell_of_point(const Problem& problem, const Part& part, const Vec3& point) {
  const Body& body = problem.body;
  const std::vector<std::uint32_t> cells = nearest_cells(problem, part, point);
  if (cells.size() == 1) return cells.front();
  const std::vector<std::optional<std::uint32_t>> bounds = bounded_cells(body, cells);
  const auto bounding = nearest_polygon(body.surface, kSame * part.lattice.spacing.maxCoeff(), point,
                                        [&](std::uint32_t each) { return bounds[each].has_value(); });
  return bounding ? *bounds[*bounding] : cells.front();
}

ProbePoints place_point(const Probe& probe, const Problem& problem) {
  const Body& body = problem.body;
  const std::uint32_t number = part_of_point(probe, problem);
  const Part& part = body.parts[number];
  ProbePoints points{probe.name, *probe.at, {}};
  if (part.placement == Placement::corner) {
    points.cell = cell_of_point(problem, part, *probe.at);
    add(cell_carrier(body, cell_point(body, *points.cell, *probe.at)), points.weights);
  } else {
    // Within a spacing of a voxel there is an element within two.
    const auto element = nearest_element(problem, number, *probe.at, Vec3::Zero());
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
