// Where the programs of this installation are.
#pragma once
#include <string>

namespace flexel {

// The path of a Flexel program or module: `name` ("flexel-simulate", "flexel-distances.so") in the folder of this one, or in
// its libexec/flexel.
// Throws InputError: it is not there.
[[nodiscard]] std::string own_program(const std::string& name);

// From now on the programs are in `folder` (or its libexec/flexel beside it), for a process that is none of them.
void set_program_folder(const std::string& folder);

}  // namespace flexel
