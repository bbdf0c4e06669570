// OpenVDB voxels are samples: index (x, y, z) is the centre of a sample.
#include "voxelize/heal_vdb.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

namespace flexel {
namespace {

// A mesh as OpenVDB asks for it, in its index space.
class MeshAdapter {
 public:
  MeshAdapter(const PartMesh& mesh, const Range& range) : mesh_(&mesh), range_(range) {}
  [[nodiscard]] std::size_t polygonCount() const { return mesh_->corners.size(); }
  [[nodiscard]] std::size_t pointCount() const { return mesh_->vertices.size(); }
  [[nodiscard]] std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t n, std::size_t v, openvdb::Vec3d& at) const {
    const Vec3& vertex = mesh_->vertices[mesh_->corners[n][v]];
    for (int a = 0; a < 3; ++a) at[a] = (vertex[a] - range_.begin[a]) * kSamples - .5;
  }

 private:
  const PartMesh* mesh_;
  Range range_;
};

}  // namespace

struct SampleDistances::Grid {
  openvdb::FloatGrid::Ptr grid;
};

SampleDistances::SampleDistances(const PartMesh& mesh, const Range& range) : grid_(std::make_unique<Grid>()) {
  openvdb::initialize();
  const auto transform = openvdb::math::Transform::createLinearTransform(1);
  grid_->grid =
      openvdb::tools::meshToVolume<openvdb::FloatGrid>(MeshAdapter(mesh, range), *transform, kBand, kBand);
}
SampleDistances::~SampleDistances() = default;

float SampleDistances::at(int x, int y, int z) const {
  return grid_->grid->tree().getValue({x, y, z});
}

void SampleDistances::voxel(int i, int j, int k, std::array<float, 64>& out) const {
  const auto reader = grid_->grid->getConstUnsafeAccessor();
  for (int bit = 0; bit < 64; ++bit)
    out[static_cast<std::size_t>(bit)] =
        reader.getValue({kSamples * i + (bit & 3), kSamples * j + (bit >> 2 & 3), kSamples * k + (bit >> 4)});
}

}  // namespace flexel
