// Links are followed: what counts is what would be read.
#include "base/files/named_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/error.h"

namespace flexel {

void refuse_device(const std::string& path, const std::string& where) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode))
    throw InputError(where, fmt::format("names \"{}\", which is no file but a device or a pipe", path));
}

}  // namespace flexel
