// The child has its own process group, so that Ctrl-C reaches it only through this process, and is killed
// when this process ends (PR_SET_PDEATHSIG).
#include "flexel/process/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "base/error.h"
#include "base/stop.h"

namespace flexel {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kGrace = std::chrono::seconds(2);
constexpr Clock::duration kGlance = std::chrono::milliseconds(100);

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// Becomes the program. Only what is safe between fork and exec is called.
[[noreturn]] void become(char* const* argv, char* const* environment, const char* folder, int log,
                         int nothing, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // the parent ended before prctl() took effect
  dup2(nothing, STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  struct sigaction usual = {};
  usual.sa_handler = SIG_DFL;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaction(signal, &usual, nullptr);
  if (*folder == 0 || chdir(folder) == 0) execve(argv[0], argv, environment);
  _exit(127);
}

struct Descriptor {
  int number = -1;
  explicit Descriptor(int n) : number(n) {}
  ~Descriptor() {
    if (number >= 0) close(number);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
};

// Milliseconds that poll() may wait: to the deadline, but never so long that an interrupt which came just
// before it is seen late.
int patience(Deadline until) {
  const auto left = until == kNever ? kGlance : std::min<Clock::duration>(kGlance, until - Clock::now());
  return static_cast<int>(std::max<long long>(0, std::chrono::ceil<std::chrono::milliseconds>(left).count()));
}

// For kernels without pidfd_open: there poll() watches nothing.
bool has_ended(pid_t child) {
  siginfo_t info = {};
  return waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == child;
}

// For execve(): a null pointer at the end.
std::vector<char*> pointers(const std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (const std::string& each : texts) result.push_back(const_cast<char*>(each.c_str()));
  result.push_back(nullptr);
  return result;
}

// Ours, with `more` in the place of what has the same name.
std::vector<std::string> environment_with(const std::vector<std::string>& more) {
  std::vector<std::string> result = more;
  for (char** each = environ; *each != nullptr; ++each) {
    const std::string_view ours = *each, name = ours.substr(0, ours.find('=') + 1);
    if (std::none_of(more.begin(), more.end(), [&](const auto& text) { return text.rfind(name, 0) == 0; }))
      result.emplace_back(ours);
  }
  return result;
}

}  // namespace

ChildRun run_child(const std::vector<std::string>& argv, const ChildOptions& options) {
  if (options.heed_interrupts) check_stop();
  const std::vector<char*> arguments = pointers(argv);
  const std::vector<std::string> variables = environment_with(options.environment);
  const std::vector<char*> environment = pointers(variables);
  if (access(argv.front().c_str(), X_OK) != 0)
    throw InputError(argv.front(), fmt::format("cannot be run: {}", std::strerror(errno)));
  const Descriptor out(open(options.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (out.number < 0)
    throw InputError(options.log.string(), fmt::format("cannot be written: {}", std::strerror(errno)));
  const Descriptor nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
  const Clock::time_point begin = Clock::now();
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw InputError(argv.front(), fmt::format("cannot be started: {}", std::strerror(errno)));
  if (child == 0)
    become(arguments.data(), environment.data(), options.folder.c_str(), out.number, nothing.number, parent);
  // by its number: the header of glibc 2.36 declares pidfd_open for C alone
  const Descriptor handle(static_cast<int>(syscall(SYS_pidfd_open, child, 0)));
  ChildRun result;
  bool signalled = false;  // SIGINT was sent
  Deadline until = options.deadline;
  pollfd watched = {handle.number, POLLIN, 0};
  while (poll(&watched, 1, patience(until)) <= 0 && !has_ended(child)) {
    const bool late = Clock::now() >= until;
    if (signalled && late) {
      kill(child, SIGKILL);
      until = kNever;
    } else if (!signalled && (late || (options.heed_interrupts && stop_is_due()))) {
      result.out_of_time = late;
      kill(child, SIGINT);
      signalled = true;
      until = Clock::now() + kGrace;
    }
    if (options.meanwhile) options.meanwhile();
  }
  int status = 0;
  rusage usage = {};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  result.wall = std::chrono::duration<double>(Clock::now() - begin).count();
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.cpu = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  result.memory = 1024.0 * static_cast<double>(usage.ru_maxrss);
  if (options.heed_interrupts) check_stop();
  return result;
}

std::string find_program(const std::string& name) {
  const char* paths = std::getenv("PATH");
  std::istringstream in(paths != nullptr ? paths : "/usr/bin:/bin");
  for (std::string folder; std::getline(in, folder, ':');) {
    const std::filesystem::path program = std::filesystem::path(folder) / name;
    std::error_code ignored;
    if (access(program.c_str(), X_OK) == 0 && std::filesystem::is_regular_file(program, ignored))
      return program.string();
  }
  return "";
}

}  // namespace flexel
