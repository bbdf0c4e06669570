// Reads CAD and mesh files into a Surface. Implemented by flexel_import (OpenCASCADE), declared here so that
// no program sees that library.
#pragma once
#include <string>
#include <vector>

#include "formats/common/import_options.h"
#include "formats/part/surface.h"

namespace flexel {

// Reads one file ("-": stdin). The format is recognised by its bytes, then by its extension. Solids become
// parts; CAD faces, groups or dihedral regions become faces; the result has passed check(). Throws
// InputError: unreadable, empty, truncated, unknown format, not finite, STEP without OpenCASCADE (the message
// says how to get it), a `unit` given for a file that carries another.
[[nodiscard]] Surface import_surface(const std::string& path, const ImportOptions& options = {});

// A line for each file of a format that is otherwise written again as it came, whose triangles were split
// (ImportOptions::largest_edge): what its new file does not hold.
[[nodiscard]] std::vector<std::string> refinement_notes(const Surface& surface);

}  // namespace flexel
