// The two ends of a job.
#include "formats/common/child_job.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>
#include <utility>

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

// Before the answer come shares: of each this, in one write, which a pipe keeps together. No kind of answer is the same.
struct ShareRecord {
  std::uint64_t kind = 0x666c65786c736801;
  double share = 0;
};

// The bytes of all whole records at the beginning; `share` gets that of the last.
std::size_t read_shares(const Bytes& bytes, double& share) {
  std::size_t at = 0;
  for (ShareRecord record; bytes.size() - at >= sizeof record; at += sizeof record) {
    std::memcpy(&record, bytes.data() + at, sizeof record);
    if (record.kind != ShareRecord().kind) break;
    share = record.share;
  }
  return at;
}

// Writes shares to `out`, a hundred at most.
class ShareWriter {
 public:
  explicit ShareWriter(int out) : out_(out) {}
  void write(double share) {
    constexpr double kStep = 0.01;
    const std::lock_guard lock(mutex_);
    if (!(share <= 1) || share < last_ + kStep) return;
    last_ = share;
    ShareRecord record;
    record.share = share;
    if (::write(out_, &record, sizeof record) < 0) last_ = 1;  // nobody reads
  }

 private:
  int out_;
  std::mutex mutex_;
  double last_ = 0;
};

}  // namespace

Bytes answer_in(Bytes output, const TellShare& hear) {
  double share = 0;
  const std::size_t shares = read_shares(output, share);
  if (shares == 0) return output;
  if (hear) hear(share);
  // in place: an answer may be large
  output.erase(output.begin(), output.begin() + static_cast<std::ptrdiff_t>(shares));
  return output;
}

Bytes run_job(const ForeignProgram& program, const Bytes& job, const ChildLimits& limits,
              const std::string& where, const JobWords& words, const TellShare& hear) {
  const std::string path = own_program(program.name);
  HearOutput hear_output;
  if (hear)
    hear_output = [&](const Bytes& so_far) {
      double share = 0;
      if (read_shares(so_far, share) > 0) hear(share);
    };
  ChildOutput output = run_limited(path, job, limits, hear_output);
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
  return answer_in(std::move(output.bytes), hear);
}

int serve_job(const char* program,
              const std::function<Bytes(const Bytes& job, const TellShare& tell)>& work) {
  const int out = take_stdout();
  ShareWriter shares(out);
  try {
    return write_whole(out, work(read_all("-"), [&](double share) { shares.write(share); })) ? kChildFinished
                                                                                             : kChildFailed;
  } catch (const std::bad_alloc&) {
    return kChildWithoutMemory;
  } catch (const InputError& error) {
    std::fprintf(stderr, "%s: error: %s\n", program, error.what());
    return kChildNotStarted;
  }
}

}  // namespace flexel
