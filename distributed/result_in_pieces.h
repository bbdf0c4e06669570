// The result of a body that came in pieces (formats/pieces/pieces.h), in such pieces again.
#pragma once
#include <string>

#include "formats/pieces/pieces.h"

namespace flexel::distributed {

[[nodiscard]] bool is_piece_list(const std::string& path);

// Of all that the pieces of two results may differ in: one may move like another and bear other stresses.
[[nodiscard]] std::uint64_t hash_of(const Body& result);

struct PieceRange {
  std::uint32_t begin = 0, end = 0;
  std::uint64_t run = 0;  // of the result
};
// Writes these pieces of a result, and with the first of all the list and the surface. `result` has their cells, and those around.
// The pieces of `files` are read one after another. Throws InputError as read_piece does.
void write_pieces(Body& result, const PieceFiles& files, const PieceRange& range, const std::string& list,
                  bool compress);

// Writes as many pieces as `files` has, under names of `list`: `result`, which is join_pieces(files) deformed, with columns of its
// own. The pieces are read one after another. Throws InputError as read_piece does.
void write_in_pieces(Body& result, const PieceFiles& files, const std::string& list, bool compress);

}  // namespace flexel::distributed
