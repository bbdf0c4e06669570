#include "base/files/outputs.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "base/error.h"
#include "base/files/files.h"
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
