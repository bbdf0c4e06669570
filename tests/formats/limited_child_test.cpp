// The process in which OpenCASCADE runs, and what it hands back.
#include "base/program/limited_child.h"

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "base/error.h"
#include "base/files/memory_file.h"
#include "base/stop.h"
#include "formats/cad/cad_job.h"
#include "tests/sanitized.h"

namespace flexel::test {
namespace {

Bytes some_bytes(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * i);
  return bytes;
}

// Recurses until the stack is full, unless `depth` is negative.
int recurse(const std::atomic<int>& depth) {
  std::array<std::atomic<int>, 256> room = {};
  room[0] = depth.load();
  return depth.load() < 0 ? 0 : room[0].load() + recurse(depth);
}

void expect_no_child() {
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

TEST(LimitedChild, WhatItReturnsComesBackWhole) {
  const Bytes bytes = some_bytes(3'000'001);
  const ChildOutput output = run_in_child(
      [&](int out) -> int {
        for (std::size_t done = 0; done < bytes.size();) {
          const ssize_t written = write(out, bytes.data() + done, bytes.size() - done);
          if (written <= 0) return kChildFailed;
          done += static_cast<std::size_t>(written);
        }
        return kChildFinished;
      },
      {});
  EXPECT_EQ(output.end, ChildEnd::finished);
  EXPECT_EQ(output.bytes, bytes);
  expect_no_child();
}

TEST(LimitedChild, WhatItWritesIsHeardMeanwhile) {
  std::vector<std::size_t> heard;
  const ChildOutput output = run_in_child(
      [](int out) -> int {
        const bool begun = write(out, "a", 1) == 1;
        usleep(400'000);
        return begun && write(out, "b", 1) == 1 ? kChildFinished : kChildFailed;
      },
      {}, [&](const Bytes& so_far) { heard.push_back(so_far.size()); });
  EXPECT_EQ(output.bytes.size(), 2u);
  EXPECT_THAT(heard, testing::Contains(1u));
  EXPECT_TRUE(std::is_sorted(heard.begin(), heard.end()));
}

TEST(ChildJob, SharesComeBeforeTheAnswerAndAreNoPartOfIt) {
  const Bytes answer = some_bytes(100'000);
  const MemoryFile job(some_bytes(10));
  const ChildOutput output = run_in_child(
      [&](int out) -> int {
        if (dup2(job.descriptor(), STDIN_FILENO) < 0 || dup2(out, STDOUT_FILENO) < 0) return kChildFailed;
        return serve_job("test", [&](const Bytes&, const TellShare& tell) {
          for (int n = 0; n <= 1000; ++n) tell(1e-3 * n);
          tell(std::nan(""));
          return answer;
        });
      },
      {});
  double heard = 0;
  EXPECT_EQ(answer_in(output.bytes, [&](double share) { heard = share; }), answer);
  EXPECT_NEAR(heard, 1, 0.02);
  EXPECT_GT(output.bytes.size(), answer.size());
  EXPECT_LE(output.bytes.size(), answer.size() + 100 * 16) << "a share a percent is enough";
  EXPECT_EQ(answer_in(answer, {}), answer);
}

TEST(LimitedChild, EveryCrashIsOneOutcome) {
  const std::atomic<int> depth = 1;
  const std::vector<std::function<int(int)>> crashes = {
      [](int) { return std::raise(SIGSEGV); },
      [](int) { return std::raise(SIGFPE); },
      [](int) { return std::abort(), 0; },
      [](int) { return std::thread([] { throw std::runtime_error("in a thread"); }).join(), 0; },
      [](int) -> int { throw std::runtime_error("of the library"); },
      [&](int) { return recurse(depth); }};
  for (std::size_t i = 0; i < crashes.size(); ++i)
    EXPECT_EQ(run_in_child(crashes[i], {}).end, ChildEnd::crashed) << i;
  expect_no_child();
}

TEST(LimitedChild, TimeAndMemoryAreLimited) {
  const auto spins = [](int) -> int {
    for (std::atomic<int> i = 0; i >= 0;) i = 1;
    return kChildFinished;
  };
  EXPECT_EQ(run_in_child(spins, {.processor = 0.1, .wall = 60}).end, ChildEnd::out_of_time);
  const auto sleeps = [](int) -> int {
    while (true) pause();
    return kChildFinished;
  };
  EXPECT_EQ(run_in_child(sleeps, {.processor = 60, .wall = 0.2}).end, ChildEnd::out_of_time);
  const auto grows = [](int) -> int {
    std::vector<Bytes> all;
    while (true) all.push_back(some_bytes(10'000'000));
    return kChildFinished;
  };
  // A sanitizer's shadow is more than any limit.
  if (!sanitized()) {
    EXPECT_EQ(run_in_child(grows, {.memory = 1e8}).end, ChildEnd::out_of_memory);
  }
  expect_no_child();
}

TEST(LimitedChild, ALimitOfTheRunEndsIt) {
  const auto sleeps = [](int) -> int {
    while (true) pause();
    return kChildFinished;
  };
  const StopAfter limit(0.1, "--timeout");
  EXPECT_THROW(static_cast<void>(run_in_child(sleeps, {})), TimeoutError);
  expect_no_child();
}

JobAnswer<CadMesh> some_answer() {
  JobAnswer<CadMesh> answer;
  answer.warnings = {"one", "two"};
  Surface& surface = answer.result.surface;
  surface.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  surface.polygon_offsets = {0, 3};
  surface.polygon_vertices = {0, 1, 2};
  surface.polygon_face = {0};
  surface.faces = {{"face", 0}};
  surface.parts = {{"part"}};
  answer.result.face_colors = {0.1, 0.2, 0.3};
  return answer;
}

TEST(CadJob, AnAnswerComesBackAsItWas) {
  const JobAnswer<CadMesh> answer = some_answer(), back = unpack_mesh(pack(answer), "a.step");
  const Surface &surface = answer.result.surface, &read = back.result.surface;
  EXPECT_EQ(back.warnings, answer.warnings);
  EXPECT_FALSE(back.refused);
  EXPECT_EQ(read.vertices, surface.vertices);
  EXPECT_EQ(read.polygon_offsets, surface.polygon_offsets);
  EXPECT_EQ(read.polygon_vertices, surface.polygon_vertices);
  EXPECT_EQ(read.polygon_face, surface.polygon_face);
  EXPECT_EQ(read.faces.at(0).name, "face");
  EXPECT_EQ(read.parts.at(0).name, "part");
  EXPECT_EQ(back.result.face_colors, answer.result.face_colors);
  JobAnswer<CadMesh> no;
  no.refused = true;
  no.where = "a.step";
  no.why = "is damaged";
  const JobAnswer<CadMesh> refused = unpack_mesh(pack(no), "a.step");
  EXPECT_TRUE(refused.refused);
  EXPECT_EQ(refused.where + refused.why, "a.stepis damaged");
}

TEST(CadJob, AJobComesBackAsItWas) {
  CadReadJob read;
  read.format = "step";
  read.bytes = some_bytes(1000);
  read.where = "folder/a.step";
  read.deflection = 1e-4;
  read.threads = 3;
  const CadJob job = unpack_job(pack(read));
  ASSERT_TRUE(job.read && !job.write);
  EXPECT_EQ(job.read->format, read.format);
  EXPECT_EQ(job.read->bytes, read.bytes);
  EXPECT_EQ(job.read->where, read.where);
  EXPECT_EQ(job.read->deflection, read.deflection);
  EXPECT_EQ(job.read->threads, read.threads);
  CadWriteJob write;
  write.body = some_bytes(10);
  write.formats = {"step", "brep"};
  write.method = "blended";
  write.tolerance = 1e-4;
  const CadJob other = unpack_job(pack(write));
  ASSERT_TRUE(other.write && !other.read);
  EXPECT_EQ(other.write->body, write.body);
  EXPECT_EQ(other.write->formats, write.formats);
  EXPECT_EQ(other.write->method, write.method);
  EXPECT_EQ(other.write->tolerance, write.tolerance);
}

TEST(CadJob, BytesThatAreNoneAreRefused) {
  const Bytes bytes = pack(some_answer());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(static_cast<void>(unpack_mesh({bytes.data(), size}, "a.step")), InputError) << size;
  EXPECT_THROW(static_cast<void>(unpack_job(bytes)), InputError);
  EXPECT_THROW(static_cast<void>(unpack_written(bytes, "a.step")), InputError);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    Bytes changed = bytes;
    changed[at] = std::byte{0xff};
    try {
      static_cast<void>(unpack_mesh(changed, "a.step"));  // a number of its own may be anything
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace flexel::test
