// stdio keeps an error until ferror() reads it.
#include "base/program/standard_output.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "base/error.h"

namespace flexel {
namespace {

bool reader_of_stdout_is_gone() {
  pollfd descriptor = {STDOUT_FILENO, POLLOUT, 0};
  return poll(&descriptor, 1, 0) == 1 && (descriptor.revents & POLLERR) != 0;
}

}  // namespace

void flush_stdout() {
  errno = 0;
  const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout) != 0;
  if (!failed) return;
  const int reason = errno;
  if (reason == EPIPE || reader_of_stdout_is_gone()) throw ReaderClosedPipe();
  throw InputError("stdout", fmt::format("cannot write: {}",
                                         reason != 0 ? std::strerror(reason) : "an earlier write failed"));
}

void print_to_stdout(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stdout);
  flush_stdout();
}

}  // namespace flexel
