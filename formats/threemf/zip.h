// ZIP archives in memory (PKWARE APPNOTE 6.3): what 3MF needs of them, which is stored and deflated entries. Entries
// that nobody changes are copied with their packed bytes.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel {

// What an archive's directory says of one file.
struct ZipEntry {
  std::string name;
  std::uint16_t made_by = 20, flags = 0, method = 0, time = 0, date = 0x21;  // 1980-01-01
  std::uint32_t checksum = 0, attributes = 0;
  std::uint64_t packed = 0, size = 0;  // bytes
  std::uint64_t header = 0;            // where its local header begins
};

// The name of the file that an archive begins with, by its first bytes; "" where they are none of an archive.
[[nodiscard]] std::string_view first_zip_entry(std::string_view beginning);

// Whether a file in an archive is AMF, by its name.
[[nodiscard]] bool is_amf_name(std::string_view name);

class ZipArchive {
 public:
  // The bytes must outlive this. Throws InputError: no ZIP archive, damaged, cut off.
  ZipArchive(std::span<const std::byte> bytes, std::string where);
  [[nodiscard]] const std::vector<ZipEntry>& entries() const { return entries_; }
  // The first entry of that name; case does not count.
  [[nodiscard]] std::optional<std::size_t> find(const std::string& name) const;
  // Unpacked. Throws InputError: damaged, encrypted, sizes that cannot be; with all that was read before it more
  // than a hundred times the archive (and 256 MB), or than memory holds.
  [[nodiscard]] Bytes read(std::size_t entry);
  // As it is packed. Throws InputError: damaged.
  [[nodiscard]] std::span<const std::byte> packed(std::size_t entry) const;

 private:
  [[nodiscard]] std::uint64_t number(std::uint64_t at, int width) const;
  [[nodiscard]] std::uint64_t find_end() const;
  void read_directory();
  [[nodiscard]] std::uint64_t read_entry(std::uint64_t at);
  void read_large_sizes(ZipEntry& entry, std::uint64_t at, std::uint64_t length) const;
  void refuse_bomb(std::uint64_t size);
  [[noreturn]] void fail(const std::string& why) const;

  std::span<const std::byte> bytes_;
  std::string where_;
  std::uint64_t unpacked_ = 0;  // bytes read so far
  std::vector<ZipEntry> entries_;
  std::map<std::string, std::size_t> by_name_;  // in lower case
};

// Archives whose bytes depend on their content only. Throws InputError beyond 4 GB, where another layout begins.
class ZipWriter {
 public:
  // A new file, deflated.
  void add(const std::string& name, std::string_view data);
  // An entry of another archive, as it is, or with other content.
  void copy(const ZipArchive& archive, std::size_t entry);
  void replace(const ZipArchive& archive, std::size_t entry, std::string_view data);
  [[nodiscard]] Bytes finish();

 private:
  void put(ZipEntry entry, std::span<const std::byte> packed);
  Bytes archive_;
  std::vector<ZipEntry> entries_;
};

}  // namespace flexel
