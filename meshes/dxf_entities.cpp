// Pairs of lines: a group code, and its value. Code 0 begins an entity; 70 of a POLYLINE are its flags.
#include "meshes/dxf_entities.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <span>

#include "base/error.h"

namespace flexel::meshes {
namespace {

// The next line without blanks; moves past it.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
  return line;
}

bool among(std::string_view word, std::span<const std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

[[noreturn]] void refuse(const std::string& where, std::string_view what, const char* cure) {
  throw InputError(where, fmt::format("holds {}, which assimp does not read right: {}", what, cure));
}

void check_entity(std::string_view entity, const std::string& where) {
  constexpr std::string_view kSolids[] = {
      "3DSOLID",         "BODY",         "REGION",      "SURFACE",      "MESH", "EXTRUDEDSURFACE",
      "REVOLVEDSURFACE", "SWEPTSURFACE", "NURBSURFACE", "LOFTEDSURFACE"};
  if (entity == "INSERT")
    refuse(where, "blocks that are inserted (INSERT)", "explode them before exporting, or export STL");
  if (among(entity, kSolids)) refuse(where, fmt::format("solids ({})", entity), "export STEP or STL");
}

}  // namespace

std::size_t check_dxf_entities(std::string_view text, const std::string& where) {
  constexpr std::string_view kRead[] = {"3DFACE", "POLYLINE", "VERTEX", "SEQEND", "SECTION", "ENDSEC"};
  constexpr int kPolygonMesh = 16;
  std::string_view section, entity;
  std::size_t others = 0;
  while (!text.empty()) {
    const std::string_view code = next_line(text), value = next_line(text);
    if (code == "0") entity = value;
    if (code == "2" && entity == "SECTION") section = value;
    if (section != "ENTITIES") continue;
    if (code == "0") {
      check_entity(entity, where);
      others += among(entity, kRead) ? 0 : 1;
    }
    int flags = 0;
    if (code == "70" && entity == "POLYLINE")
      std::from_chars(value.data(), value.data() + value.size(), flags);
    if ((flags & kPolygonMesh) != 0)
      refuse(where, "polygon meshes (POLYLINE with flag 16)",
             "explode them into faces before exporting, or export STL");
  }
  return others;
}

}  // namespace flexel::meshes
