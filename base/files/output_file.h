// Output files, written whole or not at all.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel {

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
  bool committed_ = false, replaces_ = false;
  std::vector<char> buffer_;
};

// Throws now what OutputFile would throw of `path` when it is made: the end of a long run is late to learn of
// a folder that is not there. Devices and FIFOs are not opened; "": no output.
void refuse_unwritable(const std::string& path, bool binary = true);

// A whole text to `path`, as OutputFile does.
void write_text(const std::string& text, const std::string& path, bool alone = false);

// While one lives, OutputFiles to `paths` are written, but appear under their names only by appear(): a disk
// that is full at the second leaves the first as it was. Not to be nested.
class OutputsTogether {
 public:
  explicit OutputsTogether(std::vector<std::string> paths);
  ~OutputsTogether();
  OutputsTogether(const OutputsTogether&) = delete;
  OutputsTogether& operator=(const OutputsTogether&) = delete;
  // Throws InputError: a file cannot be renamed.
  void appear();

 private:
  friend class OutputFile;
  struct Waiting {
    std::string path, temporary, target;
  };
  static bool takes(const std::string& path, const std::string& temporary, const std::string& target);
  static OutputsTogether* present_;
  std::vector<std::string> paths_;
  std::vector<Waiting> waiting_;
};

}  // namespace flexel
