// Replaces this process (exec) by the stage program in the same folder.
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "base/error.h"
#include "flexel/commands.h"

namespace flexel::commands {

void run_stage_program(const char* name, char** argv) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program = (self.parent_path() / ("flexel-" + std::string(name))).string();
  std::string own_name = "flexel-" + std::string(name);
  argv[0] = own_name.data();
  if (!error) execv(program.c_str(), argv);
  throw InputError("cannot run " + program + ": " + std::strerror(errno) +
                   "; the stage programs are installed beside flexel");
}

}  // namespace flexel::commands
