// The part is cut to a box half a voxel larger first, so that what is done is in proportion to the box; voxels that the cuts pass through
// are left out.
#include "voxelize/voxelize_box.h"

#include <utility>

#include "base/error.h"
#include "voxelize/classify/classify.h"
#include "voxelize/lattice/assemble.h"
#include "voxelize/lattice/assemble_moments.h"
#include "voxelize/mesh/clip_mesh.h"

namespace flexel::voxelize {
namespace {

// Voxels, beside the box: clear of lattice planes and of what is meant to lie in the middle between two
constexpr double kClearOfPlanes = 0.531;

Vec3 as_point(const Index3& index) {
  return {static_cast<double>(index[0]), static_cast<double>(index[1]), static_cast<double>(index[2])};
}

Part part_in_box(const Surface& surface, const Lattice& lattice) {
  Part part;
  part.name = surface.parts.front().name;
  part.lattice = lattice;
  return part;
}

}  // namespace

BoxVoxelizer::BoxVoxelizer(const Surface& surface, const HealChoice& how) : surface_(surface) {
  if (surface.parts.size() != 1) throw InputError("a closer look at a place is for one part");
  mesh_ = heal(std::move(exact_part_meshes(surface).front()), how, surface.parts.front().name).mesh;
  if (!mesh_.balanced())
    throw InputError("part \"" + surface.parts.front().name +
                     "\": its surface is not closed, and exact moments need it to be");
}

Body BoxVoxelizer::operator()(const Lattice& lattice, const Index3& lower, const Index3& upper) const {
  PartMesh whole = mesh_;
  place_on_lattice(whole, lattice);
  const PartMesh mesh = clipped_to_box(whole, lattice, as_point(lower) - Vec3::Constant(kClearOfPlanes),
                                       as_point(upper) + Vec3::Constant(kClearOfPlanes));
  Voxels voxels = classify_closed(mesh, {.with_moments = true});
  voxels.dropped_fill = kDroppedFillWithMoments;
  keep_box(voxels, lower, upper);
  const Part part = part_in_box(surface_, lattice);
  Body body;
  PolygonCells polygon_cells;
  if (assemble_part(voxels, part, body, polygon_cells).cells == 0)
    throw InputError("part \"" + part.name + "\": nothing of it lies in the box");
  (void)append_moments(voxels, body);
  body.surface = surface_;
  set_surface_cells(polygon_cells, body.surface.polygon_count(), body);
  derive_connections(body);
  return body;
}

}  // namespace flexel::voxelize
