// The jobs and their answers as bytes.
#include "formats/cad/cad_job.h"

#include "base/error.h"
#include "base/program/share_scope.h"

namespace flexel {

// Outside the unnamed namespace, where argument-dependent lookup finds them.
template <class Archive>
static void visit(Archive& archive, CadReadJob& job) {
  visit_all(archive, job.format, job.bytes, job.where, job.file, job.unit, job.deflection,
            job.angular_deflection, job.threads);
}

template <class Archive>
static void visit(Archive& archive, CadWriteJob& job) {
  visit_all(archive, job.body, job.formats, job.method, job.scale, job.tolerance, job.volume, job.threads);
}

template <class Archive>
static void visit(Archive& archive, CadMesh& mesh) {
  visit_mesh(archive, mesh.surface);
  visit(archive, mesh.face_colors);
}

template <class Archive>
static void visit(Archive& archive, CadFace& face) {
  visit_all(archive, face.name, face.deviation);
}

template <class Archive>
static void visit(Archive& archive, CadFile& file) {
  visit_all(archive, file.bytes, file.invalid_again);
}

template <class Archive>
static void visit(Archive& archive, CadWritten& written) {
  visit_all(archive, written.files, written.solids, written.faces, written.kept, written.tolerance,
            written.deviation, written.deviation_face, written.missed, written.folded, written.invalid,
            written.invalid_before, written.gap, written.volume, written.volume_before);
}

namespace {

constexpr std::uint64_t kReadKind = 0x666c65786c726401, kWriteKind = 0x666c65786c777201;

template <class Result>
JobAnswer<Result> unpacked(std::uint64_t kind, std::span<const std::byte> bytes, const std::string& where) {
  Unpacker unpacker(bytes, where, "is damaged: OpenCASCADE makes nothing sound of it");
  if (kind_of(unpacker) != kind) unpacker.fail();
  JobAnswer<Result> answer;
  finish(unpacker, answer);
  return answer;
}

Bytes run(const Bytes& job, const ChildLimits& limits, const std::string& where, const JobWords& words,
          const TellShare& hear = {}) {
#ifndef FLEXEL_STEP
  throw InputError(where,
                   "is a CAD file, and this build has no OpenCASCADE: configure with -DFLEXEL_STEP=ON (needs "
                   "OpenCASCADE 7.6.3), or export the part as STL");
#endif
  return run_job({"flexel-cad", "OpenCASCADE", "OpenCASCADE 7.6.3"}, job, limits, where, words, hear);
}

}  // namespace

Bytes pack(const CadReadJob& job) {
  return packed(kReadKind, job);
}
Bytes pack(const CadWriteJob& job) {
  return packed(kWriteKind, job);
}
Bytes pack(const JobAnswer<CadMesh>& answer) {
  return packed(kReadKind, answer);
}
Bytes pack(const JobAnswer<CadWritten>& answer) {
  return packed(kWriteKind, answer);
}

JobAnswer<CadMesh> unpack_mesh(std::span<const std::byte> bytes, const std::string& where) {
  auto answer = unpacked<CadMesh>(kReadKind, bytes, where);
  const CadMesh& mesh = answer.result;
  if (!mesh.face_colors.empty() && mesh.face_colors.size() != 3 * mesh.surface.faces.size())
    throw InputError(where, "is damaged: OpenCASCADE makes nothing sound of it");
  return answer;
}

JobAnswer<CadWritten> unpack_written(std::span<const std::byte> bytes, const std::string& where) {
  return unpacked<CadWritten>(kWriteKind, bytes, where);
}

CadJob unpack_job(std::span<const std::byte> bytes) {
  Unpacker unpacker(bytes, "stdin", "is no job: flexel-cad is run by the other programs only");
  const std::uint64_t kind = kind_of(unpacker);
  CadJob job;
  if (kind == kReadKind)
    finish(unpacker, job.read.emplace());
  else if (kind == kWriteKind)
    finish(unpacker, job.write.emplace());
  else
    unpacker.fail();
  return job;
}

CadMesh run_job(const CadReadJob& job, const ChildLimits& limits, const std::string& instead,
                const std::function<void(const std::string&)>& warn) {
  const Bytes answer = run(pack(job), limits, job.where,
                           {"read it", "is damaged", "is damaged, or too much", instead}, tell_share);
  return result_of(unpack_mesh(answer, job.where), job.where, warn);
}

CadWritten run_job(const CadWriteJob& job, const ChildLimits& limits, const std::string& where,
                   const std::function<void(const std::string&)>& warn, const TellShare& hear) {
  const Bytes answer = run(pack(job), limits, where,
                           {"deform it", "its surfaces cannot be deformed", "its surfaces are too much",
                            "a larger --tolerance takes less, or write a mesh (STL, OBJ, ...)"},
                           hear);
  CadWritten written = result_of(unpack_written(answer, where), where, warn);
  if (written.files.size() != job.formats.size())
    throw InputError(where, "is damaged: OpenCASCADE makes nothing sound of it");
  return written;
}

}  // namespace flexel
