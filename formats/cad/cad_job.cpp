// Both sides are one build, so values go as they are in memory. The side that reads believes nothing all the same,
// for the other may have been damaged by what it read.
#include "formats/cad/cad_job.h"

#include <fmt/format.h>

#include "base/error.h"
#include "base/files/packing.h"
#include "base/program/own_program.h"
#include "base/units.h"

namespace flexel {

// Outside the unnamed namespace, where argument-dependent lookup finds them.
template <class Archive>
static void visit(Archive& archive, CadReadJob& job) {
  visit(archive, job.format);
  visit(archive, job.bytes);
  visit(archive, job.where);
  visit(archive, job.file);
  visit(archive, job.unit);
  visit(archive, job.deflection);
  visit(archive, job.angular_deflection);
  visit(archive, job.threads);
}

template <class Archive>
static void visit(Archive& archive, CadWriteJob& job) {
  visit(archive, job.body);
  visit(archive, job.format);
  visit(archive, job.method);
  visit(archive, job.scale);
  visit(archive, job.tolerance);
  visit(archive, job.volume);
  visit(archive, job.threads);
}

template <class Archive>
static void visit(Archive& archive, SurfacePart& part) {
  visit(archive, part.name);
}

template <class Archive>
static void visit(Archive& archive, SurfaceFace& face) {
  visit(archive, face.name);
  visit(archive, face.part);
}

template <class Archive>
static void visit(Archive& archive, CadMesh& mesh) {
  Surface& surface = mesh.surface;
  visit(archive, surface.vertices);
  visit(archive, surface.polygon_offsets);
  visit(archive, surface.polygon_vertices);
  visit(archive, surface.polygon_face);
  visit(archive, surface.faces);
  visit(archive, surface.parts);
  visit(archive, mesh.face_colors);
}

template <class Archive>
static void visit(Archive& archive, CadFace& face) {
  visit(archive, face.name);
  visit(archive, face.deviation);
}

template <class Archive>
static void visit(Archive& archive, CadWritten& written) {
  visit(archive, written.file);
  visit(archive, written.solids);
  visit(archive, written.faces);
  visit(archive, written.kept);
  visit(archive, written.tolerance);
  visit(archive, written.deviation);
  visit(archive, written.deviation_face);
  visit(archive, written.missed);
  visit(archive, written.folded);
  visit(archive, written.invalid);
  visit(archive, written.invalid_before);
  visit(archive, written.gap);
  visit(archive, written.volume);
  visit(archive, written.volume_before);
}

template <class Archive, class Result>
static void visit(Archive& archive, CadAnswer<Result>& answer) {
  visit(archive, answer.refused);
  visit(archive, answer.warnings);
  visit(archive, answer.where);
  visit(archive, answer.why);
  visit(archive, answer.result);
}

namespace {

enum class JobKind : std::uint64_t { read = 0x666c65786c726401, write = 0x666c65786c777201 };
constexpr std::uint64_t kEndMark = 0x666c6578656c3031;

template <class Value>
Bytes packed(JobKind kind, const Value& value) {
  Packer packer;
  visit(packer, kind);
  visit(packer, const_cast<Value&>(value));
  std::uint64_t mark = kEndMark;
  visit(packer, mark);
  return std::move(packer.bytes);
}

template <class Value>
void finish(Unpacker& unpacker, Value& value) {
  visit(unpacker, value);
  std::uint64_t mark = 0;
  visit(unpacker, mark);
  if (mark != kEndMark) unpacker.fail();
  unpacker.finish();
}

template <class Result>
CadAnswer<Result> unpacked(JobKind kind, std::span<const std::byte> bytes, const std::string& where) {
  Unpacker unpacker(bytes, where, "is damaged: OpenCASCADE makes nothing sound of it");
  JobKind answered{};
  visit(unpacker, answered);
  if (answered != kind) unpacker.fail();
  CadAnswer<Result> answer;
  finish(unpacker, answer);
  return answer;
}

struct Words {
  const char* verb;      // "read it"
  const char* why;       // what a crash says
  const char* too_much;  // what a limit says
};

Bytes run(const Bytes& job, const ChildLimits& limits, const std::string& where, const Words& words,
          const std::string& instead) {
#ifndef FLEXEL_STEP
  throw InputError(where,
                   "is a CAD file, and this build has no OpenCASCADE: configure with -DFLEXEL_STEP=ON (needs "
                   "OpenCASCADE 7.6.3), or export the part as STL");
#endif
  const std::string program = own_program("flexel-cad");
  ChildOutput output = run_limited(program, job, limits);
  switch (output.end) {
    case ChildEnd::finished:
      break;
    case ChildEnd::not_started:
      throw InputError(
          fmt::format("{} does not start, or is of another version: install Flexel and OpenCASCADE 7.6.3 "
                      "again",
                      program));
    case ChildEnd::crashed:
      throw InputError(where, fmt::format("{}: OpenCASCADE cannot {}", words.why, words.verb));
    case ChildEnd::out_of_time:
      throw InputError(where,
                       fmt::format("{} for OpenCASCADE: it did not {} within {:.3g} s of processor time; {}",
                                   words.too_much, words.verb, limits.processor, instead));
    case ChildEnd::out_of_memory:
      throw InputError(where,
                       fmt::format("{} for OpenCASCADE: it wants more memory than it gets ({} at most); {}",
                                   words.too_much, human_bytes(limits.memory), instead));
  }
  return std::move(output.bytes);
}

// Passes on what it said.
template <class Result>
Result result_of(CadAnswer<Result> answer, const std::string& where,
                 const std::function<void(const std::string&)>& warn) {
  if (warn)
    for (const std::string& line : answer.warnings) warn(line);
  if (answer.refused) throw InputError(answer.where.empty() ? where : answer.where, answer.why);
  return std::move(answer.result);
}

}  // namespace

Bytes pack(const CadReadJob& job) {
  return packed(JobKind::read, job);
}
Bytes pack(const CadWriteJob& job) {
  return packed(JobKind::write, job);
}
Bytes pack(const CadAnswer<CadMesh>& answer) {
  return packed(JobKind::read, answer);
}
Bytes pack(const CadAnswer<CadWritten>& answer) {
  return packed(JobKind::write, answer);
}

CadAnswer<CadMesh> unpack_mesh(std::span<const std::byte> bytes, const std::string& where) {
  auto answer = unpacked<CadMesh>(JobKind::read, bytes, where);
  const CadMesh& mesh = answer.result;
  if (!mesh.face_colors.empty() && mesh.face_colors.size() != 3 * mesh.surface.faces.size())
    throw InputError(where, "is damaged: OpenCASCADE makes nothing sound of it");
  return answer;
}

CadAnswer<CadWritten> unpack_written(std::span<const std::byte> bytes, const std::string& where) {
  return unpacked<CadWritten>(JobKind::write, bytes, where);
}

CadJob unpack_job(std::span<const std::byte> bytes) {
  Unpacker unpacker(bytes, "stdin", "is no job: flexel-cad is run by the other programs only");
  JobKind kind{};
  visit(unpacker, kind);
  CadJob job;
  if (kind == JobKind::read)
    finish(unpacker, job.read.emplace());
  else if (kind == JobKind::write)
    finish(unpacker, job.write.emplace());
  else
    unpacker.fail();
  return job;
}

CadMesh run_job(const CadReadJob& job, const ChildLimits& limits, const std::string& instead,
                const std::function<void(const std::string&)>& warn) {
  const Bytes answer =
      run(pack(job), limits, job.where, {"read it", "is damaged", "is damaged, or too much"}, instead);
  return result_of(unpack_mesh(answer, job.where), job.where, warn);
}

CadWritten run_job(const CadWriteJob& job, const ChildLimits& limits, const std::string& where,
                   const std::function<void(const std::string&)>& warn) {
  const Bytes answer = run(pack(job), limits, where,
                           {"deform it", "its surfaces cannot be deformed", "its surfaces are too much"},
                           "a larger --tolerance takes less, or write a mesh (STL, OBJ, ...)");
  return result_of(unpack_written(answer, where), where, warn);
}

}  // namespace flexel
