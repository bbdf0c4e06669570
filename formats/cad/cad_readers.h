// The readers through OpenCASCADE: each in a file of its own, or all in occt_absent.cpp, which refuses.
#pragma once
#include "formats/common/readers.h"

namespace flexel {

[[nodiscard]] Surface read_step(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_iges(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_brep(ImportInput& input, const ImportOptions& options);

}  // namespace flexel
