// Turns a crash inside a library that follows damaged input into an exception.
#pragma once
#include <csetjmp>
#include <csignal>
#include <stdexcept>
#include <vector>

namespace flexel {

class LibraryCrashed : public std::runtime_error {
 public:
  LibraryCrashed() : std::runtime_error("the library crashed") {}
};

namespace detail {
// Where the thread that is inside guarded() goes on when it crashes; null in every other thread.
inline thread_local sigjmp_buf* crash_landing = nullptr;

inline void on_crash(int signal) {
  if (crash_landing != nullptr) siglongjmp(*crash_landing, signal);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}
}  // namespace detail

// Runs `work` in this thread; throws LibraryCrashed when it receives SIGSEGV, SIGBUS or SIGFPE. What the
// library held is lost (its destructors do not run), so the caller must give up on the input and not call the
// library with it again. Crashes of other threads end the program as ever. The handlers that were there
// before are put back. A stack of its own lets endless recursion be caught too. Not reentrant.
template <class Work>
void guarded(const Work& work) {
  constexpr int kSignals[] = {SIGSEGV, SIGBUS, SIGFPE};
  static std::vector<char> stack(std::size_t{1} << 16);
  stack_t alternate{}, previous_stack{};
  alternate.ss_sp = stack.data();
  alternate.ss_size = stack.size();
  sigaltstack(&alternate, &previous_stack);
  struct sigaction action {};
  struct sigaction previous[3]{};
  action.sa_handler = detail::on_crash;
  action.sa_flags = SA_ONSTACK;
  for (int i = 0; i < 3; ++i) sigaction(kSignals[i], &action, &previous[i]);
  const auto restore = [&] {
    detail::crash_landing = nullptr;
    for (int i = 0; i < 3; ++i) sigaction(kSignals[i], &previous[i], nullptr);
    sigaltstack(&previous_stack, nullptr);
  };
  sigjmp_buf landing;
  if (sigsetjmp(landing, 1) != 0) {
    restore();
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
