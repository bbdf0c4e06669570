// Where the lattice of a part lies.
#pragma once
#include "voxelize/mesh/part_mesh.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {

// A lattice of about spacing `size` [m] for the part.
// none: world axes, cubic, origin at the lowest corner of the bounding box.
// box: world axes, spacing per axis such that the bounding box is whole cells.
// snap: turned and shifted to the part's dominant flat faces, spacing per axis within 15 % of `size` such
// that the distance between the outermost of them is whole cells and as many others as possible lie on
// planes. `cubic` keeps the spacing equal along all axes (elements at voxel centres).
[[nodiscard]] Lattice align_lattice(const PartMesh& mesh, double size, Align align, bool cubic);

// Axes (columns) along the normals of the part's largest flat faces: the direction with most area, then the
// one with most area orthogonal to it (within 0.1 degree), the third at right angles. World axes are
// preferred where their faces are at least half as large, and stand in for directions with under 5 % of the
// area.
[[nodiscard]] Mat3 dominant_axes(const PartMesh& mesh);

// A plane of flat faces orthogonal to an axis.
struct FacePlane {
  double offset = 0;  // m along the axis
  double area = 0;    // m^2
};

// Planes of the flat faces (within 0.1 degree) orthogonal to `axis`, ascending; offsets within `tolerance`
// [m] are one plane.
[[nodiscard]] std::vector<FacePlane> face_planes(const PartMesh& mesh, const Vec3& axis, double tolerance);

// Spacing along an axis and a coordinate that lies on a lattice plane.
struct AxisFit {
  double spacing = 0, plane = 0;  // m
};
// See Align::snap. `planes` not empty. `fixed` keeps the spacing and chooses the shift only.
[[nodiscard]] AxisFit fit_axis(const std::vector<FacePlane>& planes, double size, bool fixed);

}  // namespace flexel::voxelize
