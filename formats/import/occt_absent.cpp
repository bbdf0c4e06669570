// In place of the readers through OpenCASCADE in a build without it.
#include <fmt/format.h>

#include "formats/error.h"
#include "formats/import/readers.h"

namespace flexel {
namespace {

[[noreturn]] void refuse(const ImportInput& input, const char* format) {
  throw InputError(input.where,
                   fmt::format("is {} file, and this build has no STEP support: configure with "
                               "-DFLEXEL_STEP=ON (needs OpenCASCADE 7.6.3), or export the part as STL",
                               format));
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
