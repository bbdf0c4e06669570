// The one file here that sees OpenVDB.
#include "meshes/vdb_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <sstream>

#include "base/error.h"
#include "base/units.h"
#include "formats/common/length_metadata.h"
#include "formats/part/topology.h"

namespace flexel::meshes {
namespace {

struct LevelSetMesh {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
};

template <class Grid>
bool contour(const openvdb::GridBase::Ptr& base, LevelSetMesh& mesh) {
  const auto grid = openvdb::gridPtrCast<Grid>(base);
  if (grid == nullptr) return false;
  openvdb::tools::volumeToMesh(*grid, mesh.points, mesh.quads, 0);
  return true;
}

// Nothing where the grid is of another class or type.
bool contour(const openvdb::GridBase::Ptr& grid, LevelSetMesh& mesh) {
  return grid->getGridClass() == openvdb::GRID_LEVEL_SET &&
         (contour<openvdb::FloatGrid>(grid, mesh) || contour<openvdb::DoubleGrid>(grid, mesh));
}

// OpenVDB's polygons look inward; a grid that is mirrored by its transform turns them again.
bool looks_inward(const LevelSetMesh& level) {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> corners;
  for (const openvdb::Vec3s& at : level.points) vertices.emplace_back(at.x(), at.y(), at.z());
  for (const openvdb::Vec4I& quad : level.quads) {
    corners.push_back({quad[0], quad[1], quad[2]});
    corners.push_back({quad[0], quad[2], quad[3]});
  }
  return signed_volume(vertices, corners) < 0;
}

void append(ForeignMesh& mesh, const LevelSetMesh& level, const std::string& name) {
  const auto begin = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto part = static_cast<std::uint32_t>(mesh.part_names.size());
  const bool turned = looks_inward(level);
  for (const openvdb::Vec3s& at : level.points) mesh.vertices.emplace_back(at.x(), at.y(), at.z());
  for (const openvdb::Vec4I& quad : level.quads) {
    for (int c = 0; c < 4; ++c) mesh.polygon_vertices.push_back(begin + quad[turned ? 3 - c : c]);
    mesh.polygon_offsets.push_back(static_cast<std::uint32_t>(mesh.polygon_vertices.size()));
    mesh.polygon_part.push_back(part);
    mesh.polygon_group.push_back(part);
  }
  mesh.part_names.push_back(name);
  mesh.group_names.emplace_back();
}

// What the grid says of its coordinates (voxelize writes it); 0: nothing.
double unit_of(const openvdb::GridBase& grid) {
  const auto said = grid.getMetadata<openvdb::StringMetadata>(kLengthMetadata);
  if (said == nullptr) return 0;
  try {
    return length_unit(said->value());
  } catch (const InputError&) {
    return 0;
  }
}

openvdb::GridPtrVec grids_of(const MeshReadJob& job) {
  openvdb::initialize();
  std::istringstream bytes(std::string(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size()));
  try {
    return *openvdb::io::Stream(bytes, false).getGrids();
  } catch (const openvdb::Exception& error) {
    throw InputError(job.where, fmt::format("is damaged, or of another version than OpenVDB reads here: {}",
                                            clean_name(std::string(error.what()).substr(0, 200))));
  }
}

}  // namespace

ForeignMesh read_level_sets(const MeshReadJob& job, const Warn& warn) {
  ForeignMesh mesh;
  mesh.polygon_offsets.push_back(0);
  std::vector<std::string> others;
  bool first = true;
  const openvdb::GridPtrVec grids = grids_of(job);
  if (grids.empty()) throw InputError(job.where, "is damaged: it holds no grid");
  for (const openvdb::GridBase::Ptr& grid : grids) {
    LevelSetMesh level;
    if (!contour(grid, level)) {
      others.push_back(fmt::format("\"{}\"", clean_name(grid->getName().substr(0, 60))));
      continue;
    }
    const double unit = unit_of(*grid);
    if (!first && unit != mesh.unit)
      throw InputError(job.where, "its grids are in different units of length: write them in one");
    mesh.unit = unit;
    first = false;
    append(mesh, level, grid->getName());
  }
  if (mesh.polygon_vertices.empty())
    throw InputError(
        job.where,
        first ? "holds no level set, so nothing tells where its surface is: write the signed distance as "
                "one (grid class \"level set\")"
              : "its level sets are nowhere 0: they have no surface");
  if (!others.empty()) warn(fmt::format("left out, for they are no level sets: {}", fmt::join(others, ", ")));
  return mesh;
}

}  // namespace flexel::meshes
