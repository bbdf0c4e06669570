// Largest values are found in parallel by chunks that keep the first of equal ones.
#include "formats/lattice/fields.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "formats/lattice/cell_moments.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/lattice/quadratic_field.h"

namespace flexel {
namespace {

constexpr double kNoStrain = std::numeric_limits<double>::quiet_NaN();

struct FirstLargest {
  double squared = -1;
  LargestDisplacement found;
  FirstLargest& operator+=(const FirstLargest& other) {
    if (other.squared > squared) *this = other;
    return *this;
  }
};

FirstLargest moved(const Vec3& displacement, const Vec3& at, std::uint32_t polygon = kNoPolygonAround) {
  return {displacement.squaredNorm(), {displacement, at, polygon}};
}

std::vector<Vec3> own_displacement(const Body& body) {
  std::vector<Vec3> displacement(body.element_count());
  parallel_for_each(displacement.size(),
                    [&](std::size_t e) { displacement[e] = body.position[e] - body.rest[e]; });
  return displacement;
}

// Moves points of the surface by the cells under them. Keeps references.
class SurfaceMotion {
 public:
  SurfaceMotion(const Body& body, const std::vector<Vec3>& displacement)
      : body_(body), displacement_(displacement) {
    if (QuadraticField::is_in(body)) field_.emplace(body, displacement);
  }

  [[nodiscard]] Vec3 operator()(std::uint32_t polygon, const CellPoint& cell, const Vec3& at) const {
    if (!field_) return interpolate(cell, body_, displacement_);
    const Part& part = body_.parts[body_.surface.polygon_part(polygon)];
    return field_->displacement(cell.cell, cell_coordinates(body_, part, cell.cell, at));
  }
  [[nodiscard]] std::optional<Vec3> operator()(std::uint32_t polygon, const Vec3& at) const {
    const std::optional<CellPoint> cell = locate_on_surface(body_, polygon, at);
    if (!cell) return std::nullopt;
    return (*this)(polygon, *cell, at);
  }
  // m^2: no point in the cell moves further.
  [[nodiscard]] double most_squared(std::uint32_t cell) const {
    // The largest sum of the absolute values of the 27 shape functions is 1.25 along each axis (Lebesgue's constant).
    constexpr double kLebesgue = 1.25 * 1.25 * 1.25;
    double most = 0;
    if (field_) {
      for (const Vec3& node : field_->nodes(cell)) most = std::max(most, node.squaredNorm());
      return kLebesgue * kLebesgue * most;
    }
    for (const std::uint32_t e : body_.cell_elements[cell])
      most = std::max(most, displacement_[e].squaredNorm());
    return most;
  }

 private:
  const Body& body_;
  const std::vector<Vec3>& displacement_;
  std::optional<QuadraticField> field_;
};

// The points of a triangle's edges and, where it lies over it, of its plane that are nearest to `to`.
struct NearestPoints {
  std::array<Vec3, 4> at;
  std::size_t count = 3;
};

NearestPoints nearest_points(const std::array<Vec3, 3>& corners, const Vec3& to) {
  NearestPoints found;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &from = corners[i], edge = corners[(i + 1) % 3] - from;
    const double squared = edge.squaredNorm();
    const double share = squared > 0 ? std::clamp((to - from).dot(edge) / squared, 0.0, 1.0) : 0;
    found.at[i] = from + share * edge;
  }
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  if (!(normal.squaredNorm() > 0)) return found;
  const Vec3 foot = to - (to - corners[0]).dot(normal) / normal.squaredNorm() * normal;
  for (std::size_t i = 0; i < 3; ++i)
    if ((corners[(i + 1) % 3] - corners[i]).cross(foot - corners[i]).dot(normal) < 0) return found;
  found.at[found.count++] = foot;
  return found;
}

// Of one triangle, between its corners, in cells where something may move further than `known` [m^2]. Points outside a cell
// are its neighbours'.
FirstLargest largest_between_corners(const Body& body, const SurfaceMotion& motion, std::uint32_t polygon,
                                     const std::array<Vec3, 3>& corners, double known) {
  constexpr double kRounding = 1e-9;  // of a cell
  const Part& part = body.parts[body.surface.polygon_part(polygon)];
  FirstLargest largest;
  for (std::uint32_t c = body.surface_cell_offsets[polygon]; c < body.surface_cell_offsets[polygon + 1];
       ++c) {
    const std::uint32_t cell = body.surface_cells[c];
    if (motion.most_squared(cell) <= known) continue;
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t e : body.cell_elements[cell]) middle += 0.125 * body.rest[e];
    const NearestPoints points = nearest_points(corners, middle);
    for (std::size_t i = 0; i < points.count; ++i) {
      const Vec3 inside = cell_coordinates(body, part, cell, points.at[i]);
      if (inside.minCoeff() < -kRounding || inside.maxCoeff() > 1 + kRounding) continue;
      largest +=
          moved(motion(polygon, cell_point(body, cell, points.at[i]), points.at[i]), points.at[i], polygon);
    }
  }
  return largest;
}

// The voxels that carving took: part, i, j, k; ascending.
using CarvedVoxels = std::vector<std::array<std::int64_t, 4>>;

CarvedVoxels carved_voxels(const Body& body) {
  CarvedVoxels voxels;
  const auto note = body.notes.find(kCarvedNote);
  if (note == body.notes.end()) return voxels;
  std::istringstream text(note->second);
  for (std::array<std::int64_t, 4> at; text >> at[0] >> at[1] >> at[2] >> at[3];) voxels.push_back(at);
  std::sort(voxels.begin(), voxels.end());
  return voxels;
}

// Whether the matter at a point of the surface is left, which its polygon may reach past: no voxel that carving took
// lies between it and the polygon's nearest cell. Others that are no cells hold slivers of matter, too little for one.
bool is_left(const Body& body, const CarvedVoxels& carved, std::uint32_t polygon, std::uint32_t cell,
             const Vec3& point) {
  constexpr double kRounding = 1e-6;  // of a cell
  if (carved.empty()) return true;
  const std::uint32_t part = body.surface.polygon_part(polygon);
  const Index3& corner = body.lattice_index[body.cell_elements[cell][0]];
  const Vec3 to = cell_coordinates(body, body.parts[part], cell, point),
             from = to.cwiseMax(0.0).cwiseMin(1.0);
  const double steps = std::ceil(2 * (to - from).cwiseAbs().maxCoeff());
  for (double step = 1; step <= steps; ++step) {
    const Vec3 at = from + step / steps * (to - from);
    const Vec3 away = (at.array() - 1 - kRounding).ceil().max(0) + (at.array() + kRounding).floor().min(0);
    if (away.isZero(0)) continue;  // the cell's own voxel may have lost another piece
    const std::array<std::int64_t, 4> voxel{part, corner[0] + static_cast<std::int64_t>(away.x()),
                                            corner[1] + static_cast<std::int64_t>(away.y()),
                                            corner[2] + static_cast<std::int64_t>(away.z())};
    if (std::binary_search(carved.begin(), carved.end(), voxel)) return false;
  }
  return true;
}

FirstLargest largest_of_surface(const Body& body, const std::vector<Vec3>& displacement,
                                const SurfacePiece* piece) {
  constexpr double kMore = 1e-9;  // than rounding
  const SurfaceMotion motion(body, displacement);
  const std::vector<std::uint32_t> around =
      piece ? polygons_around_vertices(body.surface, piece->with_cells) : polygons_around_vertices(body);
  const CarvedVoxels carved = carved_voxels(body);
  FirstLargest largest = parallel_sum<FirstLargest>(around.size(), [&](std::size_t v) {
    if (around[v] == kNoPolygonAround || (piece && !piece->vertices[v])) return FirstLargest{};
    const Vec3& vertex = body.surface.vertices[v];
    const std::optional<CellPoint> cell = locate_on_surface(body, around[v], vertex);
    if (!cell || !is_left(body, carved, around[v], cell->cell, vertex)) return FirstLargest{};
    return moved(motion(around[v], *cell, vertex), vertex, around[v]);
  });
  if (body.surface_cells.empty()) return largest;
  const Triangles triangles = triangulate(body.surface);
  const FirstLargest between = parallel_sum<FirstLargest>(triangles.corners.size(), [&](std::size_t t) {
    const std::uint32_t polygon = triangles.polygon[t];
    const auto& [a, b, c] = triangles.corners[t];
    const std::vector<Vec3>& at = body.surface.vertices;
    return largest_between_corners(body, motion, polygon, {at[a], at[b], at[c]}, largest.squared);
  });
  if (between.squared > (1 + kMore) * largest.squared) largest = between;
  return largest;
}

Mat3 mean_gradient(const Body& body, const Part& part, std::size_t cell) {
  Mat3 gradient = Mat3::Zero();
  for (std::size_t a = 0; a < 8; ++a) {
    const Vec3 side((a & 1) != 0 ? 1 : -1, (a & 2) != 0 ? 1 : -1, (a & 4) != 0 ? 1 : -1);
    gradient +=
        body.position[body.cell_elements[cell][a]] * side.cwiseQuotient(4 * part.lattice.spacing).transpose();
  }
  return gradient;
}

Mat3 gradient_of_connections(const Body& body, const Adjacency& adjacency, std::uint32_t element) {
  Mat3 now = Mat3::Zero(), rest = Mat3::Zero();
  for (const std::uint32_t other : adjacency.of(element)) {
    const Vec3 arm = body.rest[other] - body.rest[element];
    now += (body.position[other] - body.position[element]) * arm.transpose();
    rest += arm * arm.transpose();
  }
  const double scale = rest.trace() / 3;
  if (!(rest.determinant() > 1e-6 * scale * scale * scale)) return Mat3::Constant(kNoStrain);
  return now * rest.inverse();
}

}  // namespace

std::vector<std::uint8_t> elements_in_matter(const Body& body) {
  std::vector<std::uint8_t> inside(body.element_count(), 0);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    if (body.fill[c] >= kWholeFill)
      for (const std::uint32_t e : body.cell_elements[c]) inside[e] = 1;
  for (const Part& part : body.parts)
    if (part.placement == Placement::centre)
      std::fill(inside.begin() + part.element_begin, inside.begin() + part.element_end, std::uint8_t{1});
  return inside;
}

std::vector<std::uint32_t> polygons_around_vertices(const Body& body) {
  std::vector<std::uint8_t> with_cells(body.surface.polygon_count(), 0);
  if (body.surface_cell_offsets.size() == with_cells.size() + 1)
    for (std::size_t p = 0; p < with_cells.size(); ++p)
      with_cells[p] = body.surface_cell_offsets[p + 1] > body.surface_cell_offsets[p];
  return polygons_around_vertices(body.surface, with_cells);
}

std::vector<std::uint32_t> polygons_around_vertices(const Surface& surface,
                                                    const std::vector<std::uint8_t>& with_cells) {
  std::vector<std::uint32_t> polygon(surface.vertices.size(), kNoPolygonAround);
  for (std::uint32_t p = 0; p < surface.polygon_count(); ++p)
    if (with_cells[p])
      for (const std::uint32_t v : surface.polygon(p))
        if (polygon[v] == kNoPolygonAround) polygon[v] = p;
  return polygon;
}

LargestDisplacement largest_displacement(const Body& body, const std::vector<Vec3>& displacement,
                                         const SurfacePiece* piece) {
  std::vector<std::uint8_t> inside = elements_in_matter(body);
  FirstLargest largest = largest_of_surface(body, displacement, piece);
  if (!piece && largest.squared < 0 && std::find(inside.begin(), inside.end(), 1) == inside.end())
    std::fill(inside.begin(), inside.end(), std::uint8_t{1});
  largest += parallel_sum<FirstLargest>(inside.size(), [&](std::size_t e) {
    return inside[e] != 0 ? moved(displacement[e], body.rest[e]) : FirstLargest{};
  });
  return largest.found;
}

LargestDisplacement largest_displacement(const Body& body) {
  return largest_displacement(body, own_displacement(body));
}

LargestDisplacement largest_displacement_of_surface(const Body& body) {
  return largest_of_surface(body, own_displacement(body), nullptr).found;
}

std::optional<Vec3> displacement_on_surface(const Body& body, std::uint32_t polygon, const Vec3& at) {
  const std::vector<Vec3> displacement = own_displacement(body);
  return SurfaceMotion(body, displacement)(polygon, at);
}

double equivalent_strain(const Mat3& gradient) {
  if (!gradient.allFinite() || !(gradient.determinant() > 0)) return kNoStrain;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(Mat3(gradient.transpose() * gradient),
                                                   Eigen::EigenvaluesOnly);
  if (!(solver.eigenvalues().minCoeff() > 0)) return kNoStrain;
  const Vec3 logarithms = 0.5 * solver.eigenvalues().array().log();
  return std::sqrt(2.0 / 3.0) * (logarithms.array() - logarithms.mean()).matrix().norm();
}

std::vector<double> strains(const Body& body) {
  if (body.cell_count() == 0) {
    const Adjacency adjacency = element_adjacency(body);
    std::vector<double> result(body.element_count());
    parallel_for_each(result.size(), [&](std::size_t e) {
      result[e] = equivalent_strain(gradient_of_connections(body, adjacency, static_cast<std::uint32_t>(e)));
    });
    return result;
  }
  std::vector<double> result(body.cell_count(), kNoStrain);
  for (const Part& part : body.parts)
    parallel_for_each(part.cell_end - part.cell_begin, [&](std::size_t i) {
      result[part.cell_begin + i] = equivalent_strain(mean_gradient(body, part, part.cell_begin + i));
    });
  return result;
}

double largest_strain(const Body& body) {
  const std::vector<double> all = strains(body);
  double largest = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool broken = body.cell_count() > 0 && !body.broken.empty() && body.broken[i] != 0;
    if (!broken && all[i] > largest) largest = all[i];
  }
  return largest;
}

}  // namespace flexel
