// What the readers of single formats share. Inside flexel_import only.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "base/files/files.h"
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

// Each returns the surface with vertices in metres and `sources` filled but for file and hash; part names may
// still be empty or repeated. All throw InputError(input.where, ...).
[[nodiscard]] Surface read_stl(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_obj(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_ply(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_off(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_gltf(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_3mf(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_step(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_iges(ImportInput& input, const ImportOptions& options);
[[nodiscard]] Surface read_brep(ImportInput& input, const ImportOptions& options);

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

// Text of a file fit for messages and for JSON: bytes that are no UTF-8 and control characters become '?',
// blanks at the ends go.
[[nodiscard]] std::string clean_name(std::string_view text);

// The source record of a format that carries no unit: --unit, else mm.
[[nodiscard]] SurfaceSource unitless_source(const char* format, const ImportOptions& options);

// The source record of a format that carries its unit [m].
[[nodiscard]] SurfaceSource source_in_unit(const char* format, double unit);

// For meshes that are one nameless part: faces are dihedral regions, and the file's bytes travel along.
void complete_single_part(Surface& surface, ImportInput& input);

}  // namespace flexel
