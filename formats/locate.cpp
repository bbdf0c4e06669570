// From a surface point to the cell under it. The cells that a polygon bounds are ascending and cells are
// sorted by (k, j, i), so the voxel that holds the point is found by bisection; next the voxels around it
// are tried, nearest first. A voxel beyond those is at least one spacing away, so only a point without a cell
// that close needs the scan over all cells of the polygon.
#include "formats/locate.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>

namespace flexel {
namespace {

using Voxel = Eigen::Matrix<std::int64_t, 3, 1>;

const Index3& lowest_corner(const Body& body, std::uint32_t cell) {
  return body.lattice_index[body.cell_elements[cell][0]];
}

const Part& part_of_cell(const Body& body, std::uint32_t cell) {
  const auto after = std::upper_bound(body.parts.begin(), body.parts.end(), cell,
                                      [](std::uint32_t c, const Part& part) { return c < part.cell_end; });
  return *after;
}

// Squared distance [m^2] from a point, in lattice coordinates, to a voxel.
double squared_distance(const Vec3& at, const Voxel& voxel, const Vec3& spacing) {
  const Vec3 low = voxel.cast<double>();
  const Vec3 outside = (low - at).cwiseMax(at - low - Vec3::Ones()).cwiseMax(0.0);
  return outside.cwiseProduct(spacing).squaredNorm();
}

Voxel voxel_of(const Index3& index) {
  return {index[0], index[1], index[2]};
}

// The first of `cells` (ascending) at `voxel`, or nothing.
std::optional<std::uint32_t> cell_at(const Body& body, std::span<const std::uint32_t> cells,
                                     const Voxel& voxel) {
  const auto key = [](const Voxel& v) { return std::tuple(v[2], v[1], v[0]); };
  const auto found =
      std::lower_bound(cells.begin(), cells.end(), voxel, [&](std::uint32_t cell, const Voxel& wanted) {
        return key(voxel_of(lowest_corner(body, cell))) < key(wanted);
      });
  if (found == cells.end() || voxel_of(lowest_corner(body, *found)) != voxel) return std::nullopt;
  return *found;
}

struct Candidate {
  double squared_distance;
  int place;
  Voxel voxel;
};

// The 27 voxels about `at`, nearest first; equal distances in the order (k, j, i).
std::array<Candidate, 27> voxels_around(const Vec3& at, const Vec3& spacing) {
  const Voxel home = at.array().floor().matrix().cast<std::int64_t>();
  std::array<Candidate, 27> result;
  for (int n = 0; n < 27; ++n) {
    const Voxel voxel = home + Voxel(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    result[n] = {squared_distance(at, voxel, spacing), n, voxel};
  }
  std::sort(result.begin(), result.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(a.squared_distance, a.place) < std::tie(b.squared_distance, b.place);
  });
  return result;
}

std::uint32_t nearest_cell(const Body& body, std::span<const std::uint32_t> cells, const Vec3& at,
                           const Vec3& spacing) {
  // Mostly the point lies in one of the first voxels looked at, or on its face.
  const Voxel home = at.array().floor().matrix().cast<std::int64_t>();
  const auto on_face = [&](Eigen::Index axis) { return at[axis] == static_cast<double>(home[axis]); };
  for (int k = on_face(2) ? -1 : 0; k <= 0; ++k)
    for (int j = on_face(1) ? -1 : 0; j <= 0; ++j)
      for (int i = on_face(0) ? -1 : 0; i <= 0; ++i)
        if (const auto cell = cell_at(body, cells, home + Voxel(i, j, k))) return *cell;
  const double one_spacing = spacing.minCoeff();
  for (const Candidate& candidate : voxels_around(at, spacing)) {
    if (candidate.squared_distance > one_spacing * one_spacing) break;
    if (const auto cell = cell_at(body, cells, candidate.voxel)) return *cell;
  }
  return *std::min_element(cells.begin(), cells.end(), [&](std::uint32_t a, std::uint32_t b) {
    return squared_distance(at, voxel_of(lowest_corner(body, a)), spacing) <
           squared_distance(at, voxel_of(lowest_corner(body, b)), spacing);
  });
}

}  // namespace

CellPoint cell_point(const Body& body, std::uint32_t cell, const Vec3& point) {
  const Lattice& lattice = part_of_cell(body, cell).lattice;
  const Vec3 inside = lattice.to_lattice(point) - voxel_of(lowest_corner(body, cell)).cast<double>();
  CellPoint result;
  result.cell = cell;
  for (int a = 0; a < 8; ++a) {
    const double x = (a & 1) != 0 ? inside.x() : 1 - inside.x();
    const double y = (a & 2) != 0 ? inside.y() : 1 - inside.y();
    const double z = (a & 4) != 0 ? inside.z() : 1 - inside.z();
    result.weights[a] = x * y * z;
  }
  return result;
}

std::optional<CellPoint> locate_on_surface(const Body& body, std::size_t polygon, const Vec3& point) {
  if (polygon + 1 >= body.surface_cell_offsets.size()) return std::nullopt;
  const std::uint32_t begin = body.surface_cell_offsets[polygon],
                      end = body.surface_cell_offsets[polygon + 1];
  if (begin == end) return std::nullopt;
  const std::span<const std::uint32_t> cells(body.surface_cells.data() + begin, end - begin);
  const Lattice& lattice = part_of_cell(body, cells.front()).lattice;
  return cell_point(body, nearest_cell(body, cells, lattice.to_lattice(point), lattice.spacing), point);
}

Vec3 interpolate(const CellPoint& at, const Body& body, const std::vector<Vec3>& element_values) {
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a < 8; ++a) sum += at.weights[a] * element_values[body.cell_elements[at.cell][a]];
  return sum;
}

}  // namespace flexel
