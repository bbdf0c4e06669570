#include "base/files/outputs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/hidden_file.h"
#include "base/files/output_file.h"
#include "base/files/pipe_code.h"
#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::string text_of(const std::string& path) {
  const Bytes bytes = read_all(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(Outputs, OneFileByTwoNamesIsFound) {
  const Scratch scratch;
  const std::string part = scratch.write("part.stl", "solid");
  std::filesystem::create_hard_link(part, scratch.path("same.stl"));
  std::filesystem::create_symlink("part.stl", scratch.path("link.stl"));
  for (const char* name : {"part.stl", "same.stl", "link.stl", "./part.stl"})
    EXPECT_THAT([&] { check_outputs({{scratch.path(name)}}, {part}, false); },
                ThrowsMessage<InputError>(HasSubstr("is an input of this command")));
  EXPECT_NO_THROW(check_outputs({{part}}, {part}, true));
  EXPECT_NO_THROW(check_outputs({{scratch.path("new.stl")}, {""}}, {part, "-", ""}, false));
  // files that are not there yet, one through a link
  std::filesystem::create_symlink("new.stl", scratch.path("to-new.stl"));
  EXPECT_THAT(
      [&] {
        check_outputs({{scratch.path("new.stl")}, {scratch.path("to-new.stl")}}, {}, true);
      },
      ThrowsMessage<InputError>(HasSubstr("two results would go to")));
  EXPECT_NO_THROW(check_outputs({{"/dev/null"}, {"/dev/null"}, {"{part}.stl"}, {"{part}.stl"}}, {}, false));
  EXPECT_THAT(
      [&] {
        check_outputs({{"-"}, {"/dev/stdout"}}, {}, true);
      },
      ThrowsMessage<InputError>(HasSubstr("two results would go to stdout")));
}

TEST(Outputs, NamesOfManyFilesKeepInputs) {
  const Scratch scratch;
  const auto refused = [&](const char* output, const std::string& input) {
    try {
      check_outputs({{scratch.path(output)}}, {input}, false);
    } catch (const InputError& error) {
      return std::string(error.what()).find("is an input of this command") != std::string::npos;
    }
    return false;
  };
  const std::string frame = scratch.write("a[1]*_00012.vtu", ""),
                    other = scratch.write("a[1]*_00012b.vtu", "");
  EXPECT_TRUE(refused("a[1]*.pvd", frame));
  EXPECT_TRUE(refused("a[1]*.PVD", frame));
  EXPECT_TRUE(refused("a[1]*_{frame}.vtu", frame));
  EXPECT_TRUE(refused("{part}.vtu", frame));
  // a program that takes braces as they are
  EXPECT_NO_THROW(check_outputs({{scratch.path("a[1]*_{frame}.vtu"), false, true}}, {frame}, false));
  EXPECT_NO_THROW(check_outputs({{scratch.path("{part}.pvd"), false, true}}, {frame}, false));
  EXPECT_FALSE(refused("a[1]*.pvd", other));
  EXPECT_FALSE(refused("a[1]x.pvd", frame));
  EXPECT_FALSE(refused("{part}.stl", frame));
  EXPECT_NO_THROW(check_outputs({{scratch.path("a[1]*.pvd")}}, {frame}, true));
  std::filesystem::create_hard_link(other, scratch.path("b_1.vtu"));
  EXPECT_TRUE(refused("b.pvd", other));
  EXPECT_TRUE(refused("b.pvd", scratch.path("./b_1.vtu")));
  std::filesystem::create_symlink("a[1]*_00012.vtu", scratch.path("c_00000.vtu"));
  EXPECT_TRUE(refused("c.pvd", frame));
}

TEST(Outputs, AppearTogetherOrNotAtAll) {
  const Scratch scratch;
  const std::string first = scratch.write("first", "old"), second = scratch.path("second");
  {
    OutputsTogether outputs({first, second});
    write_text("new", first);
    write_text("alone", scratch.path("frame"));
    EXPECT_EQ(text_of(scratch.path("frame")), "alone") << "it is none of them";
    EXPECT_EQ(text_of(first), "old");
  }
  EXPECT_EQ(text_of(first), "old");
  const auto files = [&] {
    return std::distance(std::filesystem::directory_iterator(std::filesystem::path(first).parent_path()),
                         std::filesystem::directory_iterator());
  };
  EXPECT_EQ(files(), 2) << "no temporary file is left";
  OutputsTogether outputs({first, second});
  write_text("new", first);
  write_text("other", second);
  EXPECT_FALSE(std::filesystem::exists(second));
  outputs.appear();
  EXPECT_EQ(text_of(first), "new");
  EXPECT_EQ(text_of(second), "other");
}

std::size_t files_in(const std::string& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

TEST(Outputs, WhatAppearedGoesAgainWhereOneCannot) {
  const Scratch scratch;
  const std::string first = scratch.write("first", "old"), second = scratch.path("second"),
                    folder = scratch.path("folder"), third = folder + "/third";
  std::filesystem::create_directory(folder);
  {
    OutputsTogether outputs({first, second, third});
    for (const std::string& path : {first, second, third}) write_text("new", path);
    std::filesystem::remove_all(folder);
    EXPECT_THROW(outputs.appear(), InputError);
  }
  EXPECT_EQ(text_of(first), "old");
  EXPECT_FALSE(std::filesystem::exists(second));
  EXPECT_EQ(files_in(std::filesystem::path(first).parent_path()), 1) << "no temporary file is left";
}

TEST(Outputs, PiecesAppearWithTheOthers) {
  const Scratch scratch;
  OutputsTogether outputs({scratch.path("{part}.stl"), scratch.path("report")});
  write_text("a", scratch.path("a.stl"));
  write_text("b", scratch.path("b.obj"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path("a.stl")));
  EXPECT_TRUE(std::filesystem::exists(scratch.path("b.obj")));
  outputs.appear();
  EXPECT_EQ(text_of(scratch.path("a.stl")), "a");
}

// A child that ends at once has a number that no process has.
pid_t number_of_none() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  EXPECT_EQ(waitpid(child, nullptr, 0), child);
  return child;
}

TEST(HiddenFile, ThoseOfKilledRunsGo) {
  const Scratch scratch;
  const std::string gone = fmt::format(".out.stl.{}-0.tmp", number_of_none()),
                    alive = fmt::format(".out.stl.{}-7.tmp", getppid());
  const std::vector<std::string> others{alive,
                                        gone + "x",
                                        "." + gone,
                                        ".out.stl.tmp",
                                        ".out.stl.12a-0.tmp",
                                        ".out.stl.-1-0.tmp",
                                        fmt::format(".other.stl.{}-0.tmp", number_of_none())};
  for (const std::string& name : others) scratch.write(name, "");
  const std::string held = scratch.write(fmt::format(".out.stl.{}-1.tmp", number_of_none()), "");
  const int descriptor = open(held.c_str(), O_RDWR);
  hold_hidden(descriptor);
  scratch.write(gone, "half");
  const std::string recent = scratch.write(fmt::format(".out.stl.{}-2.tmp", number_of_none()), "half");
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(2);
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path(".")))
    if (entry.path().filename() != std::filesystem::path(recent).filename())
      std::filesystem::last_write_time(entry, old);
  write_text("whole", scratch.path("out.stl"));
  EXPECT_TRUE(std::filesystem::exists(recent)) << "of a run that may be elsewhere";
  EXPECT_FALSE(std::filesystem::exists(scratch.path(gone)));
  EXPECT_TRUE(std::filesystem::exists(held)) << "another machine writes it";
  for (const std::string& name : others) EXPECT_TRUE(std::filesystem::exists(scratch.path(name))) << name;
  close(descriptor);
}

TEST(Outputs, GoToMemoryToo) {
  Bytes bytes;
  OutputFile file(bytes);
  file.write("body");
  file.commit();
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), "body");
}

TEST(PipeCode, IsToldByThePipeAlone) {
  for (const int code : {1, 2, 3, 5, 130, 139}) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    EXPECT_EQ(code_told_through_pipe(ends[0]), std::nullopt);
    tell_code_through_pipe(ends[1], code);
    close(ends[1]);
    EXPECT_EQ(code_told_through_pipe(ends[0]), code);
    char byte = 0;
    EXPECT_EQ(read(ends[0], &byte, 1), 0) << "nothing is in it";
    close(ends[0]);
  }
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  tell_code_through_pipe(ends[1], 0);
  tell_code_through_pipe(ends[1], 4);
  EXPECT_EQ(code_told_through_pipe(ends[0]), std::nullopt);
  close(ends[0]);
  close(ends[1]);
  EXPECT_EQ(code_told_through_pipe(-1), std::nullopt);
}

}  // namespace
}  // namespace flexel::test
