// Reads the files of a run, which takes long enough to be shown.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "formats/exchange/import.h"

namespace flexel {

// As import_surface, of at least one file, the parts of the next after those of the one before; the stage of `progress`
// goes from 0 to 1.
[[nodiscard]] Surface import_parts(const std::vector<std::string>& paths, const ImportOptions& options,
                                   Progress& progress);

}  // namespace flexel
