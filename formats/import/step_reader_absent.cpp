// In place of step_reader.cpp in a build without OpenCASCADE.
#include "formats/error.h"
#include "formats/import/readers.h"

namespace flexel {

Surface read_step(ImportInput& input, const ImportOptions&) {
  throw InputError(
      input.where,
      "is a STEP file, and this build has no STEP support: configure with -DFLEXEL_STEP=ON (needs "
      "OpenCASCADE 7.6.3), or export the part as STL");
}

}  // namespace flexel
