// Writes a tree of products as a STEP, IGES or BREP file.
#pragma once
#include <string>
#include <vector>

#include "base/files/files.h"
#include "cad/deform/cad_tree.h"

namespace flexel::cad {

// The trees of several files become roots beside each other; unit, schema and time are those of the first. BREP holds the
// shapes alone, in place; IGES the shapes with names and colours. Throws Standard_Failure, std::bad_alloc.
[[nodiscard]] Bytes write_tree(const std::vector<CadTree>& trees, const std::string& format);

}  // namespace flexel::cad
