// ZIP archives through libzip, which only this file includes. Sizes are checked before memory is allocated.
#include "formats/threemf/zip.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>

#include "base/available_memory.h"
#include "base/error.h"
#include "base/units.h"

namespace flexel {
namespace {

// Deflate packs no better than 1032 to 1, and no model, XML of numbers, better than some 20 to 1.
constexpr std::uint64_t kBestRatio = 1032, kSoundRatio = 100, kAlwaysSound = 256'000'000;
constexpr double kBytesToRead = 6;  // of memory a byte of XML

}  // namespace

ZipArchive::ZipArchive(std::span<const std::byte> bytes, std::string where)
    : where_(std::move(where)), packed_(bytes.size()) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source != nullptr) archive_ = zip_open_from_source(source, ZIP_RDONLY, &error);
  const std::string reason = archive_ == nullptr ? zip_error_strerror(&error) : "";
  if (archive_ == nullptr && source != nullptr) zip_source_free(source);
  zip_error_fini(&error);
  if (archive_ == nullptr)
    throw InputError(where_,
                     fmt::format("is damaged or cut off: it does not open as a ZIP archive ({})", reason));
}

ZipArchive::~ZipArchive() {
  zip_discard(archive_);
}

std::vector<std::string> ZipArchive::names() const {
  std::vector<std::string> result;
  const zip_int64_t count = zip_get_num_entries(archive_, 0);
  for (zip_int64_t i = 0; i < count; ++i)
    if (const char* name = zip_get_name(archive_, static_cast<zip_uint64_t>(i), 0)) result.emplace_back(name);
  return result;
}

std::optional<Bytes> ZipArchive::read(const std::string& name) {
  const zip_int64_t index = zip_name_locate(archive_, name.c_str(), ZIP_FL_NOCASE);
  if (index < 0) return std::nullopt;
  zip_stat_t about;
  zip_stat_init(&about);
  const auto damaged = [&](const std::string& why) {
    return InputError(where_, fmt::format("is damaged: \"{}\" in it does not unpack ({})", name, why));
  };
  if (zip_stat_index(archive_, static_cast<zip_uint64_t>(index), 0, &about) != 0 ||
      (about.valid & ZIP_STAT_SIZE) == 0 || (about.valid & ZIP_STAT_COMP_SIZE) == 0)
    throw damaged("its size is not known");
  if (about.comp_size > packed_ || about.size / kBestRatio > about.comp_size)
    throw damaged("its sizes do not agree");
  unpacked_ += about.size;
  if (unpacked_ > std::max(kAlwaysSound, kSoundRatio * packed_))
    throw InputError(where_,
                     fmt::format("unpacks to {}, more than {} times its size: it is damaged, or made to "
                                 "fill the memory",
                                 human_bytes(static_cast<double>(unpacked_)), kSoundRatio));
  if (kBytesToRead * static_cast<double>(unpacked_) > .8 * available_memory())
    throw InputError(where_,
                     fmt::format("needs {} of memory to read, more than is free: export its parts one by "
                                 "one",
                                 human_bytes(kBytesToRead * static_cast<double>(unpacked_))));
  zip_file_t* file = zip_fopen_index(archive_, static_cast<zip_uint64_t>(index), 0);
  if (file == nullptr) throw damaged(zip_strerror(archive_));
  Bytes bytes(about.size);
  std::size_t done = 0;
  zip_int64_t read = 1;
  while (done < bytes.size() && read > 0) {
    read = zip_fread(file, bytes.data() + done, bytes.size() - done);
    if (read > 0) done += static_cast<std::size_t>(read);
  }
  // Reading on past the end makes libzip compare the checksum.
  std::byte beyond{};
  const bool whole = done == bytes.size() && zip_fread(file, &beyond, 1) == 0;
  const std::string why = zip_file_strerror(file);
  zip_fclose(file);
  if (!whole) throw damaged(why);
  return bytes;
}

}  // namespace flexel
