// What is asked of flexel-meshes, the program that reads meshes with other people's libraries (meshes/main.cpp): assimp,
// and OpenVDB for level sets. Inside flexel_import and that program only.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/common/child_job.h"
#include "formats/common/import_options.h"
#include "formats/common/readers.h"

namespace flexel {

struct MeshReadJob {
  std::string format;     // name of its FileFormat
  std::string extension;  // the file's, where the format has several
  Bytes bytes;
  std::string where;  // as that of ImportInput
};

// Write what a body file holds as an OpenVDB file.
struct VdbWriteJob {
  Bytes body;
};
struct VdbFile {
  Bytes bytes;
};

// What a job asks for: one of the two.
struct MeshJob {
  std::optional<MeshReadJob> read;
  std::optional<VdbWriteJob> write;
};

// Polygons of all parts, one part after the other; no vertex belongs to two parts.
struct ForeignMesh {
  double unit = 0;             // metres per unit of the vertices; 0: the file does not say
  std::vector<Vec3> vertices;  // in that unit
  std::vector<std::uint32_t> polygon_offsets, polygon_vertices;  // as those of Surface
  std::vector<std::uint32_t> polygon_part, polygon_group;        // (polygons) a group is of one part
  std::vector<double> polygon_colors;                            // (polygons x 4) or empty
  std::vector<std::string> part_names, group_names;              // "" where the file has none
  std::vector<std::string> part_assemblies;  // (parts) as SurfacePart::assembly; empty: the file has none
};

[[nodiscard]] Bytes pack(const MeshReadJob& job);
[[nodiscard]] Bytes pack(const VdbWriteJob& job);
[[nodiscard]] Bytes pack(const JobAnswer<ForeignMesh>& answer);
[[nodiscard]] Bytes pack(const JobAnswer<VdbFile>& answer);
// Throw InputError(where, ...): these bytes are not from pack(), or do not fit together.
[[nodiscard]] MeshJob unpack_mesh_job(std::span<const std::byte> bytes);
[[nodiscard]] JobAnswer<VdbFile> unpack_vdb(std::span<const std::byte> bytes, const std::string& where);
[[nodiscard]] JobAnswer<ForeignMesh> unpack_foreign_mesh(std::span<const std::byte> bytes,
                                                         const std::string& where);

// A reader's work (FileReader::read): has flexel-meshes read the file with `library` ("assimp", for messages), and makes
// the surface of it. The file's unit, else --unit, else mm; throws InputError where the file has one and --unit is given.
[[nodiscard]] Surface read_foreign(ImportInput& input, const ImportOptions& options, const FileFormat& format,
                                   const char* library);

}  // namespace flexel
