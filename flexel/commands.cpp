// Replaces this process (exec) by a stage program.
#include "flexel/commands.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "base/error.h"
#include "base/program/own_program.h"

namespace flexel::commands {

void run_stage_program(const char* name, char** argv) {
  std::string own_name = "flexel-" + std::string(name);
  const std::string program = own_program(own_name);
  argv[0] = own_name.data();
  execv(program.c_str(), argv);
  throw InputError("cannot run " + program + ": " + std::strerror(errno));
}

}  // namespace flexel::commands
