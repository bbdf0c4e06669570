// The axes come from align_axes.cpp. Along each axis, the flat faces orthogonal to it are planes with an
// area, and n cells lie between the outermost large planes. Of the n whose spacing is within 15 % of the
// requested one, the n that puts most area on lattice planes is chosen, with a slight preference for the
// requested spacing.
#include "voxelize/lattice/align.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/parallel.h"

namespace flexel::voxelize {
namespace {

constexpr double kLargestAdjustment = .15;
constexpr double kDominant = .05;  // of the largest plane's area: smaller ones do not define the extent

// Share of the area that lies on lattice planes; near ones count a little, so that the score has a slope.
double plane_score(const std::vector<FacePlane>& planes, double spacing, double plane) {
  constexpr double kOn = 1e-6, kNear = .05;  // in cells
  double on = 0, total = 0;
  for (const FacePlane& face : planes) {
    const double cells = (face.offset - plane) / spacing, distance = std::abs(cells - std::round(cells));
    on += face.area * (distance <= kOn ? 1 : .3 * std::exp(-distance * distance / (kNear * kNear)));
    total += face.area;
  }
  return on / total;
}

AxisFit fit_shift(const std::vector<FacePlane>& planes, double size) {
  AxisFit best{size, planes.front().offset};
  double highest = -1;
  for (const FacePlane& face : planes)
    if (const double score = plane_score(planes, size, face.offset); score > highest + 1e-12) {
      highest = score;
      best.plane = face.offset;
    }
  return best;
}

Lattice snapped(const PartMesh& mesh, double size, bool cubic) {
  Lattice lattice{Vec3::Zero(), dominant_axes(mesh), Vec3::Constant(size)};
  Box box;
  for (const Vec3& vertex : mesh.world) box.add(lattice.axes.transpose() * vertex);
  Vec3 corner = box.min;
  for (int a = 0; a < 3; ++a) {
    const std::vector<FacePlane> planes = face_planes(mesh, lattice.axes.col(a), 1e-5 * size);
    if (planes.empty()) continue;
    const AxisFit fit = fit_axis(planes, size, cubic);
    lattice.spacing[a] = fit.spacing;
    // Whole cells below the plane, so that indices start near 0.
    corner[a] =
        fit.plane -
        fit.spacing * std::max(0., std::ceil((fit.plane - box.min[a]) / fit.spacing - kSnapTolerance));
  }
  lattice.origin = lattice.axes * corner;
  return lattice;
}

// The plane of a triangle that lies across `axis`; none where it has no area.
std::optional<FacePlane> flat_across(const PartMesh& mesh, const Corners& c, const Vec3& axis,
                                     double tolerance) {
  constexpr double kSine = 1.75e-3;  // of 0.1 degree
  const Vec3& a = mesh.world[c[0]];
  const Vec3 normal = (mesh.world[c[1]] - a).cross(mesh.world[c[2]] - a) / 2;
  if (!(normal.squaredNorm() > 0) || normal.cross(axis).squaredNorm() > kSine * kSine * normal.squaredNorm())
    return {};
  const double u = axis.dot(a), v = axis.dot(mesh.world[c[1]]), w = axis.dot(mesh.world[c[2]]);
  if (std::max({u, v, w}) - std::min({u, v, w}) > tolerance) return {};
  return FacePlane{(u + v + w) / 3, normal.norm()};
}

}  // namespace

std::vector<FacePlane> face_planes(const PartMesh& mesh, const Vec3& axis, double tolerance) {
  constexpr std::size_t kGrain = 1 << 14;
  std::vector<std::vector<FacePlane>> of_chunk((mesh.corners.size() + kGrain - 1) / kGrain);
  parallel_chunks(mesh.corners.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      if (const auto face = flat_across(mesh, mesh.corners[t], axis, tolerance))
        of_chunk[begin / kGrain].push_back(*face);
  });
  std::vector<FacePlane> faces;
  for (const auto& part : of_chunk) faces.insert(faces.end(), part.begin(), part.end());
  std::sort(faces.begin(), faces.end(),
            [](const FacePlane& a, const FacePlane& b) { return a.offset < b.offset; });
  std::vector<FacePlane> planes;
  for (const FacePlane& face : faces) {
    if (planes.empty() || face.offset - planes.back().offset > tolerance) {
      planes.push_back(face);
      continue;
    }
    FacePlane& plane = planes.back();
    // The mean keeps exactly equal offsets exactly.
    plane.offset += (face.offset - plane.offset) * (face.area / (plane.area + face.area));
    plane.area += face.area;
  }
  return planes;
}

AxisFit fit_axis(const std::vector<FacePlane>& planes, double size, bool fixed) {
  double largest = 0;
  for (const FacePlane& face : planes) largest = std::max(largest, face.area);
  std::vector<FacePlane> dominant;
  std::copy_if(planes.begin(), planes.end(), std::back_inserter(dominant),
               [&](const FacePlane& face) { return face.area >= kDominant * largest; });
  const double low = dominant.front().offset, extent = dominant.back().offset - low;
  AxisFit best = fit_shift(dominant, size);
  if (fixed) return best;
  double highest = -1;
  const auto first = static_cast<long>(std::max(1., std::ceil(extent / ((1 + kLargestAdjustment) * size))));
  const auto last = static_cast<long>(std::floor(extent / ((1 - kLargestAdjustment) * size)));
  for (long n = first; n <= last; ++n) {
    const double spacing = extent / static_cast<double>(n);
    const double score = plane_score(planes, spacing, low) - .05 * std::abs(spacing / size - 1);
    if (score > highest) {
      highest = score;
      best = {spacing, low};
    }
  }
  return best;
}

Lattice align_lattice(const PartMesh& mesh, double size, Align align, bool cubic) {
  if (align == Align::snap) return snapped(mesh, size, cubic);
  const Box box = bounding_box(mesh.world);
  Lattice lattice{box.min, Mat3::Identity(), Vec3::Constant(size)};
  if (align == Align::none || cubic) return lattice;
  for (int a = 0; a < 3; ++a)
    if (box.size()[a] > 0)
      lattice.spacing[a] = box.size()[a] / std::max(1., std::round(box.size()[a] / size));
  return lattice;
}

}  // namespace flexel::voxelize
