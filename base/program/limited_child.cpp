// What comes back is read through a pipe, whose end tells that the child has ended, however it did.
#include "base/program/limited_child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <string>

#include "base/error.h"
#include "base/files/memory_file.h"
#include "base/parallel.h"
#include "base/program/address_sanitizer.h"
#include "base/stop.h"

namespace flexel {
namespace {

struct MemoryInUse {
  double resident = 0;  // bytes
  double writable = 0;  // bytes, as RLIMIT_DATA counts them
};

// Zero where the system does not say.
MemoryInUse memory_in_use(const std::string& process) {
  std::ifstream file("/proc/" + process + "/statm");
  double pages[6] = {};
  for (double& each : pages) file >> each;
  const auto page = static_cast<double>(sysconf(_SC_PAGESIZE));
  return file ? MemoryInUse{page * pages[1], page * pages[5]} : MemoryInUse{};
}

// --- in the child

// Never more than this process may have already.
void lower_limit(decltype(RLIMIT_DATA) resource, double value) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || !(value < 1e18)) return;
  const auto wanted = static_cast<rlim_t>(value);
  limit.rlim_cur = limit.rlim_cur == RLIM_INFINITY ? wanted : std::min(limit.rlim_cur, wanted);
  setrlimit(resource, &limit);
}

void set_limits(const ChildLimits& limits) {
  // The parent watches the memory in use. OpenCASCADE, for one, goes on without a face for which there was none, so that
  // no allocation is to fail but one of a size that is absurd, or one that the parent sees too late.
#ifndef FLEXEL_ADDRESS_SANITIZER  // its shadow is more than any limit
  if (const double used = memory_in_use("self").writable; used > 0)
    lower_limit(RLIMIT_DATA, used + 2 * limits.memory + 1e9);
#endif
  lower_limit(RLIMIT_CORE, 0);  // a crash here is no news
  itimerval timer{};
  const double whole = std::floor(std::min(limits.processor, 1e9));
  timer.it_value.tv_sec = static_cast<time_t>(whole);
  timer.it_value.tv_usec =
      std::max<suseconds_t>(1, static_cast<suseconds_t>(1e6 * std::min(limits.processor - whole, 0.999)));
  setitimer(ITIMER_PROF, &timer, nullptr);  // SIGPROF ends the child
}

// The parent's handlers would remove its files. What a terminal sends goes to the parent too, which decides.
void reset_signals() {
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPROF, SIGALRM, SIGPIPE})
    std::signal(signal, SIG_DFL);
  for (const int signal : {SIGINT, SIGQUIT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
}

void be_silent() {
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int each : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (nothing >= 0) dup2(nothing, each);
}

[[noreturn]] void be_child(const std::function<int(int out)>& body, const ChildLimits& limits, int out,
                           pid_t parent, const sigset_t& unblocked) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kChildFailed);  // it ended before prctl() took effect
  reset_signals();
  be_silent();
  set_limits(limits);
  pthread_sigmask(SIG_SETMASK, &unblocked, nullptr);
  int code = kChildFailed;
  try {
    code = body(out);
  } catch (const std::bad_alloc&) {
    code = kChildWithoutMemory;
  } catch (...) {
  }
  _exit(code);  // no destructors: what they would end is the parent's
}

// --- in the parent

class Child {
 public:
  Child(const std::function<int(int out)>& body, const ChildLimits& limits) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail();
    // A signal that came between fork and reset_signals() would find the parent's handlers in the child.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const pid_t parent = getpid();
    number_ = fork();
    if (number_ == 0) be_child(body, limits, ends[1], parent, before);
    const int error = errno;
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    close(ends[1]);
    in_ = ends[0];
    if (number_ > 0) return;
    close(in_);
    errno = error;
    fail();
  }
  ~Child() { end(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Appends what has come; false: the child has ended. Waits `milliseconds` at most.
  bool read_some(Bytes& bytes, int milliseconds) {
    pollfd watched = {in_, POLLIN, 0};
    if (poll(&watched, 1, milliseconds) <= 0) return true;
    std::array<std::byte, 1 << 16> buffer;
    const ssize_t count = read(in_, buffer.data(), buffer.size());
    if (count < 0) return errno == EINTR;
    bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + count);
    return count > 0;
  }

  // Bytes that it has in memory.
  [[nodiscard]] double memory() const { return memory_in_use(std::to_string(number_)).resident; }

  // How it ended; a child that runs on is killed.
  int end() {
    if (number_ <= 0) return status_;
    kill(number_, SIGKILL);  // without effect on one that has ended
    while (waitpid(number_, &status_, 0) < 0 && errno == EINTR) {
    }
    close(in_);
    number_ = -1;
    return status_;
  }

 private:
  [[noreturn]] static void fail() {
    throw InputError(
        fmt::format("no process can be started to read or write a file ({}): the "
                    "limits of this shell (ulimit) leave no room",
                    std::strerror(errno)));
  }
  pid_t number_ = -1;
  int in_ = -1, status_ = 0;
};

ChildEnd end_of(int status) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == kChildFinished) return ChildEnd::finished;
  if (WIFEXITED(status) && WEXITSTATUS(status) == kChildNotStarted) return ChildEnd::not_started;
  if (WIFEXITED(status))
    return WEXITSTATUS(status) == kChildWithoutMemory ? ChildEnd::out_of_memory : ChildEnd::crashed;
  if (WTERMSIG(status) == SIGPROF || WTERMSIG(status) == SIGXCPU) return ChildEnd::out_of_time;
  // nobody kills it but the system, where memory is short
  return WTERMSIG(status) == SIGKILL ? ChildEnd::out_of_memory : ChildEnd::crashed;
}

}  // namespace

ChildLimits limits_of_child(double seconds, double memory) {
  return {seconds * static_cast<double>(thread_count()), 3 * seconds, memory};
}

ChildOutput run_in_child(const std::function<int(int out)>& body, const ChildLimits& limits,
                         const HearOutput& hear) {
  using Clock = std::chrono::steady_clock;
  constexpr int kGlance = 50;  // ms
  check_stop();
  Child child(body, limits);
  ChildOutput output;
  double waited = 0;  // s
  Clock::time_point last = Clock::now();
  while (child.read_some(output.bytes, kGlance)) {
    check_stop();
    const double passed = std::chrono::duration<double>(Clock::now() - last).count();
    if (passed < 1e-3 * kGlance) continue;  // what came was read; the child is looked at now and then
    waited += std::min(1.0, passed);
    last = Clock::now();
    if (waited >= limits.wall) return {ChildEnd::out_of_time, {}};
    if (child.memory() > limits.memory) return {ChildEnd::out_of_memory, {}};
    if (hear) hear(output.bytes);
  }
  output.end = end_of(child.end());
  if (output.end != ChildEnd::finished) output.bytes.clear();
  return output;
}

ChildOutput run_limited(const std::string& program, const Bytes& input, const ChildLimits& limits,
                        const HearOutput& hear) {
  const MemoryFile file(input);
  return run_in_child(
      [&](int out) -> int {
        if (dup2(file.descriptor(), STDIN_FILENO) < 0 || dup2(out, STDOUT_FILENO) < 0) return kChildFailed;
        execl(program.c_str(), program.c_str(), nullptr);
        return kChildNotStarted;
      },
      limits, hear);
}

}  // namespace flexel
