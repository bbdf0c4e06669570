// From a surface point to the cell under it. The cells that a polygon bounds are ascending and cells are
// sorted by (k, j, i), so the voxel that holds the point is found by bisection; next the voxels around it
// are tried, nearest first. A voxel beyond those is at least one spacing away, so only a point without a cell
// that close needs the scan over all cells of the polygon.
#include "formats/lattice/locate.h"

#include <algorithm>
#include <cmath>
#include <limits>
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

// The nearest of `cells` among the voxels about `home`, no further than `most` [m] from `at`; of those at
// equal distance the first in the order (k, j, i).
std::optional<std::uint32_t> nearest_around(const Body& body, std::span<const std::uint32_t> cells,
                                            const Voxel& home, const Vec3& at, const Vec3& spacing,
                                            double most) {
  std::array<std::array<double, 3>, 3> term;  // of the squared distance: axis, voxel before, at, after
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double inside = at[a] - static_cast<double>(home[a]);
    term[axis] = {inside * spacing[a], 0, (1 - inside) * spacing[a]};
    for (double& each : term[axis]) each *= each;
  }
  std::array<double, 27> squared;
  for (std::size_t n = 0; n < 27; ++n) squared[n] = term[0][n % 3] + term[1][n / 3 % 3] + term[2][n / 9];
  for (;;) {
    const auto nearest = std::min_element(squared.begin(), squared.end());
    if (*nearest > most * most) return std::nullopt;
    const auto n = nearest - squared.begin();
    if (const auto cell = cell_at(body, cells, home + Voxel(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)))
      return *cell;
    *nearest = std::numeric_limits<double>::infinity();
  }
}

// Trilinear weights in `cell` of a point in lattice coordinates.
CellPoint weights_in(const Body& body, std::uint32_t cell, const Vec3& at) {
  const Vec3 inside = at - voxel_of(lowest_corner(body, cell)).cast<double>();
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

}  // namespace

CellPoint cell_point(const Body& body, std::uint32_t cell, const Vec3& point) {
  return weights_in(body, cell, part_of_cell(body, cell).lattice.to_lattice(point));
}

SurfaceLocator::SurfaceLocator(const Body& body, std::size_t polygon) : body_(body) {
  if (polygon + 1 >= body.surface_cell_offsets.size()) return;
  const std::uint32_t begin = body.surface_cell_offsets[polygon],
                      end = body.surface_cell_offsets[polygon + 1];
  cells_ = std::span(body.surface_cells.data() + begin, end - begin);
  if (!cells_.empty()) lattice_ = &part_of_cell(body, cells_.front()).lattice;
}

// Usually the point lies in one of the first voxels tried, or on its face, and the next point in the same
// voxel.
std::uint32_t SurfaceLocator::nearest_cell(const Vec3& at) {
  const Voxel home = at.array().floor().matrix().cast<std::int64_t>();
  std::array<int, 3> first{};  // 0, or -1 on a face
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    first[axis] = at[a] == static_cast<double>(home[a]) ? -1 : 0;
  }
  if (last_ && home == last_home_ && first == last_first_) return *last_;
  for (int k = first[2]; k <= 0; ++k)
    for (int j = first[1]; j <= 0; ++j)
      for (int i = first[0]; i <= 0; ++i)
        if (const auto cell = cell_at(body_, cells_, home + Voxel(i, j, k))) {
          last_ = cell;
          last_home_ = home;
          last_first_ = first;
          return *cell;
        }
  const Vec3& spacing = lattice_->spacing;
  if (const auto cell = nearest_around(body_, cells_, home, at, spacing, spacing.minCoeff())) return *cell;
  return *std::min_element(cells_.begin(), cells_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return squared_distance(at, voxel_of(lowest_corner(body_, a)), spacing) <
           squared_distance(at, voxel_of(lowest_corner(body_, b)), spacing);
  });
}

std::optional<CellPoint> SurfaceLocator::operator()(const Vec3& point) {
  if (cells_.empty()) return std::nullopt;
  const Vec3 at = lattice_->to_lattice(point);
  return weights_in(body_, nearest_cell(at), at);
}

std::optional<CellPoint> locate_on_surface(const Body& body, std::size_t polygon, const Vec3& point) {
  return SurfaceLocator(body, polygon)(point);
}

Vec3 interpolate(const CellPoint& at, const Body& body, const std::vector<Vec3>& element_values) {
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a < 8; ++a) sum += at.weights[a] * element_values[body.cell_elements[at.cell][a]];
  return sum;
}

}  // namespace flexel
