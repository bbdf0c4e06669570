// VTK's parallel unstructured grids (.pvtu): an XML list of .vtu files, the pieces of one grid. Layout after VTK's "VTK
// XML file formats" (Kitware). The attribute "run" of the grid, which VTK passes over, is ours.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/vtu/vtu_head.h"

namespace flexel::vtu {

struct PieceList {
  std::uint64_t run = 0;           // that all pieces carry
  std::vector<std::string> files;  // in the list's folder, by index of the piece
};

// The list's text. Of `arrays`, those of a piece, the names, types and components are said, which readers need.
[[nodiscard]] std::string pvtu_text(const PieceList& list, const std::vector<HeadArray>& arrays);

// Throws InputError: not such a list, no pieces, without a run, a piece that is no file of the list's folder.
[[nodiscard]] PieceList parse_pvtu(std::string_view text, const std::string& where);

}  // namespace flexel::vtu
