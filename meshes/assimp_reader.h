// Meshes of the formats that the Open Asset Import Library (assimp) reads.
#pragma once
#include "formats/common/mesh_job.h"

namespace flexel::meshes {

// Every use of a mesh in the scene is a part, in the file's own axes, in the pose of its mesh; equal positions of a part are
// one vertex. What is left out is told in one line. Throws InputError: assimp cannot read it; it shows no polygons.
[[nodiscard]] ForeignMesh read_with_assimp(const MeshReadJob& job, const Warn& warn);

}  // namespace flexel::meshes
