#include "base/program/program.h"
#include "base/error.h"
#include "base/nearest_word.h"
#include "base/program/arguments.h"
#include "base/stop.h"
#include "base/version.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <new>
#include <system_error>
#include <thread>

#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/program/progress.h"
#include "base/program/termination.h"

namespace flexel {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

struct Outcome {
  int code = -1;
  std::string err;
};

// Runs `body` as a program in a process of its own, after `before`.
Outcome run(const std::function<int()>& body, const std::function<void()>& before = {}) {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
      std::signal(signal, SIG_DFL);  // a background job ignores some
    if (before) before();
    _exit(run_program("flexel-test", body));
  }
  close(ends[1]);
  Outcome outcome;
  char buffer[4096];
  for (ssize_t got; (got = read(ends[0], buffer, sizeof buffer)) > 0;) outcome.err.append(buffer, got);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
  return outcome;
}

template <class Error>
std::function<int()> throwing(const Error& error) {
  return [error]() -> int { throw error; };
}

TEST(Program, EveryExceptionHasItsExitCodeAndOneLine) {
  struct Case {
    std::function<int()> body;
    int code;
    std::string err;
  };
  const std::vector<Case> cases = {
      {[] { return 0; }, 0, ""},
      {[] { return 4; }, 4, ""},
      {throwing(InputError("a.toml:3", "unknown key")), 2, "flexel-test: error: a.toml:3: unknown key\n"},
      {throwing(InputError("no file")), 2, "flexel-test: error: no file\n"},
      {throwing(InputError("two\nlines\n")), 2, "flexel-test: error: two lines\n"},
      {throwing(DivergedError("step 3")), 3, "flexel-test: error: step 3\n"},
      {throwing(InvalidMappingError("2 frames")), 4, "flexel-test: error: 2 frames\n"},
      {throwing(Interrupted()), 130, "flexel-test: interrupted\n"},
      {throwing(ReaderClosedPipe()), 141, ""},
  };
  for (const Case& c : cases) {
    const Outcome outcome = run(c.body);
    EXPECT_EQ(outcome.code, c.code) << c.err;
    EXPECT_EQ(outcome.err, c.err);
  }
}

TEST(Program, MemoryIsTheUsersAndTheRestIsOurs) {
  const Outcome memory = run(throwing(std::bad_alloc()));
  EXPECT_EQ(memory.code, 2);
  EXPECT_THAT(memory.err, HasSubstr("not enough memory"));
  const std::error_code few = std::make_error_code(std::errc::resource_unavailable_try_again);
  for (const auto& body :
       {throwing(std::system_error(few)), throwing(std::runtime_error("pthread_create has failed"))}) {
    const Outcome threads = run(body);
    EXPECT_EQ(threads.code, 2);
    EXPECT_THAT(threads.err, HasSubstr("no thread can be started"));
  }
  const Outcome ours = run(throwing(std::logic_error("index 7")));
  EXPECT_EQ(ours.code, 1);
  EXPECT_THAT(ours.err, HasSubstr("internal error"));
  EXPECT_THAT(ours.err, HasSubstr("index 7"));
  EXPECT_EQ(run([]() -> int { throw 5; }).code, 1);
}

TEST(Program, AFullStdoutIsNoSuccess) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full here";
  const Outcome outcome = run([] {
    if (std::freopen("/dev/full", "w", stdout) == nullptr) return 9;
    std::printf("result\n");
    return 0;
  });
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("stdout: cannot write: No space left on device"));
}

TEST(Program, AReaderOfStdoutThatLeftEndsItSilently) {
  const Outcome outcome = run([] {
    int ends[2];
    if (pipe(ends) != 0) return 9;
    close(ends[0]);
    dup2(ends[1], STDOUT_FILENO);
    std::printf("%s", std::string(100000, 'x').c_str());
    return 0;
  });
  EXPECT_EQ(outcome.code, 141);
  EXPECT_EQ(outcome.err, "");
}

TEST(Program, AClosedStdoutIsNoSuccessAndNoFileTakesItsPlace) {
  const Outcome outcome = run(
      [] {
        OutputFile output("-");
        output.write("result");
        output.commit();
        return 0;
      },
      [] { close(STDOUT_FILENO); });
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("stdout: cannot write"));
}

TEST(Program, OneInterruptAsksAndASecondEnds) {
  const Outcome asked = run([] {
    if (interrupted()) return 9;
    raise(SIGINT);
    if (!interrupted()) return 8;
    check_stop();
    return 7;
  });
  EXPECT_EQ(asked.code, 130);
  const Outcome ended = run([] {
    raise(SIGINT);
    raise(SIGINT);
    return 7;
  });
  EXPECT_EQ(ended.code, 130);
  EXPECT_EQ(ended.err, "") << "it ended within the handler";
}

// For calls that cannot be asked to stop.
TEST(Program, AStopMayEndTheProcessAtOnce) {
  const Outcome interrupted = run([] {
    const StopEndsProcess ends;
    raise(SIGINT);
    return 7;
  });
  EXPECT_EQ(interrupted.code, 130);
  EXPECT_EQ(interrupted.err, "flexel-test: interrupted\n");
  const auto sleeping = [](LimitOf of) {
    const StopAfter limit(0.05, "--timeout", of);
    const StopEndsProcess ends;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return 7;
  };
  const Outcome late = run([&] { return sleeping(LimitOf::command); });
  EXPECT_EQ(late.code, 5);
  EXPECT_EQ(late.err, "flexel-test: error: stopped by --timeout\n");
  EXPECT_EQ(run([&] { return sleeping(LimitOf::attempt); }).code, 7) << "the command goes on";
  const Outcome over = run([] {
    { const StopEndsProcess ends; }
    raise(SIGINT);
    check_stop();
    return 7;
  });
  EXPECT_EQ(over.err, "flexel-test: interrupted\n");
}

TEST(Program, AKilledProgramLeavesNoTemporaryFile) {
  const auto folder = std::filesystem::temp_directory_path() / ("flexel-killed-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  for (const int signal : {SIGTERM, SIGHUP}) {
    const Outcome outcome = run([&] {
      OutputFile output((folder / "out").string());
      raise(signal);
      return 7;
    });
    EXPECT_EQ(outcome.code, 1000 + signal);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
  }
  std::filesystem::remove_all(folder);
}

TEST(Program, TerminationThatWaitsAsks) {
  for (const int signal : {SIGTERM, SIGHUP}) {
    const Outcome asked = run([&] {
      {
        const TerminationWaits outer;
        { const TerminationWaits inner; }
        raise(signal);
      }
      if (!interrupted()) return 8;
      check_stop();
      return 7;
    });
    EXPECT_EQ(asked.code, 128 + signal);
    EXPECT_EQ(asked.err, "flexel-test: terminated\n");
    const Outcome ended = run([&] {
      const TerminationWaits waits;
      raise(signal);
      raise(signal);
      return 7;
    });
    EXPECT_EQ(ended.code, 128 + signal);
    EXPECT_EQ(ended.err, "") << "it ended within the handler";
    const Outcome over = run([&] {
      { const TerminationWaits waits; }
      raise(signal);
      return 7;
    });
    EXPECT_EQ(over.code, 1000 + signal);
  }
}

TEST(Program, ReadingASilentPipeCanBeInterrupted) {
  const Outcome outcome = run([] {
    int ends[2];
    if (pipe(ends) != 0) return 9;
    dup2(ends[0], STDIN_FILENO);
    const pid_t parent = getpid();
    if (fork() == 0) {
      for (int n = 0; n < 2; ++n) usleep(100000);
      kill(parent, SIGINT);
      _exit(0);
    }
    (void)read_all("-");
    return 7;
  });
  EXPECT_EQ(outcome.code, 130);
}

TEST(Program, AnEmptyStdinBlamesTheProgramBefore) {
  const Outcome outcome = run([] {
    if (std::freopen("/dev/null", "r", stdin) == nullptr) return 9;
    (void)read_all("-");
    return 7;
  });
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(
      outcome.err,
      "flexel-test: error: stdin is empty: the program before it in the pipe failed or wrote nothing\n");
}

// Parses `words` and gives the message of the InputError, "go on" or "done".
std::string parse(std::vector<std::string> words) {
  CommandLine app("Tests the parser", "flexel-test");
  std::string size, file;
  int count = 0;
  app.add_option("--size", size);
  app.add_option("--count,-n", count);
  app.add_option("FILE", file);
  words.insert(words.begin(), "flexel-test");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  try {
    return parse_arguments(app, static_cast<int>(argv.size()), argv.data()) ? "go on" : "done";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(Arguments, GoodOnesGoOnAndBadOnesSayWhatIsNear) {
  EXPECT_EQ(parse({"--size", "2mm", "a.stl"}), "go on");
  EXPECT_EQ(parse({"-"}), "go on");
  EXPECT_EQ(parse({"--sise", "2mm"}), "unknown option \"--sise\"; did you mean \"--size\"?");
  EXPECT_EQ(parse({"--siez=2mm"}), "unknown option \"--siez\"; did you mean \"--size\"?");
  EXPECT_EQ(parse({"--frobnicate"}), "unknown option \"--frobnicate\"; --help lists the options");
  EXPECT_EQ(parse({"a", "b"}), "unexpected argument \"b\"; --help shows what is accepted");
  EXPECT_THAT(parse({"--count", "many"}), HasSubstr("many"));
  EXPECT_THAT(parse({"--size"}), HasSubstr("--size"));
}

TEST(Arguments, HelpAndVersionGoToStdout) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(parse({"--help"}), "done");
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("--size"));
  testing::internal::CaptureStdout();
  EXPECT_EQ(parse({"--version"}), "done");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), std::string("flexel-test ") + version() + "\n");
}

TEST(NearestWord, FindsTypingMistakesOnly) {
  const std::vector<std::string> words = {"damping_ratio", "density", "young", "x"};
  EXPECT_EQ(nearest_word("damping_ratoi", words), "damping_ratio");
  EXPECT_EQ(nearest_word("Density", words), "density");
  EXPECT_EQ(nearest_word("yuong", words), "young");
  EXPECT_EQ(nearest_word("temperature", words), "");
  EXPECT_EQ(nearest_word("zq", words), "");
  EXPECT_EQ(nearest_word("", words), "");
  EXPECT_EQ(nearest_word("young", {}), "");
  EXPECT_EQ(did_you_mean("densty", words), "; did you mean \"density\"?");
}

std::string said(Progress::Mode mode) {
  testing::internal::CaptureStderr();
  {
    Progress progress("flexel-test", mode);
    progress.stage("one");
    progress.update(0.5, "half");
    progress.say("a line");
    progress.warn("careful");
    progress.stage("two");
    progress.update(std::nan(""), "no share");
  }
  return testing::internal::GetCapturedStderr();
}

TEST(ProgressDisplay, EachModeSaysItsShare) {
  EXPECT_EQ(said(Progress::Mode::quiet), "flexel-test: warning: careful\n");
  const std::string lines = said(Progress::Mode::lines);
  EXPECT_THAT(lines, StartsWith("flexel-test: a line\nflexel-test: warning: careful\nflexel-test: one: "));
  EXPECT_THAT(lines, HasSubstr("flexel-test: two: "));
  EXPECT_EQ(lines.find('\r'), std::string::npos);
  const std::string bar = said(Progress::Mode::bar);
  EXPECT_THAT(bar, HasSubstr("\r\033[Kflexel-test: a line\n"));
  EXPECT_TRUE(bar.ends_with("\r\033[K")) << "the bar is gone at the end";
}

TEST(ProgressDisplay, DrawsAtMostTenTimesASecond) {
  testing::internal::CaptureStderr();
  {
    Progress progress("flexel-test", Progress::Mode::bar);
    progress.stage("one");
    for (int n = 0; n < 100000; ++n) progress.update(n / 1e5);
  }
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_LT(std::count(text.begin(), text.end(), '['), 100);
}

}  // namespace
}  // namespace flexel
