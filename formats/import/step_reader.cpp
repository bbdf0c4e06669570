// STEP through OpenCASCADE.
#include "formats/error.h"
#include "formats/import/readers.h"

namespace flexel {

Surface read_step(ImportInput& input, const ImportOptions&) {
  throw InputError(input.where, "STEP files cannot be read yet: export the part as STL");
}

}  // namespace flexel
