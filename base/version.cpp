// The version comes from the build.
#include "base/version.h"

namespace flexel {

const char* version() {
  return FLEXEL_VERSION;
}

}  // namespace flexel
