// By the endings of the formats of parts.
#include "formats/exchange/body_name.h"

#include <fmt/format.h>

#include "base/files/files.h"
#include "formats/common/file_formats.h"

namespace flexel {

std::string body_name_warning(const std::string& path) {
  if (path == "-" || format_named(extension(path)) == nullptr) return "";
  return fmt::format(
      "{} gets a body (VTK, .vtu), whatever its name says: flexel-map makes the deformed part of one", path);
}

}  // namespace flexel
