// A name is compared in small letters and without the number at its end.
#include "formats/part/part_name.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <string_view>

namespace flexel {
namespace {

constexpr std::string_view kKinds[] = {
    "compound", "compsolid", "solid",  "shell",   "shape", "mesh",  "object",  "geometry", "model", "default",
    "unnamed",  "untitled",  "noname", "no name", "none",  "ascii", "product", "document", "brep",  "null"};
constexpr std::string_view kWriters[] = {
    "open cascade",  "exported ", "created by ", "generated ", "visualization toolkit",
    "vcg",           "openscad",  "stl ",        "ascii stl",  "binary stl",
    "stl_generated", "stlb",      "converted ",  "meshlab"};

}  // namespace

bool says_nothing(const std::string& name) {
  std::string text;
  for (const char letter : name) text += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  for (const std::string_view writer : kWriters)
    if (text.rfind(writer, 0) == 0) return true;
  // without a number at its end: "mesh_0", "object.001"
  const std::size_t end = text.find_last_not_of("0123456789 _-.#:()");
  text = end == std::string::npos ? "" : text.substr(0, end + 1);
  return std::find(std::begin(kKinds), std::end(kKinds), text) != std::end(kKinds);
}

}  // namespace flexel
