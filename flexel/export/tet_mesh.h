// A part as a mesh of second-order tetrahedra, by gmsh.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "flexel/export/mesh.h"

namespace flexel::mesh_export {

struct TetrahedraOptions {
  double size = 0;  // m, largest edge
  int threads = 0;  // 0: as gmsh chooses
};

// Meshes the files with gmsh: STEP, IGES and BREP from their own geometry, meshes after being cut into faces
// at 30 degrees and parametrised. `surface` is what the files were imported as; the mesh's faces take their
// names from those nearest to them. Throws InputError: gmsh is not installed, cannot mesh the part, or was
// given stdin.
[[nodiscard]] AnalysisMesh tetrahedra(const std::vector<std::string>& paths, const Surface& surface,
                                      const TetrahedraOptions& options, Progress& progress);

}  // namespace flexel::mesh_export
