// memfd_create(): Linux.
#include "base/files/memory_file.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <new>

namespace flexel {

MemoryFile::MemoryFile() : descriptor_(memfd_create("flexel", MFD_CLOEXEC)) {
  if (descriptor_ < 0) throw std::bad_alloc();
}

MemoryFile::MemoryFile(const Bytes& bytes) : MemoryFile() {
  if (!write_whole(descriptor_, bytes) || lseek(descriptor_, 0, SEEK_SET) != 0) throw std::bad_alloc();
}

MemoryFile::~MemoryFile() {
  close(descriptor_);
}

std::string MemoryFile::path() const {
  return fmt::format("/proc/self/fd/{}", descriptor_);
}

Bytes MemoryFile::bytes() const {
  return read_all(path());
}

bool write_whole(int descriptor, const Bytes& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = write(descriptor, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

}  // namespace flexel
