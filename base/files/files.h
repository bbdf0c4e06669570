// Bytes in and out. Outputs are written beside their target and renamed, so that nothing half-written is ever
// left under the output's name.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexel {

using Bytes = std::vector<std::byte>;

// The Flexel program before this one in a pipe failed with `code` and printed why (base/files/pipe_code.h).
class ProgramBeforeFailed : public std::runtime_error {
 public:
  explicit ProgramBeforeFailed(int code) : std::runtime_error("the program before it failed"), code_(code) {}
  [[nodiscard]] int code() const { return code_; }

 private:
  int code_;
};

// The whole of a file, or of stdin for "-". Throws InputError: missing, a directory, unreadable, empty (for
// stdin: "the program before it in the pipe failed or wrote nothing"). Throws ProgramBeforeFailed.
[[nodiscard]] Bytes read_all(const std::string& path);

// What `path` stands for once links are followed; it need not exist. Throws InputError: a ring of links.
[[nodiscard]] std::string follow_links(const std::string& path);

// Whether `path` names stdout: "-", "/dev/stdout".
[[nodiscard]] bool means_stdout(const std::string& path);

// Removes the temporary files of all writers. Only for a signal handler that ends the process: safe there,
// and nowhere needed else.
void remove_temporary_outputs();

// Lower-case extension without the dot ("stl"), "" where there is none.
[[nodiscard]] std::string extension(const std::string& path);
// Last part of a path without its extension.
[[nodiscard]] std::string stem(const std::string& path);

// zlib (RFC 1950). decompress throws InputError when the data is damaged or its size is not `expected_size`.
[[nodiscard]] Bytes compress(std::span<const std::byte> data, int level = 6);
[[nodiscard]] Bytes decompress(std::span<const std::byte> data, std::size_t expected_size);

// 64-bit FNV-1a of the bytes, for telling files apart (not for security).
[[nodiscard]] std::uint64_t content_hash(std::span<const std::byte> data);

}  // namespace flexel
