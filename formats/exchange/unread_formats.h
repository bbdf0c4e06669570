// Files that people have and that no reader here takes, with the way to one that is read.
#pragma once
#include <string>
#include <string_view>

namespace flexel {

// What to say of a file with this extension (lower case): "is a JT file ...: ..."; "" where it is none of them.
[[nodiscard]] std::string unread_extension(std::string_view extension);
// The same by its first bytes.
[[nodiscard]] std::string unread_bytes(std::string_view beginning);

}  // namespace flexel
