// A probe at a point is carried by the cell whose voxel is nearest, with trilinear weights, or by the nearest
// element and its gradient (centre placement); a probe of a selection is the mean over its surface points by
// area, or over its elements. Where voxels of several pieces of matter or parts hold the
// point, as of two walls nearer to each other than a cell, it is of the one that the surface nearest to it bounds: the way
// to any other's crosses its own.
#include "simulate/probes/probes.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
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

// The voxel nearest to a probe.
struct Found {
  double distance = 1e300;  // m, from the voxel that is nearest
  double spacing = 0;       // m, of its part
  std::uint32_t part = 0;
  std::uint32_t cell = 0;  // of a corner-placed part
};

bool is_stray(const Problem& problem, std::uint32_t cell) {
  return cell < problem.stray_cell.size() && problem.stray_cell[cell];
}

// Cells whose voxels are as near to the point as the nearest.
std::vector<std::uint32_t> nearest_cells(const Problem& problem, const Found& found, const Vec3& point) {
  std::vector<std::uint32_t> cells;
  for (const Part& part : problem.body.parts)
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      if (!is_stray(problem, c) && distance_from_voxel(part.lattice, lowest_corner(problem.body, c), point) <=
                                       found.distance + kSame * found.spacing)
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

// The polygon nearest to the point of those that count; of polygons that touch there one on whose inner side it is.
template <class Counts>
std::optional<std::uint32_t> nearest_polygon(const Surface& surface, const Triangles& triangles,
                                             double spacing, const Vec3& point, const Counts& counts) {
  double least = std::numeric_limits<double>::infinity();
  std::optional<std::uint32_t> nearest;
  for (std::size_t t = 0; t < triangles.polygon.size(); ++t) {
    if (!counts(triangles.polygon[t])) continue;
    const auto at = [&](std::size_t corner) { return surface.vertices[triangles.corners[t][corner]]; };
    const Vec3 away = point - nearest_of_triangle(point, at(0), at(1), at(2));
    const bool outside = away.dot((at(1) - at(0)).cross(at(2) - at(0))) > 0;
    const double distance = away.norm() + (outside ? kSame * spacing : 0);
    if (!(distance < least)) continue;
    least = distance;
    nearest = triangles.polygon[t];
  }
  return nearest;
}

// Of these cells the one whose matter the point is of.
std::uint32_t cell_of_matter(const Body& body, std::vector<std::uint32_t> cells, double spacing,
                             const Vec3& point) {
  const Triangles triangles = triangulate(body.surface);
  const auto cells_of = [&](std::uint32_t part) {
    std::vector<std::uint32_t> own;
    std::copy_if(cells.begin(), cells.end(), std::back_inserter(own), [&](std::uint32_t c) {
      return c >= body.parts[part].cell_begin && c < body.parts[part].cell_end;
    });
    return own;
  };
  std::vector<std::uint8_t> has(body.parts.size(), 0);
  for (std::uint32_t part = 0; part < has.size(); ++part) has[part] = !cells_of(part).empty();
  const auto polygon = nearest_polygon(body.surface, triangles, spacing, point, [&](std::uint32_t each) {
    return has[body.surface.polygon_part(each)] != 0;
  });
  if (polygon) cells = cells_of(body.surface.polygon_part(*polygon));
  if (cells.size() == 1) return cells.front();
  const std::vector<std::optional<std::uint32_t>> bounds = bounded_cells(body, cells);
  const auto bounding = nearest_polygon(body.surface, triangles, spacing, point,
                                        [&](std::uint32_t each) { return bounds[each].has_value(); });
  return bounding ? *bounds[*bounding] : cells.front();
}

ProbePoints place_point(const Probe& probe, const Problem& problem) {
  const Body& body = problem.body;
  Found found;
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const double spacing = part.lattice.spacing.maxCoeff();
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
      const double distance = distance_from_voxel(part.lattice, lowest_corner(body, c), *probe.at);
      if (distance < found.distance && !is_stray(problem, c)) found = {distance, spacing, p, c};
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
    const std::vector<std::uint32_t> cells = nearest_cells(problem, found, *probe.at);
    points.cell = cells.size() > 1 ? cell_of_matter(body, cells, found.spacing, *probe.at) : found.cell;
    add(cell_carrier(body, cell_point(body, *points.cell, *probe.at)), points.weights);
  } else {
    // Within a spacing of a voxel there is an element within two.
    const auto element = nearest_element(problem, found.part, *probe.at, Vec3::Zero());
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
