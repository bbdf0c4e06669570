// The two ends of a job.
#include "formats/common/child_job.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <new>

#include "base/error.h"
#include "base/files/memory_file.h"
#include "base/program/own_program.h"
#include "base/resources.h"
#include "base/units.h"

namespace flexel {
namespace {

// The answer's descriptor; stdout leads nowhere from then on.
int take_stdout() {
  const int out = dup(STDOUT_FILENO), nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nothing >= 0) dup2(nothing, STDOUT_FILENO);
  return out;
}

}  // namespace

Bytes run_job(const ForeignProgram& program, const Bytes& job, const ChildLimits& limits,
              const std::string& where, const JobWords& words) {
  const std::string path = own_program(program.name);
  ChildOutput output = run_limited(path, job, limits);
  switch (output.end) {
    case ChildEnd::finished:
      break;
    case ChildEnd::not_started:
      throw InputError(fmt::format("{} does not start, or is of another version: install Flexel and {} again",
                                   path, program.install));
    case ChildEnd::crashed:
      throw InputError(where, fmt::format("{}: {} cannot {}", words.why, program.foreign, words.verb));
    case ChildEnd::out_of_time:
      throw InputError(
          where, fmt::format("{} for {}: it did not {} within {:.3g} s of processor time; {}", words.too_much,
                             program.foreign, words.verb, limits.processor, words.instead));
    case ChildEnd::out_of_memory:
      if (std::isfinite(memory_limit()) && limits.memory <= memory_limit())
        throw InputError(where, fmt::format("{} did not {} within --max-memory {}: raise it", program.foreign,
                                            words.verb, human_bytes(memory_limit())));
      throw InputError(
          where, fmt::format("{} for {}: it wants more memory than it gets ({} at most); {}", words.too_much,
                             program.foreign, human_bytes(limits.memory), words.instead));
  }
  return std::move(output.bytes);
}

int serve_job(const char* program, const std::function<Bytes(const Bytes& job)>& work) {
  const int out = take_stdout();
  try {
    return write_whole(out, work(read_all("-"))) ? kChildFinished : kChildFailed;
  } catch (const std::bad_alloc&) {
    return kChildWithoutMemory;
  } catch (const InputError& error) {
    std::fprintf(stderr, "%s: error: %s\n", program, error.what());
    return kChildNotStarted;
  }
}

}  // namespace flexel
