// What a CAD file holds that does not come out with the deformed shapes.
#pragma once
#include <span>
#include <string>

#include "base/files/files.h"
#include "cad/deform/cad_tree.h"

namespace flexel::cad {

// "dimensions and tolerances (PMI: 12 entities, GEOMETRIC_TOLERANCE among them)"; "": the STEP file holds none.
[[nodiscard]] std::string pmi_of(std::span<const std::byte> step);

// "names, colours and assemblies": what a file of `format` has no room for; "": nothing.
[[nodiscard]] std::string no_room_for(const CadTree& tree, const std::string& format);

}  // namespace flexel::cad
