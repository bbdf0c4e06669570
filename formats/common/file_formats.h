// The list of all file formats of parts, and what is asked of it.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "formats/common/file_format.h"

namespace flexel {

[[nodiscard]] std::span<const FileFormat* const> file_formats();

// The format by its name or one of its extensions, in lower case; nullptr: none.
[[nodiscard]] const FileFormat* format_named(std::string_view name);
// That of a source; nullptr: none.
[[nodiscard]] const FileFormat* format_of(const SurfaceSource& source);

[[nodiscard]] bool carries_unit(const SurfaceSource& source);
[[nodiscard]] bool is_cad(const SurfaceSource& source);
// Whether the part comes out as its source's file with other positions, as long as its mesh is the source's.
[[nodiscard]] bool is_rewritten(const SurfaceSource& source);

// The names of all that are read ("step", "iges" ...), and of those that a mesh can be written as; with `cad` those
// too that the part's own CAD file can be written as.
[[nodiscard]] std::vector<std::string> read_formats();
[[nodiscard]] std::vector<std::string> written_formats(bool cad = false);
// For help texts: "STEP, IGES, ..., glTF or 3MF"; with `cad` false those that hold meshes.
[[nodiscard]] std::string read_titles(bool cad = true);
// A format's name in capitals, as messages about what is written have it: "GLB".
[[nodiscard]] std::string capitals(const FileFormat& format);
// Those in capitals of the written formats for which `holds` is true, joined by `last`: "STL and PLY".
[[nodiscard]] std::string written_titles(bool (*holds)(const FileFormat&), std::string_view last);

}  // namespace flexel
