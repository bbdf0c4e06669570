// Folders whose names the system chooses, so that two runs at once never share one.
#include "base/files/temporary_folder.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "base/error.h"

namespace flexel {

TemporaryFolder::TemporaryFolder(const std::filesystem::path& parent) {
  std::string name = (parent / ".flexel-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr)
    throw InputError(parent.string(), fmt::format("no folder can be made there: {}", std::strerror(errno)));
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace flexel
