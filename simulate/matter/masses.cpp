// Tetrahedra from a point to the triangles of a closed surface: integrals of 1, x and x x^T are sums over them
// (Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", 2004).
#include "simulate/matter/masses.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/math/small_matrices.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/part/topology.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr double kSameVolume = 0.02;   // share by which surface and cells may differ
constexpr double kLeastFactor = 0.05;  // on an element's mass

// Integrals over matter, from a point near it.
struct Integrals {
  double mass = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  void add(double more, const Vec3& at) {
    mass += more;
    first += more * at;
    second += more * at * at.transpose();
  }
  // About the centre; `mass_now` [kg] in place of their own measure.
  [[nodiscard]] MassMoments about_centre(const Vec3& origin, double mass_now) const {
    const Vec3 away = first / mass;
    return {mass_now, origin + away, mass_now * (second / mass - away * away.transpose())};
  }
};

Integrals integrals_of_cells(const Problem& problem, std::uint32_t p, const Vec3& origin) {
  const Part& part = problem.body.parts[p];
  const Mat3 even = part.lattice.axes * (part.lattice.spacing.cwiseAbs2() / 12).asDiagonal() *
                    part.lattice.axes.transpose();
  const double whole = problem.materials[p].density * part.lattice.spacing.prod();
  Integrals sum;
  const auto add = [&](double mass, const Vec3& at) {
    sum.add(mass, at);
    sum.second += mass * even;
  };
  const std::vector<double> share = mass_shares(problem.body), factor = mass_factors(problem.body);
  if (part.placement == Placement::centre)
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      add(factor.empty() ? whole : factor[e] * whole, problem.body.rest[e] - origin);
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t e : problem.body.cell_elements[c]) middle += (problem.body.rest[e] - origin) / 8;
    add(share[c] * whole, middle);
  }
  return sum;
}

// Whether the matter of a part is evenly what its surface encloses, as far as edits and events tell.
bool is_as_voxelized(const Body& body, const Part& part) {
  if (body.notes.contains(kCarvedNote)) return false;
  const auto change = body.cell_columns.find("density_change");
  if (change == body.cell_columns.end()) return true;
  const auto from = change->second.values.begin() + static_cast<std::ptrdiff_t>(part.cell_begin);
  const auto to = change->second.values.begin() + static_cast<std::ptrdiff_t>(part.cell_end);
  return std::all_of(from, to, [](double value) { return value == 0; });
}

// Measured in m^3, of closed surfaces.
Integrals integrals_within(const Surface& surface, const std::vector<std::array<std::uint32_t, 3>>& corners,
                           const Vec3& origin) {
  Integrals sum;
  for (const auto& triangle : corners) {
    std::array<Vec3, 3> to;
    for (std::size_t c = 0; c < 3; ++c) to[c] = surface.vertices[triangle[c]] - origin;
    const double volume = to[0].dot(to[1].cross(to[2])) / 6;
    const Vec3 all = to[0] + to[1] + to[2];
    sum.mass += volume;
    sum.first += volume / 4 * all;
    sum.second += volume / 20 * all * all.transpose();
    for (const Vec3& each : to) sum.second += volume / 20 * each * each.transpose();
  }
  return sum;
}

bool is_rigid(const Problem& problem, std::size_t part) {
  return part < problem.rigidity.size() && problem.rigidity[part] != Rigidity::none;
}

// Moves the centre of the masses of a part's elements to `centre`.
void move_centre(const Body& body, const Part& part, const Vec3& centre, std::vector<double>& mass) {
  Integrals sum;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    sum.add(mass[e], body.rest[e] - centre);
  if (!(sum.mass > 0)) return;
  const MassMoments now = sum.about_centre(centre, sum.mass);
  const Vec3 slope = -sum.mass * (inverse_on_range(now.second).first * (now.centre - centre));
  double least = 0;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    least = std::min(least, slope.dot(body.rest[e] - now.centre));
  const double share = least < kLeastFactor - 1 ? (kLeastFactor - 1) / least : 1;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    mass[e] *= 1 + share * slope.dot(body.rest[e] - now.centre);
}

}  // namespace

std::vector<double> lumped_masses(const Problem& problem) {
  const Body& body = problem.body;
  std::vector<double> mass(body.element_count(), 0);
  const std::vector<double> share = mass_shares(body), factor = mass_factors(body);
  const std::vector<MassMoments> rigid = rigid_moments(problem);
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const double whole = problem.materials[p].density * part.lattice.spacing.prod();
    if (part.placement == Placement::centre)
      for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
        mass[e] = factor.empty() ? whole : factor[e] * whole;
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      for (const std::uint32_t e : body.cell_elements[c]) mass[e] += share[c] * whole / 8;
    if (is_rigid(problem, p)) move_centre(body, part, rigid[p].centre, mass);
  }
  return mass;
}

std::vector<MassMoments> rigid_moments(const Problem& problem) {
  const Body& body = problem.body;
  std::vector<MassMoments> moments(body.parts.size());
  std::vector<std::vector<std::array<std::uint32_t, 3>>> corners(body.parts.size());
  std::vector<std::uint32_t> welded;
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    if (!is_rigid(problem, p) || part.element_begin == part.element_end) continue;
    const Vec3 origin = body.rest[part.element_begin];
    const Integrals cells = integrals_of_cells(problem, p, origin);
    moments[p] = cells.about_centre(origin, cells.mass);
    if (part.placement != Placement::corner || !is_as_voxelized(body, part)) continue;
    if (welded.empty()) {
      welded = weld(body.surface.vertices);
      const Triangles triangles = triangulate(body.surface);
      for (std::size_t t = 0; t < triangles.corners.size(); ++t)
        corners[body.surface.polygon_part(triangles.polygon[t])].push_back(triangles.corners[t]);
    }
    const Topology shape = topology(corners[p], welded);
    if (corners[p].empty() || !shape.closed() || !shape.oriented()) continue;
    const Integrals within = integrals_within(body.surface, corners[p], origin);
    if (std::abs(problem.materials[p].density * within.mass - cells.mass) < kSameVolume * cells.mass)
      moments[p] = within.about_centre(origin, cells.mass);
  }
  return moments;
}

}  // namespace flexel::simulate
