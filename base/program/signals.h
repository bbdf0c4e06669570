// Signals that end a program: Ctrl-C, termination, crashes.
#pragma once
#include <string>

namespace flexel {

// Installs the handlers of a program called `name`. SIGPIPE is ignored (a closed pipe surfaces as
// ReaderClosedPipe); SIGINT makes check_stop() throw (base/stop.h), a second one ends the process at once.
void install_signal_handlers(const std::string& name);

// "interrupted" or "terminated", of the signal that check_stop() saw, and the exit code that a shell gives
// for it.
[[nodiscard]] const char* stop_signal_word();
[[nodiscard]] int stop_signal_exit_code();

}  // namespace flexel
