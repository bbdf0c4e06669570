// The result of a body that came in pieces (formats/pieces/pieces.h), in such pieces again.
#pragma once
#include <string>

#include "formats/pieces/pieces.h"

namespace flexel::distributed {

[[nodiscard]] bool is_piece_list(const std::string& path);

// Writes as many pieces as `files` has, under names of `list`: `result`, which is join_pieces(files) deformed, with columns of its
// own. The pieces are read one after another. Throws InputError as read_piece does.
void write_in_pieces(Body& result, const PieceFiles& files, const std::string& list, bool compress);

}  // namespace flexel::distributed
