// OutputFile. A regular file is written beside its target under a hidden name (base/files/hidden_file.h) and
// renamed by commit(). Symbolic links are resolved first, so the file is replaced and not the link. Devices
// and FIFOs are written directly. A fixed table lists the temporary files, for the signal handlers.
#include "base/files/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "base/error.h"
#include "base/files/ending_waits.h"
#include "base/files/files.h"
#include "base/files/hidden_file.h"
#include "base/stop.h"

namespace flexel {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 20;

// Names of the temporary files that exist now, for the signal handlers: no allocation, no lock.
struct TemporaryName {
  std::atomic<bool> used{false};
  std::atomic<bool> complete{false};
  std::array<char, 4096> name{};
};
std::array<TemporaryName, 16> temporary_names;

void remember_temporary(const std::string& name) {
  for (TemporaryName& entry : temporary_names) {
    if (name.size() < entry.name.size() && !entry.used.exchange(true)) {
      std::memcpy(entry.name.data(), name.c_str(), name.size() + 1);
      entry.complete = true;
      return;
    }
  }  // a full table only means that a killed program leaves its hidden file behind
}

void forget_temporary(const std::string& name) {
  for (TemporaryName& entry : temporary_names) {
    if (entry.complete && name == entry.name.data()) {
      entry.complete = false;
      entry.used = false;
      return;
    }
  }
}

[[noreturn]] void refuse(const std::string& path, int error) {
  const bool full = error == ENOSPC || error == EDQUOT;
  throw InputError(path == "-" ? "stdout" : path,
                   fmt::format("cannot write: {}{}", std::strerror(error),
                               full ? "; free some space or write to another disk" : ""));
}

int open_or_refuse(const std::string& name, int flags, mode_t mode, const std::string& path) {
  for (;;) {
    const int descriptor = ::open(name.c_str(), flags | O_CLOEXEC, mode);
    if (descriptor >= 0) return descriptor;
    if (errno != EINTR) refuse(path, errno);
    check_stop();
  }
}

// A name that the file system cannot hold would be seen only when the temporary file is renamed.
void refuse_long_name(const std::string& target, const std::string& path) {
  const std::filesystem::path name = target;
  const std::string folder = name.has_parent_path() ? name.parent_path().string() : ".";
  const long longest = ::pathconf(folder.c_str(), _PC_NAME_MAX);
  if (longest > 0 && name.filename().string().size() > static_cast<std::size_t>(longest))
    refuse(path, ENAMETOOLONG);
}

// "{part}" stands for any text.
bool fits(const std::string& pattern, const std::string& path) {
  const std::string part = "{part}";
  const std::size_t at = pattern.find(part);
  if (at == std::string::npos) return path == pattern;
  const std::string_view before = std::string_view(pattern).substr(0, at),
                         after = std::string_view(pattern).substr(at + part.size());
  return path.size() >= before.size() + after.size() && path.starts_with(before) && path.ends_with(after);
}

// What was under the target's name before a new file is there.
enum class Replaced { nothing, kept_aside, lost };

// Both names change places at once. False: the file system, or the kernel, cannot; or one is not there.
bool exchange(const std::string& a, const std::string& b, const std::string& path) {
  if (::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0) return true;
  if (errno == EINVAL || errno == ENOSYS || errno == ENOTSUP || errno == ENOENT) return false;
  refuse(path, errno);
}

// An old file takes the new one's hidden name, under which it can be brought back.
Replaced put_in_place(const std::string& temporary, const std::string& target, const std::string& path) {
  const bool exists = ::access(target.c_str(), F_OK) == 0;
  if (exists && exchange(temporary, target, path)) return Replaced::kept_aside;
  if (::rename(temporary.c_str(), target.c_str()) != 0) refuse(path, errno);
  return exists ? Replaced::lost : Replaced::nothing;
}

void take_back(const std::string& temporary, const std::string& target, Replaced replaced) {
  if (replaced == Replaced::kept_aside)
    (void)::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE);
  else if (replaced == Replaced::nothing)
    ::unlink(target.c_str());
}

}  // namespace

bool means_stdout(const std::string& path) {
  return path == "-" || path == "/dev/stdout" || path == "/dev/fd/1" || path == "/proc/self/fd/1";
}

std::string follow_links(const std::string& path) {
  constexpr int kMostLinks = 40;  // as the kernel
  std::filesystem::path target = path;
  std::error_code none;
  for (int links = 0; std::filesystem::is_symlink(target, none); ++links) {
    if (links == kMostLinks) refuse(path, ELOOP);
    const std::filesystem::path next = std::filesystem::read_symlink(target, none);
    if (none) refuse(path, none.value());
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target.string();
}

void remove_temporary_outputs() {
  for (const TemporaryName& entry : temporary_names)
    if (entry.complete) ::unlink(entry.name.data());
}

OutputFile::OutputFile(const std::string& path, bool binary) : path_(path), target_(path) {
  buffer_.reserve(kBufferSize);  // before there is a file that would be left behind
  if (path.empty()) throw InputError("the name of the output is empty");
  if (means_stdout(path)) {
    if (binary && isatty(STDOUT_FILENO) != 0)
      throw InputError(
          "the result is binary and stdout is a terminal: name a file with -o, or pipe it into a program");
    descriptor_ = STDOUT_FILENO;
    (void)::fcntl(descriptor_, F_SETPIPE_SZ, static_cast<int>(kBufferSize));  // only a wish
  } else {
    open_file();
  }
}

void OutputFile::open_file() {
  struct stat status = {};
  const bool exists = ::stat(path_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) throw InputError(path_, "is a folder; name a file in it");
  if (exists && !S_ISREG(status.st_mode)) {
    descriptor_ = open_or_refuse(path_, O_WRONLY, 0, path_);
    return;
  }
  if (exists && ::access(path_.c_str(), W_OK) != 0) refuse(path_, errno);
  target_ = follow_links(path_);
  refuse_long_name(target_, path_);
  remove_stale_hidden(target_);
  std::string name = hidden_beside(target_);
  const EndingWaits until_it_is_known;
  descriptor_ = open_or_refuse(name, O_WRONLY | O_CREAT | O_TRUNC, 0666, path_);  // narrowed by the umask
  hold_hidden(descriptor_);
  temporary_ = std::move(name);
  remember_temporary(temporary_);
  replaces_ = exists;
  if (exists) (void)::fchmod(descriptor_, status.st_mode & 07777);  // overwriting keeps the permissions
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0 && descriptor_ != STDOUT_FILENO) ::close(descriptor_);
  if (temporary_.empty()) return;
  ::unlink(temporary_.c_str());
  forget_temporary(temporary_);
}

void OutputFile::write(const void* data, std::size_t size) {
  if (buffer_.size() + size > kBufferSize) flush_buffer();
  const char* bytes = static_cast<const char*>(data);
  if (size >= kBufferSize)
    write_through(bytes, size);
  else
    buffer_.insert(buffer_.end(), bytes, bytes + size);
}

void OutputFile::flush_buffer() {
  write_through(buffer_.data(), buffer_.size());
  buffer_.clear();
}

void OutputFile::write_through(const char* data, std::size_t size) {
  if (memory_ != nullptr) {
    const auto* bytes = reinterpret_cast<const std::byte*>(data);
    memory_->insert(memory_->end(), bytes, bytes + size);
    return;
  }
  while (size > 0) {
    const ssize_t written = ::write(descriptor_, data, size);
    if (written >= 0) {
      data += written;
      size -= static_cast<std::size_t>(written);
    } else if (errno == EPIPE) {
      throw ReaderClosedPipe();
    } else if (errno == EINTR) {
      check_stop();
    } else {
      refuse(path_, errno);
    }
  }
}

void OutputFile::commit(bool alone) {
  if (committed_) return;
  flush_buffer();
  committed_ = true;
  if (descriptor_ == STDOUT_FILENO || memory_ != nullptr) return;
  // Were the power lost after the renaming, the old result would be gone and the new one not yet on the disk.
  if (replaces_ && ::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP) refuse(path_, errno);
  const int closed =
      ::close(std::exchange(descriptor_, -1));  // some disks report only here that they are full
  if (closed != 0 && errno != EINTR) refuse(path_, errno);
  if (temporary_.empty()) return;
  if (alone || !OutputsTogether::takes(path_, temporary_, target_)) {
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) refuse(path_, errno);
    forget_temporary(temporary_);
  }
  temporary_.clear();
}

OutputsTogether* OutputsTogether::present_ = nullptr;

OutputsTogether::OutputsTogether(std::vector<std::string> paths) : paths_(std::move(paths)) {
  present_ = this;
}

OutputsTogether::~OutputsTogether() {
  present_ = nullptr;
  for (const Waiting& each : waiting_) {
    ::unlink(each.temporary.c_str());
    forget_temporary(each.temporary);
  }
}

bool OutputsTogether::takes(const std::string& path, const std::string& temporary,
                            const std::string& target) {
  if (present_ == nullptr || std::none_of(present_->paths_.begin(), present_->paths_.end(),
                                          [&](const std::string& each) { return fits(each, path); }))
    return false;
  present_->waiting_.push_back({path, temporary, target});
  return true;
}

// Where one cannot be renamed, those before it are as they were again, but on a file system that cannot exchange
// two names (renameat2(2)).
void OutputsTogether::appear() {
  const EndingWaits until_all_are_there;
  std::vector<Replaced> replaced;
  replaced.reserve(waiting_.size());
  try {
    for (const Waiting& each : waiting_)
      replaced.push_back(put_in_place(each.temporary, each.target, each.path));
  } catch (const InputError&) {
    for (std::size_t n = replaced.size(); n-- > 0;)
      take_back(waiting_[n].temporary, waiting_[n].target, replaced[n]);
    throw;
  }
  for (std::size_t n = 0; n < waiting_.size(); ++n) {
    if (replaced[n] == Replaced::kept_aside) ::unlink(waiting_[n].temporary.c_str());
    forget_temporary(waiting_[n].temporary);
  }
  waiting_.clear();
}

void refuse_unwritable(const std::string& path, bool binary) {
  struct stat status = {};
  const bool exists = !means_stdout(path) && ::stat(path.c_str(), &status) == 0;
  const bool opening_tells_others = exists && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
  if (!path.empty() && !opening_tells_others) OutputFile(path, binary);
}

void write_text(const std::string& text, const std::string& path, bool alone) {
  OutputFile file(path, false);
  file.write(text);
  file.commit(alone);
}

}  // namespace flexel
