#include "formats/error.h"
#include "formats/import/readers.h"

namespace flexel {

Surface read_obj(ImportInput& input, const ImportOptions&) {
  throw InputError(input.where, "OBJ files cannot be read yet: export the part as STL");
}

}  // namespace flexel
