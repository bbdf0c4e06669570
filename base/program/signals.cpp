// The handlers either set a flag (the first SIGINT; under TerminationWaits also SIGTERM and SIGHUP) or remove
// the temporary outputs and end the process.
#include "base/program/signals.h"

#include <cxxabi.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <thread>
#include <typeinfo>

#include "base/error.h"
#include "base/files/ending_waits.h"
#include "base/files/files.h"
#include "base/files/pipe_code.h"
#include "base/program/termination.h"
#include "base/stop.h"

namespace flexel {
namespace {

volatile std::sig_atomic_t interrupt_count = 0, interrupting_signal = SIGINT, termination_waits = 0;
volatile std::sig_atomic_t stop_ends_process = 0;
std::atomic<bool> may_end_process{true};
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
  if (EndingWaits::takes(signal)) return;
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
  if (EndingWaits::takes(signal)) return;
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

// Where an exception meets another, or leaves a destructor, nobody can catch it: libraries do that where memory ends.
[[noreturn]] void on_terminate() {
  const std::type_info* type = abi::__cxa_current_exception_type();
  const bool memory = type != nullptr && *type == typeid(std::bad_alloc);
  remove_temporary_outputs();
  write_words({program_name.data(), ": error: ",
               memory ? kNoMemory : "internal error of an unknown kind, please report it with the input",
               "\n"});
  if (!memory) std::abort();
  tell_code_through_pipe(STDOUT_FILENO, kExitInput);
  _exit(kExitInput);
}

}  // namespace

void install_signal_handlers(const std::string& name) {
  name.copy(program_name.data(), program_name.size() - 1);
  std::set_terminate(on_terminate);
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

const char* stop_signal_word() {
  return word_of(interrupting_signal);
}

int stop_signal_exit_code() {
  return exit_code_of(interrupting_signal);
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
    if (termination_waits > 0) return;  // check_stop() in the work throws TimeoutError
    const auto no_file_appears = EndingWaits::none_begins();
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

void never_end_process() noexcept {
  may_end_process = false;
}

StopEndsProcess::StopEndsProcess() {
  check_stop();
  const std::int64_t limit = stop_detail::command_limit();
  if (may_end_process && limit != stop_detail::kNever) watch_ = std::make_unique<Watch>(limit);
  stop_ends_process = stop_ends_process + 1;
}
StopEndsProcess::~StopEndsProcess() {
  stop_ends_process = stop_ends_process - 1;
}

}  // namespace flexel
