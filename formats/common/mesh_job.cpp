// The job and its answer as bytes, and what becomes of the answer.
#include "formats/common/mesh_job.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/resources.h"
#include "formats/part/topology.h"

namespace flexel {
namespace {

constexpr std::uint64_t kMeshKind = 0x666c65786d657301, kVdbKind = 0x666c65786d657302;
constexpr const char* kUnsound = "is damaged: what its reader gives does not fit together";

// Sound files take a few seconds and 30 bytes of memory a byte; text of polygons with little space the most.
ChildLimits mesh_limits(const ImportInput& input) {
  const auto bytes = static_cast<double>(input.bytes.size());
  return limits_of_child(30 + 1e-5 * bytes, std::min(.8 * available_memory(), 1e9 + 200 * bytes));
}

}  // namespace

// Outside the unnamed namespace, where argument-dependent lookup finds them.
template <class Archive>
static void visit(Archive& archive, MeshReadJob& job) {
  visit_all(archive, job.format, job.extension, job.bytes, job.where);
}

template <class Archive>
static void visit(Archive& archive, VdbWriteJob& job) {
  visit(archive, job.body);
}

template <class Archive>
static void visit(Archive& archive, VdbFile& file) {
  visit(archive, file.bytes);
}

template <class Archive>
static void visit(Archive& archive, ForeignMesh& mesh) {
  visit_all(archive, mesh.unit, mesh.vertices, mesh.polygon_offsets, mesh.polygon_vertices, mesh.polygon_part,
            mesh.polygon_group, mesh.polygon_colors, mesh.part_names, mesh.group_names, mesh.part_assemblies);
}

Bytes pack(const MeshReadJob& job) {
  return packed(kMeshKind, job);
}

Bytes pack(const JobAnswer<ForeignMesh>& answer) {
  return packed(kMeshKind, answer);
}

Bytes pack(const VdbWriteJob& job) {
  return packed(kVdbKind, job);
}

Bytes pack(const JobAnswer<VdbFile>& answer) {
  return packed(kVdbKind, answer);
}

MeshJob unpack_mesh_job(std::span<const std::byte> bytes) {
  Unpacker unpacker(bytes, "stdin", "is no job: flexel-meshes is run by the other programs only");
  const std::uint64_t kind = kind_of(unpacker);
  MeshJob job;
  if (kind == kMeshKind)
    finish(unpacker, job.read.emplace());
  else if (kind == kVdbKind)
    finish(unpacker, job.write.emplace());
  else
    unpacker.fail();
  return job;
}

JobAnswer<VdbFile> unpack_vdb(std::span<const std::byte> bytes, const std::string& where) {
  Unpacker unpacker(bytes, where, "flexel-meshes answers what does not fit together");
  if (kind_of(unpacker) != kVdbKind) unpacker.fail();
  JobAnswer<VdbFile> answer;
  finish(unpacker, answer);
  return answer;
}

JobAnswer<ForeignMesh> unpack_foreign_mesh(std::span<const std::byte> bytes, const std::string& where) {
  Unpacker unpacker(bytes, where, kUnsound);
  if (kind_of(unpacker) != kMeshKind) unpacker.fail();
  JobAnswer<ForeignMesh> answer;
  finish(unpacker, answer);
  const ForeignMesh& mesh = answer.result;
  if (answer.refused || answer.failed) return answer;
  const std::size_t polygons = mesh.polygon_offsets.empty() ? 0 : mesh.polygon_offsets.size() - 1;
  const auto below = [](const std::vector<std::uint32_t>& numbers, std::size_t limit) {
    return std::all_of(numbers.begin(), numbers.end(), [&](std::uint32_t n) { return n < limit; });
  };
  // Polygons apart from what is checked of every surface: the readers' helpers believe them.
  bool sound = polygons > 0 && mesh.polygon_part.size() == polygons &&
               mesh.polygon_group.size() == polygons &&
               (mesh.polygon_colors.empty() || mesh.polygon_colors.size() == 4 * polygons) &&
               below(mesh.polygon_part, mesh.part_names.size()) &&
               (mesh.part_assemblies.empty() || mesh.part_assemblies.size() == mesh.part_names.size()) &&
               below(mesh.polygon_group, mesh.group_names.size()) &&
               below(mesh.polygon_vertices, mesh.vertices.size()) && mesh.polygon_offsets[0] == 0 &&
               mesh.polygon_offsets.back() == mesh.polygon_vertices.size() && mesh.unit >= 0;
  for (std::size_t p = 0; sound && p < polygons; ++p)
    sound = mesh.polygon_offsets[p] + 3 <= mesh.polygon_offsets[p + 1];
  if (!sound) unpacker.fail();
  return answer;
}

Surface read_foreign(ImportInput& input, const ImportOptions& options, const FileFormat& format,
                     const char* library) {
  const std::string name(format.name), given = extension(input.file);
  const bool known =
      std::find(format.extensions.begin(), format.extensions.end(), given) != format.extensions.end();
  MeshReadJob job{name, known ? given : name, std::move(input.bytes), input.where};
  const JobWords words{"read it", "is damaged", "is damaged, or too much", "export it anew, or as STL"};
  const Bytes answer =
      run_job({"flexel-meshes", library, library}, pack(job), mesh_limits(input), input.where, words);
  input.bytes = std::move(job.bytes);
  const auto warn = [&](const std::string& line) {
    if (options.warn) options.warn(input.where + ": " + line);
  };
  ForeignMesh mesh = result_of(unpack_foreign_mesh(answer, input.where), input.where, warn);
  if (mesh.unit > 0 && options.unit)
    throw InputError(input.where,
                     fmt::format("the {} file carries its own unit: leave out --unit", format.title));
  Surface surface;
  surface.sources.push_back(mesh.unit > 0 ? source_in_unit(name.c_str(), mesh.unit)
                                          : unitless_source(name.c_str(), options));
  for (Vec3& vertex : mesh.vertices) {
    if (!vertex.allFinite()) throw InputError(input.where, "has a coordinate that is not a finite number");
    vertex *= surface.sources[0].unit;
  }
  surface.vertices = std::move(mesh.vertices);
  surface.polygon_offsets = std::move(mesh.polygon_offsets);
  surface.polygon_vertices = std::move(mesh.polygon_vertices);
  for (const std::string& part : mesh.part_names) surface.parts.push_back({clean_name(part)});
  for (std::size_t p = 0; p < mesh.part_assemblies.size(); ++p)
    surface.parts[p].assembly = clean_name(mesh.part_assemblies[p]);
  for (std::string& group : mesh.group_names) group = clean_name(group);
  if (!mesh.polygon_colors.empty())
    surface.polygon_columns[kColorColumn] = {4, std::move(mesh.polygon_colors)};
  std::vector<std::uint32_t> own(surface.vertices.size());  // the library's vertices are welded part by part
  for (std::uint32_t v = 0; v < own.size(); ++v) own[v] = v;
  assign_group_faces(surface, mesh.polygon_part, mesh.polygon_group, mesh.group_names, own);
  return surface;
}

}  // namespace flexel
