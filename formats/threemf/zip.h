// Reading ZIP archives in memory. Inside flexel_import; libzip is seen by zip.cpp only.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/files/files.h"

struct zip;

namespace flexel {

class ZipArchive {
 public:
  // The bytes must outlive this. Throws InputError: no ZIP archive, damaged, cut off.
  ZipArchive(std::span<const std::byte> bytes, std::string where);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;
  [[nodiscard]] std::vector<std::string> names() const;
  // The file of that name (case does not count), unpacked; nothing where there is none. Throws InputError:
  // damaged, encrypted, sizes that cannot be; with all that was read before it more than a hundred times the
  // archive (and 256 MB), or than memory holds.
  [[nodiscard]] std::optional<Bytes> read(const std::string& name);

 private:
  std::string where_;
  std::uint64_t packed_ = 0, unpacked_ = 0;  // bytes: of the archive, and read so far
  zip* archive_ = nullptr;
};

}  // namespace flexel
