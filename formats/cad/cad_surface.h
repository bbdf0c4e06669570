// The surface of what OpenCASCADE read.
#pragma once
#include "formats/cad/cad_job.h"
#include "formats/common/import_options.h"

namespace flexel {

// The surface, once the mesh has been checked: solids that are inside out are turned, edges split, colours those of the
// polygons. Throws InputError: damaged, an edge that is not positive.
[[nodiscard]] Surface cad_surface(CadMesh mesh, SurfaceSource source, const ImportOptions& options,
                                  const std::string& where);

}  // namespace flexel
