// A file without a place in any folder: it is in memory, and nothing is left of it however the program ends.
#pragma once
#include <string>

#include "base/files/files.h"

namespace flexel {

// Throws std::bad_alloc: there is no memory for it.
class MemoryFile {
 public:
  MemoryFile();
  explicit MemoryFile(const Bytes& bytes);  // to be read from its beginning
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  [[nodiscard]] int descriptor() const { return descriptor_; }
  // For libraries that know files by their names: it is one as long as this lives, in this process only.
  [[nodiscard]] std::string path() const;
  [[nodiscard]] Bytes bytes() const;

 private:
  int descriptor_ = -1;
};

// All of the bytes; false: they could not be written.
[[nodiscard]] bool write_whole(int descriptor, const Bytes& bytes);

}  // namespace flexel
