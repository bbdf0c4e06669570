// The edge of a program. run_program() is the only place where exceptions become words and exit codes;
// parse_arguments() turns what CLI11 throws into InputError; the signal handlers only set a flag (the first
// SIGINT, and where it waits SIGTERM or SIGHUP) or remove the temporary outputs and end the process.
#include "formats/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>
#include <numeric>
#include <thread>

#include "formats/files.h"
#include "formats/pipe_code.h"
#include "formats/stop.h"
#include "formats/termination.h"

namespace flexel {
namespace {

volatile std::sig_atomic_t interrupt_count = 0, interrupting_signal = SIGINT, termination_waits = 0;
volatile std::sig_atomic_t stop_ends_process = 0;
std::array<char, 64> program_name{};  // of this program, for the signal handlers

// As a shell gives it.
int exit_code_of(int signal) {
  return 128 + signal;
}
static_assert(128 + SIGINT == kExitInterrupted);

// Only what a signal handler may call.
void write_words(std::initializer_list<const char*> words) {
  for (const char* word : words) (void)!::write(STDERR_FILENO, word, std::strlen(word));
}

const char* word_of(int signal) {
  return signal == SIGINT ? "interrupted" : "terminated";
}

void on_interrupt(int signal) {
  const bool at_once = interrupt_count == 0 && stop_ends_process > 0 && termination_waits == 0;
  interrupt_count = interrupt_count + 1;
  if (interrupt_count > 1 || at_once) {
    if (at_once) write_words({program_name.data(), ": ", word_of(signal), "\n"});
    remove_temporary_outputs();
    tell_code_through_pipe(STDOUT_FILENO, exit_code_of(signal));
    _exit(exit_code_of(signal));
  }
  interrupting_signal = signal;
  request_stop();
}

void on_termination(int signal) {
  if (termination_waits > 0) return on_interrupt(signal);
  remove_temporary_outputs();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// The handler is gone once it has begun: the crash happens again, and ends the program as ever.
void on_crash_of_program(int signal) {
  remove_temporary_outputs();
  tell_code_through_pipe(STDOUT_FILENO, exit_code_of(signal));
}

// Without SA_RESTART, so that a read from a silent pipe ends when the user interrupts it. A signal that was
// ignored when the program began (nohup, a background job) stays ignored.
void handle(int signal, void (*handler)(int)) {
  struct sigaction action = {};
  if (sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN) return;
  action = {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

// A program may be started with stdin, stdout or stderr closed. The next file it opens would then take that
// number, and what is printed would land in it. Holding the numbers with a file that cannot be written keeps
// errors errors.
void hold_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = ::open("/dev/null", O_RDONLY);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor > STDERR_FILENO) ::close(descriptor);
}

void install_handlers() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on the size of files then surfaces as EFBIG
  struct sigaction crash = {};
  crash.sa_handler = on_crash_of_program;
  crash.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGSEGV, &crash, nullptr);
  handle(SIGINT, on_interrupt);
  handle(SIGTERM, on_termination);
  handle(SIGHUP, on_termination);
}

std::string one_line(const std::string& text) {
  std::string line;
  for (const char c : text) {
    const bool space = c == '\n' || c == '\r' || c == '\t' || c == ' ';
    if (space && (line.empty() || line.back() == ' ')) continue;
    line += space ? ' ' : c;
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

int report(const std::string& name, const std::string& what, int code) {
  const std::string line = name + ": error: " + one_line(what) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
  return code;
}

bool reader_of_stdout_is_gone() {
  pollfd descriptor = {STDOUT_FILENO, POLLOUT, 0};
  return poll(&descriptor, 1, 0) == 1 && (descriptor.revents & POLLERR) != 0;
}

// What was printed to stdout has arrived, or an exception says why not.
void flush_stdout() {
  errno = 0;
  const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout) != 0;
  if (!failed) return;
  const int reason = errno;
  if (reason == EPIPE || reader_of_stdout_is_gone()) throw ReaderClosedPipe();
  throw InputError("stdout", fmt::format("cannot write: {}",
                                         reason != 0 ? std::strerror(reason) : "an earlier write failed"));
}

// The body's exit code, or that of what it throws.
int code_of(const std::string& name, const std::function<int()>& body) {
  try {
    const int code = body();
    flush_stdout();
    return code;
  } catch (const InputError& error) {
    return report(name, error.where().empty() ? error.what() : error.where() + ": " + error.what(),
                  kExitInput);
  } catch (const DivergedError& error) {
    return report(name, error.what(), kExitDiverged);
  } catch (const TimeoutError& error) {
    return report(name, error.what(), kExitTimeout);
  } catch (const InvalidMappingError& error) {
    return report(name, error.what(), kExitInvalidMapping);
  } catch (const Interrupted&) {
    const int signal = interrupting_signal;
    std::fprintf(stderr, "%s: %s\n", name.c_str(), word_of(signal));
    return exit_code_of(signal);
  } catch (const ReaderClosedPipe&) {
    return kExitReaderClosedPipe;
  } catch (const ProgramBeforeFailed& failed) {
    return failed.code();
  } catch (const std::bad_alloc&) {
    return report(name, "not enough memory: a larger spacing (--size) or fewer elements (--count) needs less",
                  kExitInput);
  } catch (const std::exception& error) {
    return report(name, fmt::format("internal error, please report it with the input: {}", error.what()),
                  kExitOurFault);
  } catch (...) {
    return report(name, "internal error of an unknown kind, please report it with the input", kExitOurFault);
  }
}

void print(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stdout);
  flush_stdout();
}

void collect_options(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  for (const CLI::App* subcommand : app.get_subcommands()) collect_options(*subcommand, names);
}

[[noreturn]] void refuse_extras(const CLI::App& app, const std::vector<std::string>& extras) {
  const std::string word =
      extras.empty() ? std::string() : extras.front().substr(0, extras.front().find('='));
  if (word.size() < 2 || word.front() != '-')
    throw InputError(fmt::format("unexpected argument \"{}\"; --help shows what is accepted", word));
  std::vector<std::string> names;
  collect_options(app, names);
  const std::string hint = did_you_mean(word, names);
  throw InputError(
      fmt::format("unknown option \"{}\"{}", word, hint.empty() ? "; --help lists the options" : hint));
}

// Edit distance where swapping two neighbouring letters counts as one edit, as mistyping does (optimal string
// alignment; Damerau, "A technique for computer detection and correction of spelling errors", 1964). Case
// does not count.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  std::vector<std::size_t> before_last, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = last[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, change});
      if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]))
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last = last;
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

int run_program(const std::string& name, const std::function<int()>& body) {
  name.copy(program_name.data(), program_name.size() - 1);
  hold_standard_descriptors();
  install_handlers();
  const int code = code_of(name, body);
  tell_code_through_pipe(STDOUT_FILENO, code);
  return code;
}

bool parse_arguments(CLI::App& app, int argc, char** argv) {
  if (app.get_option_no_throw("--version") == nullptr) {
    const std::string name = app.get_name().empty() ? stem(argv[0]) : app.get_name();
    app.set_version_flag("--version", name + " " + version(), "Print the version and exit");
  }
  try {
    app.parse(argc, argv);
    return true;
  } catch (const CLI::CallForHelp&) {
    print(app.help());
  } catch (const CLI::CallForAllHelp&) {
    print(app.help("", CLI::AppFormatMode::All));
  } catch (const CLI::CallForVersion& version_text) {
    print(std::string(version_text.what()) + "\n");
  } catch (const CLI::ExtrasError&) {
    refuse_extras(app, app.remaining(true));
  } catch (const CLI::ParseError& error) {
    throw InputError(fmt::format("{}; --help shows what is accepted", one_line(error.what())));
  }
  return false;
}

TerminationWaits::TerminationWaits() {
  termination_waits = termination_waits + 1;
}
TerminationWaits::~TerminationWaits() {
  termination_waits = termination_waits - 1;
}

// Ends the process when the limit of the command is over before the call is.
class StopEndsProcess::Watch {
 public:
  explicit Watch(std::int64_t limit) : thread_([this, limit] { wait(limit); }) {}
  ~Watch() {
    {
      const std::lock_guard lock(mutex_);
      done_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  void wait(std::int64_t limit) {
    std::unique_lock lock(mutex_);
    const std::chrono::nanoseconds left(limit - stop_detail::now());
    if (changed_.wait_for(lock, left, [this] { return done_; })) return;
    if (termination_waits > 0) return;  // the work hears the limit itself
    write_words({program_name.data(), ": error: stopped by --timeout\n"});
    remove_temporary_outputs();
    tell_code_through_pipe(STDOUT_FILENO, kExitTimeout);
    _exit(kExitTimeout);
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::thread thread_;
};

StopEndsProcess::StopEndsProcess() {
  check_stop();
  const std::int64_t limit = stop_detail::command_limit();
  if (limit != stop_detail::kNever) watch_ = std::make_unique<Watch>(limit);
  stop_ends_process = stop_ends_process + 1;
}
StopEndsProcess::~StopEndsProcess() {
  stop_ends_process = stop_ends_process - 1;
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates) {
  const std::size_t limit = std::max<std::size_t>(2, word.size() / 3);
  std::string nearest;
  std::size_t smallest = limit + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(word, candidate);
    // A word all of whose letters would have to change is no suggestion.
    if (distance < smallest && distance < std::max(word.size(), candidate.size())) {
      smallest = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_word(word, candidates);
  return nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest);
}

const char* version() {
  return FLEXEL_VERSION;
}

}  // namespace flexel
