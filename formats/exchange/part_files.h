// Writes each part of a Surface to a file of its own.
#pragma once
#include <string>
#include <vector>

#include "formats/exchange/surface_file.h"

namespace flexel {

// True when the path has "{part}" in it: then every part goes to a file of its own, by its name.
[[nodiscard]] bool names_parts(const std::string& path);
// Writes each part to the path with its name ("/" as "_", and a number where that is another part's name) in
// place of "{part}". Parts of a file that holds several become new files, with their colours, groups and
// attributes.
void write_parts(const Surface& surface, const std::vector<Vec3>& displacement, SurfaceFormat format,
                 double unit, const std::string& path);

}  // namespace flexel
