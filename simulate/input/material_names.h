// When two names of materials are one.
#pragma once
#include <string>

namespace flexel::simulate {

// Case, blanks, "-" and "_" do not matter.
[[nodiscard]] bool same_material_name(const std::string& one, const std::string& other);

}  // namespace flexel::simulate
