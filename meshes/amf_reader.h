// AMF (ISO/ASTM 52915), plain or in a ZIP archive.
#pragma once
#include "formats/common/mesh_job.h"

namespace flexel::meshes {

// Every volume of every object that a constellation shows, or that none does, is a part. Not by assimp, whose release 5.2
// drops all volumes of an object but the first, and takes the turns of an instance for displacements. Curved edges are
// read as straight ones, and colours of vertices are left out; both are told. Throws InputError.
[[nodiscard]] ForeignMesh read_amf(const MeshReadJob& job, const Warn& warn);

}  // namespace flexel::meshes
