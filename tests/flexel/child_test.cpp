// Child processes: what they say, need and leave, and how they are stopped.
#include "flexel/process/child.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "base/error.h"
#include "base/files/temporary_folder.h"

namespace flexel::commands {
namespace {

namespace fs = std::filesystem;

class Child : public testing::Test {
 protected:
  void SetUp() override { options_.log = folder_.path() / "log"; }
  ChildRun shell(const std::string& script) { return run_child({"/bin/sh", "-c", script}, options_); }
  [[nodiscard]] std::string said() const {
    std::ifstream in(options_.log);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  TemporaryFolder folder_;
  ChildOptions options_;
};

TEST_F(Child, IsMeasured) {
  const ChildRun run = shell("echo said; i=0; while [ $i -lt 20000 ]; do i=$((i+1)); done; exit 7");
  EXPECT_EQ(run.exit_code, 7);
  EXPECT_FALSE(run.out_of_time);
  EXPECT_GT(run.cpu, 0);
  EXPECT_GT(run.wall, 0);
  EXPECT_GT(run.memory, 100e3);
  EXPECT_EQ(said(), "said\n");
  EXPECT_EQ(shell("kill -9 $$").exit_code, 128 + 9);
}

TEST_F(Child, ThatCannotBeStartedIsTheUsersError) {
  EXPECT_THROW((void)run_child({"/no/such/program"}, options_), InputError);
  options_.log = folder_.path() / "no" / "log";
  EXPECT_THROW((void)shell("true"), InputError);
  options_.log = folder_.path() / "log";
  options_.folder = folder_.path() / "no";
  EXPECT_EQ(shell("true").exit_code, 127);
}

TEST_F(Child, RunsInItsFolderWithItsVariables) {
  ASSERT_EQ(setenv("FLEXEL_TEST_OURS", "ours", 1), 0);
  ASSERT_EQ(setenv("FLEXEL_TEST_OTHER", "ours", 1), 0);
  options_.folder = folder_.path();
  options_.environment = {"FLEXEL_TEST_OTHER=other"};
  EXPECT_EQ(
      shell("pwd -P; echo $FLEXEL_TEST_OURS $FLEXEL_TEST_OTHER; env | grep -c FLEXEL_TEST_OTHER").exit_code,
      0);
  EXPECT_EQ(said(), fs::canonical(folder_.path()).string() + "\nours other\n1\n");
  EXPECT_STREQ(getenv("FLEXEL_TEST_OTHER"), "ours");  // our own stay as they were
}

TEST_F(Child, IsStoppedAtTheDeadlineEvenIfItDoesNotListen) {
  const auto begin = std::chrono::steady_clock::now();
  options_.deadline = begin + std::chrono::milliseconds(50);
  EXPECT_TRUE(run_child({"/bin/sleep", "60"}, options_).out_of_time);
  options_.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
  const ChildRun deaf = shell("trap '' INT; sleep 60 & wait; sleep 60");
  EXPECT_TRUE(deaf.out_of_time);
  EXPECT_EQ(deaf.exit_code, 128 + 9);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST_F(Child, ProgramsAreFoundOnThePath) {
  const fs::path program = folder_.path() / "flexel-test-program";
  std::ofstream(program) << "#!/bin/sh\n";
  const std::string before = getenv("PATH");
  ASSERT_EQ(setenv("PATH", ("/nowhere:" + folder_.path().string()).c_str(), 1), 0);
  EXPECT_EQ(find_program("flexel-test-program"), "");  // it cannot be run
  fs::permissions(program, fs::perms::owner_all);
  EXPECT_EQ(find_program("flexel-test-program"), program.string());
  fs::create_directory(folder_.path() / "flexel-test-folder");
  EXPECT_EQ(find_program("flexel-test-folder"), "");
  EXPECT_EQ(find_program("sh"), "");
  ASSERT_EQ(setenv("PATH", before.c_str(), 1), 0);
}

}  // namespace
}  // namespace flexel::commands
