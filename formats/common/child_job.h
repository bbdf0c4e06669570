// Work that another program of ours does, because it needs a large library that may crash, loop or take all memory over
// a damaged file: a job on that program's stdin, its answer on stdout, with limits. Both are one build, so values go as
// they are in memory; what is read is not believed all the same.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/files/packing.h"
#include "base/program/limited_child.h"
#include "formats/part/surface.h"

namespace flexel {

using Warn = std::function<void(const std::string&)>;
// How much of a job is done, in [0, 1].
using TellShare = std::function<void(double share)>;

struct ForeignProgram {
  const char* name;     // "flexel-cad"
  const char* foreign;  // for messages: "OpenCASCADE"
  const char* install;  // what to install where it does not start: "OpenCASCADE 7.6.3"
};

// An answer, or why there is none.
template <class Result>
struct JobAnswer {
  std::vector<std::string> warnings;
  bool refused = false;
  bool failed = false;     // by a fault of the program, not of what it was given
  std::string where, why;  // of an InputError, where it is refused; of a fault, where it failed
  Result result;           // else
};

template <class Archive, class Result>
void visit(Archive& archive, JobAnswer<Result>& answer) {
  visit_all(archive, answer.warnings, answer.refused, answer.failed, answer.where, answer.why, answer.result);
}

template <class Archive>
void visit(Archive& archive, SurfacePart& part) {
  visit_all(archive, part.name, part.assembly);
}

template <class Archive>
void visit(Archive& archive, SurfaceFace& face) {
  visit_all(archive, face.name, face.part);
}

// Vertices, polygons, faces and parts: no columns, no sources.
template <class Archive>
void visit_mesh(Archive& archive, Surface& surface) {
  visit_all(archive, surface.vertices, surface.polygon_offsets, surface.polygon_vertices,
            surface.polygon_face, surface.faces, surface.parts);
}

constexpr std::uint64_t kJobEnd = 0x666c6578656c3031;

// A job or an answer of some kind (any number) as bytes.
template <class Value>
[[nodiscard]] Bytes packed(std::uint64_t kind, const Value& value) {
  Packer packer;
  visit(packer, kind);
  visit(packer, const_cast<Value&>(value));
  std::uint64_t end = kJobEnd;
  visit(packer, end);
  return std::move(packer.bytes);
}

// The kind of what packed() made, read first.
[[nodiscard]] inline std::uint64_t kind_of(Unpacker& unpacker) {
  std::uint64_t kind = 0;
  visit(unpacker, kind);
  return kind;
}

// Its value, after the kind.
template <class Value>
void finish(Unpacker& unpacker, Value& value) {
  visit(unpacker, value);
  std::uint64_t end = 0;
  visit(unpacker, end);
  if (end != kJobEnd) unpacker.fail();
  unpacker.finish();
}

// What to say where a job fails.
struct JobWords {
  const char* verb;      // "read it"
  const char* why;       // what a crash says: "is damaged"
  const char* too_much;  // what a limit says: "is damaged, or too much"
  std::string instead;   // what to do where the limits are passed
};

// The bytes of the answer. Throws InputError: the program is not there or does not start; InputError(where, ...): it
// crashes, or takes more than the limits. `hear`: called on this thread with the shares that the program tells.
[[nodiscard]] Bytes run_job(const ForeignProgram& program, const Bytes& job, const ChildLimits& limits,
                            const std::string& where, const JobWords& words, const TellShare& hear = {});

// Splits what came back: the shares that were told, whose last goes to `hear`, and the answer after them.
[[nodiscard]] Bytes answer_in(Bytes output, const TellShare& hear);

// Passes on what the answer says: calls `warn`, throws its InputError, or std::runtime_error where the program failed.
template <class Result>
[[nodiscard]] Result result_of(JobAnswer<Result> answer, const std::string& where, const Warn& warn) {
  if (warn)
    for (const std::string& line : answer.warnings) warn(line);
  if (answer.failed) throw std::runtime_error(where + ": " + answer.why);
  if (answer.refused) throw InputError(answer.where.empty() ? where : answer.where, answer.why);
  return std::move(answer.result);
}

// In the other program: what `work` makes of the job with somewhere to warn, or its InputError.
template <class Result, class Work>
[[nodiscard]] JobAnswer<Result> answer_of(const Work& work) {
  JobAnswer<Result> answer;
  try {
    answer.result = work([&](const std::string& line) { answer.warnings.push_back(line); });
  } catch (const InputError& error) {
    answer.refused = true;
    answer.where = error.where();
    answer.why = error.what();
  }
  return answer;
}

// There too: reads the job, writes what `work` makes of it, and returns the exit status (ChildCode). Stdout is
// the answer's alone: what a library prints there is dropped. `work` may tell, from any thread, how much it has done.
[[nodiscard]] int serve_job(const char* program,
                            const std::function<Bytes(const Bytes& job, const TellShare& tell)>& work);

}  // namespace flexel
