// run_program() is the only place where exceptions become messages and exit codes.
#include "base/program/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <new>
#include <string_view>
#include <system_error>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/pipe_code.h"
#include "base/printable.h"
#include "base/program/signals.h"
#include "base/program/standard_output.h"
#include "base/resources.h"
#include "base/text.h"
#include "base/units.h"

namespace flexel {
namespace {

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

int report(const std::string& name, const std::string& what, int code) {
  const std::string line = name + ": error: " + printable(one_line(what)) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
  return code;
}

// std::thread says it by a code, oneTBB by a text.
bool wants_a_thread(const std::exception& error) {
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  return (system != nullptr && system->code() == std::errc::resource_unavailable_try_again) ||
         std::string_view(error.what()).starts_with("pthread_create");
}

std::string memory_words() {
  if (!std::isfinite(memory_limit())) return kNoMemory;
  return fmt::format("needs more than --max-memory allows ({}): raise it; a larger spacing needs less",
                     human_bytes(memory_limit()));
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
    std::fprintf(stderr, "%s: %s\n", name.c_str(), stop_signal_word());
    return stop_signal_exit_code();
  } catch (const ReaderClosedPipe&) {
    return kExitReaderClosedPipe;
  } catch (const ProgramBeforeFailed& failed) {
    return failed.code();
  } catch (const std::bad_alloc&) {
    return report(name, memory_words(), kExitInput);
  } catch (const std::exception& error) {
    if (wants_a_thread(error))
      return report(
          name,
          "no thread can be started: the limits of this shell leave no room (ulimit -u, ulimit -v); "
          "raise them, or give --threads 1",
          kExitInput);
    return report(name, fmt::format("internal error, please report it with the input: {}", error.what()),
                  kExitOurFault);
  } catch (...) {
    return report(name, "internal error of an unknown kind, please report it with the input", kExitOurFault);
  }
}

}  // namespace

int run_program(const std::string& name, const std::function<int()>& body) {
  hold_standard_descriptors();
  install_signal_handlers(name);
  const int code = code_of(name, body);
  tell_code_through_pipe(STDOUT_FILENO, code);
  return code;
}

}  // namespace flexel