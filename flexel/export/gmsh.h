// The program gmsh, and the second-order tetrahedral mesh that it writes.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "base/math/vec.h"
#include "base/program/progress.h"

namespace flexel::mesh_export {

struct GmshTriangle {
  std::array<std::uint32_t, 6> nodes{};  // corners, then the middles of edges 01, 12, 20
  int surface = 0;                       // gmsh's number of the geometric surface
};

struct GmshTetrahedron {
  std::array<std::uint32_t, 10> nodes{};  // in the order of C3D10
  int volume = 0;
};

struct GmshMesh {
  std::vector<Vec3> nodes;  // in the geometry's unit
  std::vector<GmshTriangle> triangles;
  std::vector<GmshTetrahedron> tetrahedra;
  std::string version;
};

// Runs gmsh on a script in `folder`, which merges the geometry, and reads the mesh. `part` is what is meshed,
// for messages. Throws InputError: gmsh is not installed, or cannot mesh it (with its own last error).
[[nodiscard]] GmshMesh mesh_with_gmsh(const std::string& folder, const std::string& script,
                                      const std::string& part, Progress& progress);

}  // namespace flexel::mesh_export
