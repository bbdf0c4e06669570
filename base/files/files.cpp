// Reading whole files and pipes, file names, zlib, content hash. A buffer grows by a megabyte at a time and
// is read into at once, while the zeroed memory is still in the cache.
#include "base/files/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "base/error.h"
#include "base/files/pipe_code.h"
#include "base/stop.h"

namespace flexel {
namespace {

constexpr std::size_t kStep = std::size_t{1} << 20;

class Descriptor {
 public:
  explicit Descriptor(const std::string& path) : owned_(path != "-") {
    do {
      check_stop();
      value_ = owned_ ? ::open(path.c_str(), O_RDONLY | O_CLOEXEC) : STDIN_FILENO;
    } while (value_ < 0 && errno == EINTR);
    if (value_ < 0) throw InputError(path, fmt::format("cannot read: {}", std::strerror(errno)));
  }
  ~Descriptor() {
    if (owned_) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int value() const { return value_; }

 private:
  bool owned_;
  int value_ = -1;
};

// Returns when a read would not wait. A signal that arrives just before the wait would go unseen, so that it
// is looked for ten times a second.
void wait_until_readable(int descriptor) {
  constexpr int kInterval = 100;  // ms
  pollfd wait = {descriptor, POLLIN, 0};
  int ready = 0;
  while (ready == 0 || (ready < 0 && errno == EINTR)) {
    check_stop();
    ready = ::poll(&wait, 1, kInterval);
  }
}

// Reads until the end of the file; `expected` is its size as far as is known.
Bytes read_to_end(int descriptor, std::size_t expected, const std::string& where) {
  Bytes bytes;
  bytes.reserve(expected + 1);  // one more, so that the end is seen without growing
  std::size_t size = 0;
  for (;;) {
    if (size == bytes.size()) {
      const bool full = bytes.size() == bytes.capacity();
      if (full) bytes.reserve(std::max(2 * bytes.capacity(), kStep));
      bytes.resize(std::min(bytes.size() + kStep, bytes.capacity()));
    }
    wait_until_readable(descriptor);
    const ssize_t got = ::read(descriptor, bytes.data() + size, bytes.size() - size);
    if (got == 0) break;
    if (got > 0) {
      // A larger pipe lets the program before this one run ahead. Only a wish, of regular files too.
      if (size == 0) (void)::fcntl(descriptor, F_SETPIPE_SZ, static_cast<int>(kStep));
      size += static_cast<std::size_t>(got);
    } else if (errno == EINTR) {
      check_stop();
    } else {
      throw InputError(where, fmt::format("cannot read: {}", std::strerror(errno)));
    }
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace

Bytes read_all(const std::string& path) {
  const bool from_stdin = path == "-";
  if (from_stdin && isatty(STDIN_FILENO) != 0)
    throw InputError("stdin is a terminal: name a file, or pipe the output of another program in");
  const std::string where = from_stdin ? "stdin" : path;
  const Descriptor descriptor(path);
  struct stat status = {};
  if (::fstat(descriptor.value(), &status) != 0)
    throw InputError(where, fmt::format("cannot read: {}", std::strerror(errno)));
  if (S_ISDIR(status.st_mode)) throw InputError(where, "is a folder; name a file in it");
  const std::size_t expected = S_ISREG(status.st_mode) ? static_cast<std::size_t>(status.st_size) : 0;
  Bytes bytes = read_to_end(descriptor.value(), expected, where);
  if (bytes.empty() && from_stdin)
    if (const std::optional<int> code = code_told_through_pipe(descriptor.value()))
      throw ProgramBeforeFailed(*code);
  if (bytes.empty() && from_stdin)
    throw InputError("stdin is empty: the program before it in the pipe failed or wrote nothing");
  if (bytes.empty()) throw InputError(where, "is empty");
  return bytes;
}

std::string extension(const std::string& path) {
  std::string text = std::filesystem::path(path).extension().string();
  if (!text.empty()) text.erase(0, 1);
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string stem(const std::string& path) {
  return std::filesystem::path(path).stem().string();
}

Bytes compress(std::span<const std::byte> data, int level) {
  uLongf size = compressBound(data.size());
  Bytes packed(size);
  const int code = compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                             reinterpret_cast<const Bytef*>(data.data()), data.size(), level);
  if (code == Z_MEM_ERROR) throw std::bad_alloc();
  if (code != Z_OK) throw std::logic_error(fmt::format("zlib refused to compress (code {})", code));
  packed.resize(size);
  return packed;
}

Bytes decompress(std::span<const std::byte> data, std::size_t expected_size) {
  // Deflate never packs better than 1032:1, so a size beyond that is a lie and must not be allocated.
  constexpr std::size_t kBestRatio = 1032;
  if (expected_size / kBestRatio > data.size())
    throw InputError(
        fmt::format("compressed data is damaged: {} bytes cannot hold {}", data.size(), expected_size));
  Bytes plain(expected_size + 1);  // one more, so that data that goes on is seen
  uLongf size = plain.size();
  uLong used = data.size();
  const int code = uncompress2(reinterpret_cast<Bytef*>(plain.data()), &size,
                               reinterpret_cast<const Bytef*>(data.data()), &used);
  if (code == Z_MEM_ERROR) throw std::bad_alloc();
  if (code != Z_OK || size != expected_size || used != data.size())
    throw InputError("compressed data is damaged");
  plain.pop_back();
  return plain;
}

std::uint64_t content_hash(std::span<const std::byte> data) {
  std::uint64_t hash = 14695981039346656037u;
  for (const std::byte byte : data) {
    hash ^= static_cast<std::uint64_t>(byte);
    hash *= 1099511628211u;
  }
  return hash;
}

}  // namespace flexel
