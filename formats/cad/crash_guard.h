// Turns a crash or an endless loop inside a library that follows damaged input into an exception.
#pragma once
#include <sys/syscall.h>
#include <unistd.h>

#include <csetjmp>
#include <csignal>
#include <ctime>
#include <stdexcept>
#include <vector>

namespace flexel {

class LibraryCrashed : public std::runtime_error {
 public:
  LibraryCrashed() : std::runtime_error("the library crashed") {}
};

class LibraryHung : public std::runtime_error {
 public:
  LibraryHung() : std::runtime_error("the library did not come back") {}
};

namespace detail {
// Where the thread that is inside guarded() goes on when it crashes or its time is up; null in every other
// thread.
// Volatile: a signal handler reads it.
inline thread_local sigjmp_buf* volatile crash_landing = nullptr;

inline void on_crash(int signal) {
  if (crash_landing != nullptr) siglongjmp(*crash_landing, signal);
  if (signal == SIGALRM) return;  // came when the work was just done
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// Sends SIGALRM to this thread once it has used `seconds` of processor time; 0: never.
class ThreadAlarm {
 public:
  explicit ThreadAlarm(double seconds) {
    if (!(seconds > 0)) return;
    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = SIGALRM;
    event._sigev_un._tid = static_cast<pid_t>(syscall(SYS_gettid));
    set_ = timer_create(CLOCK_THREAD_CPUTIME_ID, &event, &timer_) == 0;
    if (!set_) return;
    itimerspec when{};
    when.it_value.tv_sec = static_cast<time_t>(seconds);
    when.it_value.tv_nsec = static_cast<long>(1e9 * (seconds - static_cast<double>(when.it_value.tv_sec)));
    timer_settime(timer_, 0, &when, nullptr);
  }
  ~ThreadAlarm() {
    if (set_) timer_delete(timer_);
  }
  ThreadAlarm(const ThreadAlarm&) = delete;
  ThreadAlarm& operator=(const ThreadAlarm&) = delete;

 private:
  timer_t timer_{};
  bool set_ = false;
};
}  // namespace detail

// Runs `work` in this thread; throws LibraryCrashed when it receives SIGSEGV, SIGBUS or SIGFPE, and
// LibraryHung when it has used `seconds` of processor time (0: no limit). What the library held is lost (its
// destructors do not run), so the caller must give up on the input and not call the library with it again.
// Crashes of other threads end the program as ever. The handlers that were there before are put back. A stack
// of its own lets endless recursion be caught too. Not reentrant.
template <class Work>
void guarded(const Work& work, double seconds = 0) {
  constexpr int kSignals[] = {SIGSEGV, SIGBUS, SIGFPE, SIGALRM};
  static std::vector<char> stack(std::size_t{1} << 16);
  stack_t alternate{}, previous_stack{};
  alternate.ss_sp = stack.data();
  alternate.ss_size = stack.size();
  sigaltstack(&alternate, &previous_stack);
  struct sigaction action {};
  struct sigaction previous[4]{};
  action.sa_handler = detail::on_crash;
  action.sa_flags = SA_ONSTACK;
  for (int i = 0; i < 4; ++i) sigaction(kSignals[i], &action, &previous[i]);
  const auto restore = [&] {
    detail::crash_landing = nullptr;
    for (int i = 0; i < 4; ++i) sigaction(kSignals[i], &previous[i], nullptr);
    sigaltstack(&previous_stack, nullptr);
  };
  const detail::ThreadAlarm alarm(seconds);
  sigjmp_buf landing;
  if (const int signal = sigsetjmp(landing, 1); signal != 0) {
    restore();
    if (signal == SIGALRM) throw LibraryHung();
    throw LibraryCrashed();
  }
  detail::crash_landing = &landing;
  try {
    work();
  } catch (...) {
    restore();
    throw;
  }
  restore();
}

}  // namespace flexel
