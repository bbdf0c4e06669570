// The hidden files that outputs are written to before they are renamed: ".NAME.PROCESS-COUNT.tmp" beside
// NAME. The process that writes one holds a lock (flock) on it; one that was killed leaves it behind.
#pragma once
#include <string>

namespace flexel {

// A name beside `target` that no other run uses.
[[nodiscard]] std::string hidden_beside(const std::string& target);

// Marks an open hidden file as being written, until it is closed. Where the file system has no locks nothing happens.
void hold_hidden(int descriptor);

// Removes the hidden files of this target whose process is no more: nobody holds the lock, no process has the
// number, and the file is one of this user's. Where one of these cannot be told, the file stays. Each folder
// is looked through once in the life of the process. Never throws.
void remove_stale_hidden(const std::string& target) noexcept;

}  // namespace flexel
