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

// Where a result goes. Data is appended in pieces; nothing appears under the target's name until commit().
// "-" writes to stdout: refused (InputError) when stdout is a terminal and `binary`. All errors of the disk
// (full, read-only, no such folder) are InputError naming the path and the reason; a closed pipe is
// ReaderClosedPipe. A writer destroyed without commit() removes its temporary file.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path, bool binary = true);
  // Into `memory`, which must outlive it.
  explicit OutputFile(Bytes& memory) : memory_(&memory) {}
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  void write(const void* data, std::size_t size);
  void write(const std::string& text) { write(text.data(), text.size()); }
  // Where an OutputsTogether (base/files/outputs.h) waits for the file, it appears with the others; `alone`:
  // now.
  void commit(bool alone = false);

 private:
  void open_file();
  void flush_buffer();
  void write_through(const char* data, std::size_t size);
  Bytes* memory_ = nullptr;
  std::string path_;       // as given
  std::string target_;     // the path with symbolic links resolved
  std::string temporary_;  // "" for stdout, devices and FIFOs, and once committed
  int descriptor_ = -1;
  bool committed_ = false;
  std::vector<char> buffer_;
};

// Throws now what OutputFile would throw of `path` when it is made: the end of a long run is late to learn of
// a folder that is not there. Devices and FIFOs are not opened; "": no output.
void refuse_unwritable(const std::string& path, bool binary = true);

// A whole text to `path`, as OutputFile does.
void write_text(const std::string& text, const std::string& path, bool alone = false);

// `path` with symbolic links resolved; it need not exist. Throws InputError: a cycle of links.
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
