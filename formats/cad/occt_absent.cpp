// Stands in for the OpenCASCADE readers in a build without it: every call is refused.
#include <fmt/format.h>

#include "base/error.h"
#include "formats/cad/cad_readers.h"

namespace flexel {
namespace {

[[noreturn]] void refuse(const ImportInput& input, const char* format) {
#ifdef FLEXEL_MESHES_ONLY
  constexpr const char* kWhy = "this program reads meshes only: export the part as STL";
#else
  constexpr const char* kWhy =
      "this build has no STEP support: configure with -DFLEXEL_STEP=ON (needs OpenCASCADE 7.6.3), or export "
      "the part as STL";
#endif
  throw InputError(input.where, fmt::format("is {} file, and {}", format, kWhy));
}

}  // namespace

Surface read_step(ImportInput& input, const ImportOptions&) {
  refuse(input, "a STEP");
}

Surface read_iges(ImportInput& input, const ImportOptions&) {
  refuse(input, "an IGES");
}

Surface read_brep(ImportInput& input, const ImportOptions&) {
  refuse(input, "a BREP");
}

}  // namespace flexel
