// Reading ZIP archives in memory. Inside flexel_import; libzip is seen by zip.cpp only.
#pragma once
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
  // damaged, encrypted, unpacks to more than ZIP can pack.
  [[nodiscard]] std::optional<Bytes> read(const std::string& name) const;

 private:
  std::string where_;
  zip* archive_ = nullptr;
};

}  // namespace flexel
