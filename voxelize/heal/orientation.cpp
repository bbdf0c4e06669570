// Within a shell, orientation is propagated across edges that two triangles share; the shell keeps the
// orientation of most of its area. An outermost shell must enclose a positive volume. If all outermost shells
// are inside out, the whole file is, and every shell is turned.
#include "voxelize/heal/orientation.h"
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "formats/part/topology.h"
#include "voxelize/mesh/line_crossings.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {
namespace {

using Incidence =
    std::vector<std::array<std::uint32_t, 2>>;  // (edges x 2) the triangles of edges that have two

// Triangles of every edge that has exactly two; {kNoTriangle, ...} elsewhere.
Incidence manifold_edges(const PartMesh& mesh) {
  Incidence result(mesh.edge_count, {kNoTriangle, kNoTriangle});
  std::vector<std::uint8_t> count(mesh.edge_count, 0);
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    for (const std::uint32_t edge : mesh.edges[t]) {
      if (count[edge] < 2) result[edge][count[edge]] = t;
      if (count[edge] < 3) ++count[edge];
    }
  for (std::uint32_t edge = 0; edge < mesh.edge_count; ++edge)
    if (count[edge] != 2) result[edge] = {kNoTriangle, kNoTriangle};
  return result;
}

// Whether triangle t runs along its side e from the lower to the higher vertex.
bool ascends(const PartMesh& mesh, std::uint32_t t, int e) {
  return mesh.corners[t][e] < mesh.corners[t][(e + 1) % 3];
}

bool ascends_edge(const PartMesh& mesh, std::uint32_t t, std::uint32_t edge) {
  for (int e = 0; e < 3; ++e)
    if (mesh.edges[t][e] == edge) return ascends(mesh, t, e);
  return false;
}

void turn_over(PartMesh& mesh, std::uint32_t t) {
  std::swap(mesh.corners[t][1], mesh.corners[t][2]);
  std::swap(mesh.edges[t][0], mesh.edges[t][2]);
}

std::vector<double> shell_volumes(const PartMesh& mesh) {
  std::vector<double> volume(mesh.shell_count, 0);
  if (mesh.world.empty()) return volume;
  const Vec3 base = mesh.world[0];
  for (std::size_t t = 0; t < mesh.corners.size(); ++t) {
    const Corners& c = mesh.corners[t];
    volume[mesh.shell[t]] +=
        (mesh.world[c[0]] - base).dot((mesh.world[c[1]] - base).cross(mesh.world[c[2]] - base)) / 6;
  }
  return volume;
}

// Whether a shell lies in no other one: a line from one of its points, along x, meets every other shell an
// even number of times on each side.
bool outermost(const PartMesh& mesh, std::uint32_t shell) {
  const auto t =
      static_cast<std::uint32_t>(std::find(mesh.shell.begin(), mesh.shell.end(), shell) - mesh.shell.begin());
  const Corners& c = mesh.corners[t];
  const Vec3 point = (mesh.world[c[0]] + mesh.world[c[1]] + mesh.world[c[2]]) / 3;
  std::vector<int> before(mesh.shell_count, 0);
  for (const LineCrossing& crossing : cross_lines(mesh, mesh.world, {0, point.y(), point.z(), 1, 1, 1, 1}))
    if (crossing.at < point.x()) ++before[mesh.shell[crossing.triangle]];
  before[shell] = 0;
  return std::all_of(before.begin(), before.end(), [](int count) { return count % 2 == 0; });
}

}  // namespace

FacingRegions facing_regions(const PartMesh& mesh) {
  const Incidence incidence = manifold_edges(mesh);
  FacingRegions found{std::vector<std::uint8_t>(mesh.corners.size(), 0),
                      std::vector<std::uint32_t>(mesh.corners.size(), kNoTriangle)};
  std::vector<std::uint32_t> members;
  for (std::uint32_t seed = 0; seed < mesh.corners.size(); ++seed) {
    if (found.region[seed] != kNoTriangle) continue;
    const std::uint32_t region = found.count++;
    members.assign(1, seed);
    found.region[seed] = region;
    double turned_area = 0, total_area = 0;
    for (std::size_t n = 0; n < members.size(); ++n) {
      const std::uint32_t t = members[n];
      total_area += triangle_area(mesh, t);
      if (found.turn[t]) turned_area += triangle_area(mesh, t);
      for (int e = 0; e < 3; ++e) {
        const auto& pair = incidence[mesh.edges[t][e]];
        const std::uint32_t other = pair[0] == t ? pair[1] : pair[0];
        if (pair[0] == kNoTriangle || found.region[other] != kNoTriangle) continue;
        found.region[other] = region;
        found.turn[other] =
            found.turn[t] ^
            static_cast<std::uint8_t>(ascends(mesh, t, e) == ascends_edge(mesh, other, mesh.edges[t][e]));
        members.push_back(other);
      }
    }
    if (2 * turned_area > total_area)
      for (const std::uint32_t t : members) found.turn[t] ^= 1;
  }
  return found;
}

void repair_orientation(PartMesh& mesh) {
  if (mesh.corners.empty() || mesh.open_edges > 0) return;
  if (!mesh.balanced()) {
    const std::vector<std::uint8_t> turn = facing_regions(mesh).turn;
    for (std::uint32_t t = 0; t < turn.size(); ++t)
      if (turn[t]) {
        turn_over(mesh, t);
        ++mesh.flipped_triangles;
      }
    number_edges(mesh);
    if (!mesh.balanced()) return;
  }
  const std::vector<double> volume = shell_volumes(mesh);
  std::vector<std::uint8_t> invert(mesh.shell_count, 0);
  bool all = true;
  for (std::uint32_t s = 0; s < mesh.shell_count; ++s) {
    if (volume[s] < 0)
      invert[s] = outermost(mesh, s);
    else if (all)
      all = mesh.shell_count > 1 && !outermost(mesh, s);
  }
  if (std::none_of(invert.begin(), invert.end(), [](std::uint8_t i) { return i != 0; })) return;
  if (all) invert.assign(mesh.shell_count, 1);
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    if (invert[mesh.shell[t]]) turn_over(mesh, t);
  mesh.inverted_shells = static_cast<std::size_t>(std::count(invert.begin(), invert.end(), 1));
}

}  // namespace flexel::voxelize
