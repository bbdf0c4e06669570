// The process in which OpenCASCADE runs, and what it hands back.
#include "formats/cad/reading_child.h"

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <stdexcept>
#include <thread>

#include "base/error.h"
#include "base/stop.h"
#include "formats/cad/cad_reading.h"

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

TEST(ReadingChild, WhatItReturnsComesBackWhole) {
  const Bytes bytes = some_bytes(3'000'001);
  const ChildOutput output = run_in_child([&] { return bytes; }, {});
  EXPECT_EQ(output.end, ChildEnd::finished);
  EXPECT_EQ(output.bytes, bytes);
  expect_no_child();
}

TEST(ReadingChild, EveryCrashIsOneOutcome) {
  const std::atomic<int> depth = 1;
  const std::vector<std::function<Bytes()>> crashes = {
      [] { return std::raise(SIGSEGV), Bytes(); },
      [] { return std::raise(SIGFPE), Bytes(); },
      [] { return std::abort(), Bytes(); },
      [] { return std::thread([] { throw std::runtime_error("in a thread"); }).join(), Bytes(); },
      []() -> Bytes { throw std::runtime_error("of the library"); },
      [&] { return Bytes(static_cast<std::size_t>(recurse(depth))); }};
  for (std::size_t i = 0; i < crashes.size(); ++i)
    EXPECT_EQ(run_in_child(crashes[i], {}).end, ChildEnd::crashed) << i;
  expect_no_child();
}

TEST(ReadingChild, TimeAndMemoryAreLimited) {
  const auto spins = [] {
    for (std::atomic<int> i = 0; i >= 0;) i = 1;
    return Bytes();
  };
  EXPECT_EQ(run_in_child(spins, {.processor = 0.1, .wall = 60}).end, ChildEnd::out_of_time);
  const auto sleeps = [] {
    while (true) pause();
    return Bytes();
  };
  EXPECT_EQ(run_in_child(sleeps, {.processor = 60, .wall = 0.2}).end, ChildEnd::out_of_time);
#ifndef __SANITIZE_ADDRESS__
  const auto grows = [] {
    std::vector<Bytes> all;
    while (true) all.push_back(some_bytes(10'000'000));
    return Bytes();
  };
  EXPECT_EQ(run_in_child(grows, {.memory = 1e8}).end, ChildEnd::out_of_memory);
#endif
  expect_no_child();
}

TEST(ReadingChild, ALimitOfTheRunEndsIt) {
  const auto sleeps = [] {
    while (true) pause();
    return Bytes();
  };
  const StopAfter limit(0.1, "--timeout");
  EXPECT_THROW(static_cast<void>(run_in_child(sleeps, {})), TimeoutError);
  expect_no_child();
}

CadReading some_reading() {
  CadReading reading;
  reading.warnings = {"one", "two"};
  Surface& surface = reading.mesh.surface;
  surface.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  surface.polygon_offsets = {0, 3};
  surface.polygon_vertices = {0, 1, 2};
  surface.polygon_face = {0};
  surface.faces = {{"face", 0}};
  surface.parts = {{"part"}};
  reading.mesh.face_colors = {0.1, 0.2, 0.3};
  return reading;
}

TEST(CadReading, ComesBackAsItWas) {
  const CadReading reading = some_reading(), back = unpack_reading(pack(reading), "a.step");
  EXPECT_EQ(back.warnings, reading.warnings);
  EXPECT_FALSE(back.refused);
  EXPECT_EQ(back.mesh.surface.vertices, reading.mesh.surface.vertices);
  EXPECT_EQ(back.mesh.surface.polygon_offsets, reading.mesh.surface.polygon_offsets);
  EXPECT_EQ(back.mesh.surface.polygon_vertices, reading.mesh.surface.polygon_vertices);
  EXPECT_EQ(back.mesh.surface.polygon_face, reading.mesh.surface.polygon_face);
  EXPECT_EQ(back.mesh.surface.faces.at(0).name, "face");
  EXPECT_EQ(back.mesh.surface.parts.at(0).name, "part");
  EXPECT_EQ(back.mesh.face_colors, reading.mesh.face_colors);
  CadReading no;
  no.refused = true;
  no.where = "a.step";
  no.why = "is damaged";
  const CadReading refused = unpack_reading(pack(no), "a.step");
  EXPECT_TRUE(refused.refused);
  EXPECT_EQ(refused.where + refused.why, "a.stepis damaged");
}

TEST(CadReading, BytesThatAreNoneAreRefused) {
  const Bytes bytes = pack(some_reading());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(static_cast<void>(unpack_reading({bytes.data(), size}, "a.step")), InputError) << size;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    Bytes changed = bytes;
    changed[at] = std::byte{0xff};
    try {
      static_cast<void>(unpack_reading(changed, "a.step"));  // a number of its own may be anything
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace flexel::test
