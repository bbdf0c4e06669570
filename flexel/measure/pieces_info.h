// What a list of pieces (.pvtu) holds, for flexel info.
#pragma once
#include <string>

namespace flexel::commands {

// Reads the pieces one after another. Text of lines, or JSON in SI units (docs/guide/info.md). Throws InputError as
// read_piece() does.
[[nodiscard]] std::string pieces_info(const std::string& list, bool json);

}  // namespace flexel::commands
