// The number of a process says nothing on another machine or in another container that shares the folder, and
// a lock nothing between a file's writing and its renaming: only where both are gone, and nobody has written to it for
// an hour, is a file stale.
#include "base/files/hidden_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

namespace flexel {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".tmp";
constexpr std::time_t kStaleAfter = 3600;  // s

// Without process, count and ending.
std::string beginning_of(const std::string& target) {
  // stays within the 255 bytes of file systems
  return fmt::format(".{}.", fs::path(target).filename().string().substr(0, 200));
}

// The process of "BEGINNING123-4.tmp".
std::optional<pid_t> process_of(std::string_view name, std::string_view beginning) {
  if (!name.starts_with(beginning) || !name.ends_with(kEnding) ||
      name.size() < beginning.size() + kEnding.size())
    return std::nullopt;
  name.remove_prefix(beginning.size());
  name.remove_suffix(kEnding.size());
  const char* end = name.data() + name.size();
  pid_t process = 0;
  unsigned count = 0;
  const auto [dash, bad_process] = std::from_chars(name.data(), end, process);
  if (bad_process != std::errc() || dash == end || *dash != '-' || process <= 0) return std::nullopt;
  const auto [rest, bad_count] = std::from_chars(dash + 1, end, count);
  return bad_count == std::errc() && rest == end ? std::optional(process) : std::nullopt;
}

// All hidden names that end so.
std::vector<std::string> hidden_names(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::string name = entry->path().filename().string();
    if (name.starts_with('.') && name.ends_with(kEnding)) names.push_back(std::move(name));
  }
  return names;
}

void remove_if_stale(const std::string& path, pid_t process) {
  if (::kill(process, 0) == 0 || errno != ESRCH) return;
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (descriptor < 0) return;
  struct stat status = {};
  if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == ::geteuid() &&
      status.st_mtime < std::time(nullptr) - kStaleAfter && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0)
    ::unlink(path.c_str());
  ::close(descriptor);
}

}  // namespace

std::string hidden_beside(const std::string& target) {
  static std::atomic<unsigned> count{0};
  const std::string name = fmt::format("{}{}-{}{}", beginning_of(target), ::getpid(), count++, kEnding);
  return (fs::path(target).parent_path() / name).string();
}

void hold_hidden(int descriptor) {
  (void)::flock(descriptor, LOCK_EX | LOCK_NB);
}

void remove_stale_hidden(const std::string& target) noexcept {
  static std::mutex one_at_a_time;
  static std::map<std::string, std::vector<std::string>> looked_through;
  try {
    const fs::path folder = fs::path(target).has_parent_path() ? fs::path(target).parent_path() : ".";
    const std::lock_guard lock(one_at_a_time);
    const auto [found, fresh] = looked_through.try_emplace(folder.string());
    if (fresh) found->second = hidden_names(folder);
    const std::string beginning = beginning_of(target);
    for (const std::string& name : found->second)
      if (const auto process = process_of(name, beginning))
        remove_if_stale((folder / name).string(), *process);
  } catch (const std::exception&) {
    return;  // what is stale may stay
  }
}

}  // namespace flexel
