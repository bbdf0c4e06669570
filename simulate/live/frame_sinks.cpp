// Descriptors that never wait: a pipe is opened anew for that, so that others who hold it keep theirs as it
// is; a file never waits anyhow; sockets are told with every call.
#include "simulate/live/frame_sinks.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>

#include "base/error.h"
#include "base/stop.h"

namespace flexel::simulate {
namespace {

constexpr int kPipe = 1 << 20;                        // bytes, of stdout's pipe: only a wish
constexpr std::chrono::milliseconds kLastWait{2000};  // for the last frame to leave

[[noreturn]] void refuse(const std::string& where) {
  throw InputError(fmt::format("--live {}: {}", where, std::strerror(errno)));
}

bool starts_with(const std::string& text, const char* begin) {
  return text.rfind(begin, 0) == 0;
}

// Whether a program listens there.
bool answers(const sockaddr_un& address) {
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool found = ::connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(descriptor);
  return found;
}

}  // namespace

FrameSinks::FrameSinks(const std::string& to) : name_(to) {
  if (to == "-") {
    if (isatty(STDOUT_FILENO) != 0)
      throw InputError(
          "--live writes frames to stdout, which is a terminal: pipe it into their reader, or "
          "give --live tcp:PORT");
    name_ = "stdout";
    struct stat status = {};
    const bool known = ::fstat(STDOUT_FILENO, &status) == 0;
    Reader reader{STDOUT_FILENO, known && S_ISSOCK(status.st_mode)};
    if (known && S_ISFIFO(status.st_mode)) {
      (void)::fcntl(STDOUT_FILENO, F_SETPIPE_SZ, kPipe);
      const int anew = ::open("/proc/self/fd/1", O_WRONLY | O_NONBLOCK | O_CLOEXEC);
      if (anew < 0 && errno == ENXIO) throw ReaderClosedPipe();
      if (anew >= 0) reader.descriptor = anew;
    }
    open_.push_back(reader);
    readers_ = 1;
  } else if (starts_with(to, "tcp:")) {
    listen_tcp(to.substr(4));
  } else if (starts_with(to, "unix:")) {
    listen_unix(to.substr(5));
  } else {
    throw InputError(
        fmt::format("--live \"{}\": give nothing or \"-\" for stdout, tcp:PORT, or unix:PATH", to));
  }
}

void FrameSinks::listen_tcp(const std::string& port) {
  std::uint16_t number = 0;
  const auto [stop, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc() || stop != port.data() + port.size())
    throw InputError(
        fmt::format("--live {}: a port is a number from 0 to 65535; only this machine is listened "
                    "to, so that none is named",
                    name_));
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener_ < 0) refuse(name_);
  const int on = 1;
  (void)::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(number);
  auto* general = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof address;
  if (::bind(listener_, general, size) != 0 || ::listen(listener_, 8) != 0 ||
      ::getsockname(listener_, general, &size) != 0)
    refuse(name_);
  name_ = fmt::format("tcp:{}", ntohs(address.sin_port));
}

void FrameSinks::listen_unix(const std::string& path) {
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw InputError(
        fmt::format("--live {}: a socket's path has 1 to {} characters", name_, sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, path.data(), path.size());
  listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener_ < 0) refuse(name_);
  struct stat status = {};
  // left by a run that was killed
  if (::stat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode) && !answers(address))
    ::unlink(path.c_str());
  const mode_t before = ::umask(0077);  // nobody else's
  const bool bound = ::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  ::umask(before);
  if (!bound || ::listen(listener_, 8) != 0) refuse(name_);
  path_ = path;
}

FrameSinks::~FrameSinks() {
  for (const Reader& reader : open_)
    if (reader.descriptor != STDOUT_FILENO) ::close(reader.descriptor);
  if (listener_ >= 0) ::close(listener_);
  if (!path_.empty()) ::unlink(path_.c_str());
}

void FrameSinks::let_in(const std::string& header) {
  if (listener_ < 0 && !greeted_) {
    greeted_ = true;
    open_.front().pending = header;
    push(open_.front());
  }
  if (listener_ < 0) return;
  for (int descriptor = 0;
       (descriptor = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0;) {
    const int on = 1;
    if (path_.empty()) (void)::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    open_.push_back({descriptor, true, header});
    ++readers_;
    push(open_.back());
  }
}

// As much of what is pending as goes without waiting.
void FrameSinks::push(Reader& reader) {
  std::size_t done = 0;
  while (done < reader.pending.size()) {
    const char* from = reader.pending.data() + done;
    const std::size_t size = reader.pending.size() - done;
    const ssize_t went = reader.socket ? ::send(reader.descriptor, from, size, MSG_DONTWAIT | MSG_NOSIGNAL)
                                       : ::write(reader.descriptor, from, size);
    if (went >= 0) {
      done += static_cast<std::size_t>(went);
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      break;
    } else if (errno != EINTR) {
      if (listener_ < 0 && (errno == EPIPE || errno == ECONNRESET)) throw ReaderClosedPipe();
      if (listener_ < 0) throw InputError("stdout", fmt::format("cannot write: {}", std::strerror(errno)));
      reader.gone = true;
      return;
    }
  }
  reader.pending.erase(0, done);
}

void FrameSinks::send(const std::string& frame) {
  for (Reader& reader : open_) {
    push(reader);
    if (reader.gone) continue;
    if (!reader.pending.empty()) {
      ++dropped_;
      continue;
    }
    reader.pending = frame;
    push(reader);
    ++sent_;
  }
  std::erase_if(open_, [](const Reader& reader) {
    if (reader.gone) ::close(reader.descriptor);
    return reader.gone;
  });
}

void FrameSinks::flush() {
  const auto until = std::chrono::steady_clock::now() + kLastWait;
  for (Reader& reader : open_)
    while (!reader.gone && !reader.pending.empty() && std::chrono::steady_clock::now() < until) {
      check_stop();
      pollfd wait = {reader.descriptor, POLLOUT, 0};
      (void)::poll(&wait, 1, 50);
      push(reader);
    }
}

}  // namespace flexel::simulate
