// Level sets of OpenVDB files (.vdb).
#pragma once
#include "formats/common/mesh_job.h"

namespace flexel::meshes {

// Every level set of the file is a part: the surface where the distance is 0, as quadrilaterals of about a voxel (OpenVDB's
// volumeToMesh: dual contouring), in the coordinates of the grid's transform. Grids of other classes are left out, which is
// told. Throws InputError: the file is damaged, or holds no level set with a surface.
[[nodiscard]] ForeignMesh read_level_sets(const MeshReadJob& job, const Warn& warn);

}  // namespace flexel::meshes
