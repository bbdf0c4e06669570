// What the readers of single formats share. Inside flexel_import only.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/files/files.h"
#include "formats/common/file_format.h"
#include "formats/common/import_options.h"
#include "formats/part/surface.h"

namespace flexel {

// A file in memory.
struct ImportInput {
  Bytes bytes;
  std::string where;   // for messages: the path, "stdin" for "-"
  std::string file;    // name without folders, "stdin" for "-"
  std::string folder;  // of the file, "" for "-"
  std::string stem;    // fallback for part names: the file's name without its extension, "part" for "-"
};

// The first bytes, as text.
[[nodiscard]] std::string_view beginning(const ImportInput& input);

// How far a file's bytes speak for a format. `weak` counts for less than the file's extension.
enum class Evidence { none, weak, text, size, magic };

// How a format is read: the second half of its row (formats/common/file_format.h).
struct FileReader {
  const FileFormat* format = nullptr;
  Evidence (*sniff)(const ImportInput& input) = nullptr;  // of a file whose encoding is not known yet
  // Returns the surface with vertices in metres and `sources` filled but for file and hash; part names may
  // still be empty or repeated. Throws InputError(input.where, ...).
  Surface (*read)(ImportInput& input, const ImportOptions& options) = nullptr;
  // Whether the file is text, so that no byte of it is 0; none: nobody looks.
  bool (*is_text)(const ImportInput& input) = nullptr;
  // It leaves the bytes alone and uses few threads: the file's hash is made meanwhile.
  bool hashed_while_read = false;
};

// Defined where each format is read.
extern const FileReader kStepReader, kIgesReader, kBrepReader, kStlReader, kObjReader, kPlyReader, kOffReader,
    kGltfReader, k3mfReader, kVdbReader;
// Those of formats/assimp, in the order of their rows.
[[nodiscard]] std::span<const FileReader> assimp_readers();

// Whether the text begins, after blanks, with a word (given in lower case) in whatever case.
[[nodiscard]] bool begins_with_word(std::string_view text, std::string_view word);

// Edges with a dihedral angle over this bound the faces of a mesh that has no groups.
constexpr double kFaceAngle = 30;  // degrees

// Cuts a surface that has parts but no faces into dihedral regions. `polygon_part` (polygons) names each
// polygon's part; `welded` (vertices) each vertex's representative. A polygon of more than three corners goes
// with its first triangle.
void assign_dihedral_faces(Surface& surface, const std::vector<std::uint32_t>& polygon_part,
                           const std::vector<std::uint32_t>& welded);

// The same, but a part whose polygons are in several groups (polygon_group: (polygons), each group of one
// part only) has these for faces, by their names.
void assign_group_faces(Surface& surface, const std::vector<std::uint32_t>& polygon_part,
                        const std::vector<std::uint32_t>& polygon_group,
                        const std::vector<std::string>& group_names,
                        const std::vector<std::uint32_t>& welded);

// Throws InputError where a polygon names a vertex that is not there.
void check_indices(const Surface& surface, const ImportInput& input);

// Text of a file fit for messages and for JSON: bytes that are no UTF-8 and what acts on a terminal
// (base/printable.h) become '?', blanks at the ends go.
[[nodiscard]] std::string clean_name(std::string_view text);

// The source record of a format that carries no unit: --unit, else mm.
[[nodiscard]] SurfaceSource unitless_source(const char* format, const ImportOptions& options);

// The source record of a format that carries its unit [m].
[[nodiscard]] SurfaceSource source_in_unit(const char* format, double unit);

// For meshes that are one nameless part: faces are dihedral regions, and the file's bytes travel along.
void complete_single_part(Surface& surface, ImportInput& input);

}  // namespace flexel
