// assimp reads the same files: the same triangles in the same order, to its single precision.
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

// Corners of every polygon, in order, in file units.
std::vector<Vec3> corners_by_assimp(const std::string& path) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path, 0);
  EXPECT_NE(scene, nullptr) << path << ": " << importer.GetErrorString();
  std::vector<Vec3> corners;
  if (scene == nullptr) return corners;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f)
      for (unsigned c = 0; c < mesh.mFaces[f].mNumIndices; ++c) {
        const aiVector3D& at = mesh.mVertices[mesh.mFaces[f].mIndices[c]];
        corners.emplace_back(at.x, at.y, at.z);
      }
  }
  return corners;
}

TEST(ImportOracle, AssimpSeesTheSameCornersInTheSameOrder) {
  SKIP_WITHOUT_PARTS();
  for (const char* file :
       {"conrod.stl", "hook.stl", "lower_leg_structure_fork.STL", "ADIS16480.STL", "multibody.stl",
        "yarn_guide.stl", "rabbit.obj", "spot_quadrangulated.obj", "quadknot.obj"}) {
    ImportOptions metres;
    metres.unit = 1;
    const Surface surface = import_surface(part_path(file), metres);
    const std::vector<Vec3> expected = corners_by_assimp(part_path(file));
    ASSERT_EQ(surface.polygon_vertices.size(), expected.size()) << file;
    const double tolerance =
        1e-6 *
        bounding_box(expected).max.cwiseAbs().cwiseMax(bounding_box(expected).min.cwiseAbs()).maxCoeff();
    double largest = 0;
    for (std::size_t c = 0; c < expected.size(); ++c)
      largest = std::max(largest, (surface.vertices[surface.polygon_vertices[c]] - expected[c]).norm());
    EXPECT_LE(largest, tolerance) << file;
  }
}

}  // namespace
}  // namespace flexel::test
