// Files that another file names.
#pragma once
#include <string>

namespace flexel {

// The other file, `where`, may come from anybody: throws InputError(where, ...) for a device or a pipe, which may
// have no end. A `path` that leads nowhere is left to whoever reads it.
void refuse_device(const std::string& path, const std::string& where);

}  // namespace flexel
