// The assemblies that a CAD file's solids lie in.
#pragma once
#include <string>
#include <vector>

#include "cad/read/occt.h"

namespace flexel::cad {

// For each solid of the shape, in the order of solids_of(), the names of the assemblies that hold it, from the outermost:
// "gearbox/shaft-2", where "-2" tells the second use of one name within its assembly; "/" in a name is "_". "" for a solid
// in none, and for all where the shape has no solids.
[[nodiscard]] std::vector<std::string> assembly_paths(const CadShape& shape);

}  // namespace flexel::cad
