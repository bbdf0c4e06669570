// Signals that end a program: Ctrl-C, termination, crashes.
#pragma once
#include <string>

namespace flexel {

constexpr const char* kNoMemory =
    "not enough memory: a larger spacing (--size) or fewer elements (--count) needs less";

// Installs the handlers of a program called `name`. SIGPIPE is ignored (a closed pipe surfaces as
// ReaderClosedPipe); SIGINT makes check_stop() throw (base/stop.h), a second one ends the process at once. What
// nobody can catch (std::terminate) ends in a line too.
void install_signal_handlers(const std::string& name);

// "interrupted" or "terminated", of the signal that check_stop() saw, and the exit code that a shell gives
// for it.
[[nodiscard]] const char* stop_signal_word();
[[nodiscard]] int stop_signal_exit_code();

}  // namespace flexel
