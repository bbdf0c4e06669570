// Names of body files that say something else.
#pragma once
#include <string>

namespace flexel {

// A line that warns where a body is to be written to a name that a part would have, such as "bent.stl"; "" elsewhere.
[[nodiscard]] std::string body_name_warning(const std::string& path);

}  // namespace flexel
