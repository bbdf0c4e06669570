// Named attributes of the elements or cells of a body, or of the vertices or polygons of a surface.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace flexel {

// (n x components), row major; SI where the attribute has a unit.
struct Column {
  int components = 1;
  std::vector<double> values;
};

// By name: "velocity", "von_mises". Absent effects have none.
using Columns = std::map<std::string, Column>;

// The colour of the vertices or polygons of a surface: red, green, blue and, where there are four components,
// opacity, each in [0, 1], as the file has them (no change of colour space).
constexpr const char* kColorColumn = "color";

// Names that XML, VTK, PLY and spreadsheets take as they are: letters, digits, "_", "-" and "." of ASCII.
[[nodiscard]] bool valid_column_name(const std::string& name);

// Any text as such a name: other characters become "_"; "_" for an empty one.
[[nodiscard]] std::string column_name(const std::string& text);

// Throws InputError(where, ...) that names the column (`what` says whose, "vertex_columns") unless each has a
// valid name, `count` x components finite values, and a colour 3 or 4 components in [0, 1].
void check_columns(const Columns& columns, std::size_t count, const char* what, const std::string& where);

// Appends `other`, of `other_count` entries, to `columns`, of `count`. Where only one side has a column, or
// it has fewer components there, the other gets 1 for colours (opaque white) and 0 for all else.
void append_columns(Columns& columns, std::size_t count, const Columns& other, std::size_t other_count);

}  // namespace flexel
