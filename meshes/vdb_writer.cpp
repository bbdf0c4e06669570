// OpenVDB voxels are samples: index (x, y, z) is the centre of a sample.
#include "meshes/vdb_writer.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <cmath>
#include <sstream>

#include "base/error.h"
#include "formats/common/length_metadata.h"
#include "meshes/mesh_distances.h"

namespace flexel::meshes {
namespace {

// Index (i, j, k) to the centre of that voxel; OpenVDB's vectors are rows.
openvdb::Mat4R index_to_world(const Lattice& lattice, const Vec3& spacing) {
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  const Vec3 centre = lattice.origin + lattice.axes * (.5 * spacing);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) matrix[a][b] = lattice.axes(b, a) * spacing[a];
  for (int b = 0; b < 3; ++b) matrix[3][b] = centre[b];
  return matrix;
}

openvdb::FloatGrid::Ptr fill_grid(const Body& body, const Part& part) {
  auto grid = openvdb::FloatGrid::create(0);
  auto writer = grid->getAccessor();
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
    const Index3& at = body.lattice_index[body.cell_elements[c][0]];
    const openvdb::Coord ijk(at[0], at[1], at[2]);
    writer.setValue(ijk, writer.getValue(ijk) + static_cast<float>(body.fill[c]));
  }
  grid->setTransform(
      openvdb::math::Transform::createLinearTransform(index_to_world(part.lattice, part.lattice.spacing)));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setName("fill_" + part.name);
  grid->insertMeta(kLengthMetadata, openvdb::StringMetadata("m"));
  return grid;
}

// A part's triangles in the index space of its distance grid.
struct IndexedMesh {
  std::vector<double> points;
  std::vector<std::uint32_t> corners;
};
IndexedMesh indexed_mesh(const Surface& surface, std::uint32_t part, const Lattice& lattice, double voxel) {
  IndexedMesh mesh;
  for (const Vec3& vertex : surface.vertices) {
    const Vec3 local = lattice.axes.transpose() * (vertex - lattice.origin) / voxel;
    for (int a = 0; a < 3; ++a) mesh.points.push_back(local[a] - .5);
  }
  const Triangles all = triangulate(surface);
  for (std::size_t t = 0; t < all.corners.size(); ++t)
    if (surface.polygon_part(all.polygon[t]) == part)
      mesh.corners.insert(mesh.corners.end(), all.corners[t].begin(), all.corners[t].end());
  return mesh;
}

openvdb::FloatGrid::Ptr distance_grid(const Body& body, std::uint32_t number,
                                      const openvdb::FloatGrid& fill) {
  constexpr float kBandVoxels = 3;
  const Part& part = body.parts[number];
  const Vec3& spacing = part.lattice.spacing;
  const double voxel = spacing.minCoeff();
  const openvdb::Mat4R transform = index_to_world(part.lattice, Vec3::Constant(voxel));
  const IndexedMesh mesh = indexed_mesh(body.surface, number, part.lattice, voxel);
  const auto grid = std::static_pointer_cast<openvdb::FloatGrid>(
      mesh_distances({mesh.points.data(), mesh.points.size() / 3, mesh.corners.data(),
                      mesh.corners.size() / 3, transform.asPointer(), kBandVoxels, false}));
  const auto reader = fill.getConstUnsafeAccessor();
  for (auto value = grid->beginValueOn(); value; ++value) {
    const openvdb::Coord at = value.getCoord();
    openvdb::Coord cell;
    for (int a = 0; a < 3; ++a) cell[a] = static_cast<int>(std::floor((at[a] + .5) * voxel / spacing[a]));
    if (reader.getValue(cell) >= .5f) value.setValue(-value.getValue());
  }
  openvdb::tools::signedFloodFill(grid->tree());  // beyond the band: deep inside is negative too
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setName("distance_" + part.name);
  grid->insertMeta(kLengthMetadata, openvdb::StringMetadata("m"));
  return grid;
}

}  // namespace

Bytes vdb_of(const Body& body) {
  openvdb::initialize();
  openvdb::GridPtrVec grids;
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    if (body.parts[p].placement != Placement::corner)
      throw InputError("--vdb: centre placement has no cells; use --placement corner");
    const auto fill = fill_grid(body, body.parts[p]);
    grids.push_back(fill);
    grids.push_back(distance_grid(body, p, *fill));
  }
  std::ostringstream stream;
  openvdb::io::Stream(stream).write(grids);
  std::string text = stream.str();
  // OpenVDB writes a random number there, and no reader asks for it: the same body gives the same bytes.
  constexpr std::size_t kNumber = 21;  // after the magic number, the versions and a flag
  const std::string_view same = "00000000-0000-4000-8000-000000000000";
  text.replace(kNumber, same.size(), same);
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

}  // namespace flexel::meshes
