#include "base/files/files.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "base/error.h"
#include "base/files/output_file.h"

namespace flexel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Files : public testing::Test {
 protected:
  Files() {
    folder_ = fs::temp_directory_path() / ("flexel-files-" + std::to_string(getpid()) + "-" +
                                           testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  ~Files() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

std::string text_of(const std::string& path) {
  const Bytes bytes = read_all(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void write_whole_text(const std::string& path, const std::string& text) {
  OutputFile output(path);
  output.write(text);
  output.commit();
}

// What `action` throws; "" where it throws nothing.
template <class Action>
std::string failure(const Action& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.where() + ": " + error.what();
  }
  return "";
}

TEST_F(Files, WhatIsWrittenInPiecesIsReadWhole) {
  std::mt19937_64 random(1);
  for (const std::size_t size :
       {std::size_t{1}, std::size_t{1000}, std::size_t{1} << 20, (std::size_t{3} << 20) + 7}) {
    std::string text(size, 0);
    for (char& c : text) c = static_cast<char>(random());
    OutputFile output(path("a"));
    for (std::size_t at = 0; at < size;) {
      const std::size_t piece =
          std::min<std::size_t>(size - at, 1 + random() % (random() % 2 == 0 ? 100000 : 2000000));
      output.write(text.data() + at, piece);
      at += piece;
    }
    EXPECT_FALSE(fs::exists(path("a")));
    output.commit();
    EXPECT_EQ(text_of(path("a")), text);
    EXPECT_EQ(entries(), 1u);
    fs::remove(path("a"));
  }
}

TEST_F(Files, WithoutCommitNothingIsLeftAndTheOldFileStays) {
  write_whole_text(path("a"), "old");
  {
    OutputFile output(path("a"));
    output.write("new");
  }
  EXPECT_EQ(text_of(path("a")), "old");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, LinksAreFollowedNotReplaced) {
  fs::create_directories(path("real"));
  write_whole_text(path("real/target"), "old");
  fs::create_symlink("real/target", path("link"));
  fs::create_symlink("link", path("link2"));
  fs::create_symlink("real/not-yet", path("dangling"));
  write_whole_text(path("link2"), "new");
  write_whole_text(path("dangling"), "made");
  EXPECT_TRUE(fs::is_symlink(path("link2")));
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(text_of(path("real/target")), "new");
  EXPECT_EQ(text_of(path("real/not-yet")), "made");
  fs::create_symlink("round", path("round"));
  EXPECT_NE(failure([&] { write_whole_text(path("round"), "x"); }), "");
}

TEST_F(Files, DevicesAndFifosAreWrittenThrough) {
  write_whole_text("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
  std::string seen;
  std::thread reader([&] { seen = text_of(path("fifo")); });
  write_whole_text(path("fifo"), "through");
  reader.join();
  EXPECT_EQ(seen, "through");
  EXPECT_TRUE(fs::is_fifo(path("fifo")));
}

TEST_F(Files, AFullDiskIsSaidAndLeavesNothing) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const std::string message = failure([] { write_whole_text("/dev/full", std::string(3 << 20, 'x')); });
  EXPECT_THAT(message, HasSubstr("/dev/full: cannot write: No space left on device"));
  EXPECT_NE(failure([] { write_whole_text("/dev/full", "x"); }), "")
      << "an error that only the last flush sees";
}

TEST_F(Files, AFileThatOutgrowsTheLimitIsRemoved) {
  // The limit on file sizes stands in for a disk that fills up while it is written.
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit = {1 << 20, 1 << 20};
    setrlimit(RLIMIT_FSIZE, &limit);
    const std::string message = failure([&] { write_whole_text(path("big"), std::string(3 << 20, 'x')); });
    _exit(message.find("File too large") != std::string::npos ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(entries(), 0u);
}

TEST_F(Files, AReaderThatLeftIsNoError) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  close(ends[0]);  // before the writer begins: the pipe could hold all that it writes
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGPIPE, SIG_IGN);
    dup2(ends[1], STDOUT_FILENO);
    close(ends[1]);
    try {
      write_whole_text("-", std::string(1 << 20, 'x'));
    } catch (const ReaderClosedPipe&) {
      _exit(0);
    }
    _exit(1);
  }
  close(ends[1]);
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_F(Files, PermissionsAreThoseOfANormalFile) {
  const mode_t before = umask(027);
  write_whole_text(path("a"), "x");
  umask(before);
  EXPECT_EQ(fs::status(path("a")).permissions(), static_cast<fs::perms>(0640));
  fs::permissions(path("a"), static_cast<fs::perms>(0755));
  write_whole_text(path("a"), "y");
  EXPECT_EQ(fs::status(path("a")).permissions(), static_cast<fs::perms>(0755)) << "overwriting keeps them";
}

TEST_F(Files, WhatCannotBeReadOrWrittenIsNamed) {
  const auto reading = [&](const std::string& p) { return failure([&] { (void)read_all(p); }); };
  std::ofstream(path("empty"));
  EXPECT_EQ(reading(path("none")), path("none") + ": cannot read: No such file or directory");
  EXPECT_EQ(reading(path("empty")), path("empty") + ": is empty");
  EXPECT_THAT(reading(folder_.string()), HasSubstr("is a folder"));
  const auto writing = [&](const std::string& p) { return failure([&] { write_whole_text(p, "x"); }); };
  EXPECT_THAT(writing(folder_.string()), HasSubstr("is a folder"));
  EXPECT_EQ(writing(path("no/where")), path("no/where") + ": cannot write: No such file or directory");
  EXPECT_NE(writing(""), "");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, LongNamesFit) {
  const std::string name(250, 'n');
  write_whole_text(path(name), "x");
  EXPECT_EQ(text_of(path(name)), "x");
}

TEST_F(Files, NamesOfFiles) {
  EXPECT_EQ(extension("/a.b/part.STL"), "stl");
  EXPECT_EQ(extension("/a.b/part"), "");
  EXPECT_EQ(extension("part.tar.gz"), "gz");
  EXPECT_EQ(stem("/a.b/part.STL"), "part");
  EXPECT_EQ(stem("part"), "part");
}

TEST(Compression, RoundTripAndDamage) {
  std::mt19937_64 random(3);
  for (const std::size_t size : {0, 1, 1000, 300000}) {
    Bytes data(size);
    for (std::byte& byte : data) byte = static_cast<std::byte>(random() % 5);
    const Bytes packed = compress(data);
    EXPECT_EQ(decompress(packed, size), data);
    EXPECT_THROW((void)decompress(packed, size + 1), InputError);
    if (size > 0) {
      EXPECT_THROW((void)decompress(packed, size - 1), InputError);
      EXPECT_THROW((void)decompress(std::span(packed).first(packed.size() - 1), size), InputError);
    }
    EXPECT_THROW((void)decompress(packed, std::size_t{1} << 60), InputError)
        << "refused before it is allocated";
  }
}

TEST(ContentHash, IsFnv1a) {
  // Published values (Fowler, Noll, Vo; draft-eastlake-fnv).
  const auto hash = [](const std::string& text) {
    return content_hash(std::as_bytes(std::span(text.data(), text.size())));
  };
  EXPECT_EQ(hash(""), 0xcbf29ce484222325u);
  EXPECT_EQ(hash("a"), 0xaf63dc4c8601ec8cu);
  EXPECT_EQ(hash("foobar"), 0x85944171f73967e8u);
}

}  // namespace
}  // namespace flexel
