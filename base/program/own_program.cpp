// /proc/self/exe: PATH and argv[0] may lead elsewhere.
#include "base/program/own_program.h"

#include <unistd.h>

#include <filesystem>

#include "base/error.h"

namespace flexel {
namespace {

std::filesystem::path given_folder;

}  // namespace

void set_program_folder(const std::string& folder) {
  given_folder = folder;
}

std::string own_program(const std::string& name) {
  const int mode =
      name.ends_with(".so") ? R_OK : X_OK;  // Debian installs modules without the permission to run them
  std::error_code error;
  const std::filesystem::path folder =
      given_folder.empty() ? std::filesystem::read_symlink("/proc/self/exe", error).parent_path()
                           : given_folder;
  for (const std::filesystem::path& path : {folder / name, folder.parent_path() / "libexec/flexel" / name})
    if (!error && access(path.c_str(), mode) == 0) return path.string();
  throw InputError("cannot run " + (folder / name).string() +
                   "; the programs of Flexel are installed together: install it again");
}

}  // namespace flexel
