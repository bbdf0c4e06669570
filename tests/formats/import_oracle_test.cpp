// assimp reads the same files: the same triangles in the same order, to its single precision.
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "formats/exchange/surface_file.h"
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

TEST(ImportOracle, AssimpReadsTheGlbAndThe3mfThatWeWrite) {
  const Scratch scratch;
  const std::string box =
      "OFF\n8 6 0\n0 0 0\n40 0 0\n40 10 0\n0 10 0\n0 0 5\n40 0 5\n40 10 5\n0 10 5\n4 0 3 2 1\n4 4 5 6 7\n"
      "4 0 1 5 4\n4 2 3 7 6\n4 1 2 6 5\n4 0 4 7 3\n";
  Surface surface = import_surface(scratch.write("one.off", box));
  append(surface, import_surface(scratch.write("two.off", box)));
  std::vector<Vec3> displacement(8, Vec3::Zero());
  displacement.resize(16, Vec3(0, 0, 0.02));
  const Triangles triangles = triangulate(surface);
  for (const char* ending : {"glb", "3mf"}) {
    const std::string path = scratch.path(std::string("new.") + ending);
    write_surface(surface, displacement, surface_format(ending), 1, path);
    const std::vector<Vec3> seen = corners_by_assimp(path);
    ASSERT_EQ(seen.size(), 3 * triangles.corners.size()) << ending;
    for (std::size_t c = 0; c < seen.size(); ++c) {
      const std::uint32_t v = triangles.corners[c / 3][c % 3];
      EXPECT_LE((surface.vertices[v] + displacement[v] - seen[c]).norm(), 1e-8) << ending << " " << c;
    }
  }
}

}  // namespace
}  // namespace flexel::test
