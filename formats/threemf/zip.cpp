// Sizes are checked before memory is allocated.
#include "formats/threemf/zip.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <new>
#include <stdexcept>
#include <utility>

#include "base/error.h"
#include "base/printable.h"
#include "base/resources.h"
#include "base/units.h"

namespace flexel {
namespace {

// Deflate packs no better than 1032 to 1, and no model, XML of numbers, better than some 20 to 1.
constexpr std::uint64_t kBestRatio = 1032, kSoundRatio = 100, kAlwaysSound = 256'000'000;
constexpr double kBytesToRead = 6;  // of memory a byte of XML

constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50, kLargeEnd = 0x06064b50,
                        kLargeLocator = 0x07064b50;
constexpr std::uint64_t kLocalSize = 30, kCentralSize = 46, kEndSize = 22, kLocatorSize = 20,
                        kLargeEndSize = 56, kSays32 = 0xffffffff;
constexpr std::uint16_t kStored = 0, kDeflated = 8, kEncrypted = 1, kSizesFollow = 8, kVersion = 20;

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// zlib counts in 32 bits.
uInt piece(std::uint64_t left) {
  return static_cast<uInt>(std::min<std::uint64_t>(left, 1u << 30));
}

std::uint32_t checksum_of(std::span<const std::byte> data) {
  uLong sum = crc32(0, nullptr, 0);
  for (std::size_t at = 0; at < data.size(); at += piece(data.size() - at))
    sum = crc32(sum, reinterpret_cast<const Bytef*>(data.data() + at), piece(data.size() - at));
  return static_cast<std::uint32_t>(sum);
}

// True where `packed` unpacks to exactly `out`.
bool inflate_raw(std::span<const std::byte> packed, Bytes& out) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  std::byte beyond{};  // data that goes on past the end is damaged
  std::size_t taken = 0, made = 0;
  int code = Z_OK;
  while (code == Z_OK) {
    const bool full = made == out.size();
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data() + taken));
    stream.avail_in = piece(packed.size() - taken);
    stream.next_out = reinterpret_cast<Bytef*>(full ? &beyond : out.data() + made);
    stream.avail_out = full ? 1 : piece(out.size() - made);
    const uInt in = stream.avail_in, room = stream.avail_out;
    code = inflate(&stream, Z_NO_FLUSH);
    taken += in - stream.avail_in;
    made += room - stream.avail_out;
    if (made > out.size()) break;
  }
  inflateEnd(&stream);
  return code == Z_STREAM_END && made == out.size();
}

Bytes deflate_raw(std::span<const std::byte> data) {
  constexpr int kLevel = 6, kMemory = 8;
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, -MAX_WBITS, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  Bytes packed(deflateBound(&stream, data.size()) + 64);
  std::size_t taken = 0, made = 0;
  int code = Z_OK;
  while (code == Z_OK) {
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(data.data() + taken));
    stream.avail_in = piece(data.size() - taken);
    stream.next_out = reinterpret_cast<Bytef*>(packed.data() + made);
    stream.avail_out = piece(packed.size() - made);
    const uInt in = stream.avail_in, room = stream.avail_out;
    code = deflate(&stream, taken + in == data.size() ? Z_FINISH : Z_NO_FLUSH);
    taken += in - stream.avail_in;
    made += room - stream.avail_out;
  }
  deflateEnd(&stream);
  if (code != Z_STREAM_END) throw std::logic_error(fmt::format("zlib refused to compress (code {})", code));
  packed.resize(made);
  return packed;
}

std::span<const std::byte> bytes_of_text(std::string_view text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

void append_number(Bytes& to, std::uint64_t value, int width) {
  for (int i = 0; i < width; ++i) to.push_back(static_cast<std::byte>(value >> 8 * i));
}

// What a local header and the directory have in common.
void append_common(Bytes& to, const ZipEntry& entry) {
  append_number(to, kVersion, 2);
  append_number(to, entry.flags, 2);
  append_number(to, entry.method, 2);
  append_number(to, entry.time, 2);
  append_number(to, entry.date, 2);
  append_number(to, entry.checksum, 4);
  append_number(to, entry.packed, 4);
  append_number(to, entry.size, 4);
  append_number(to, entry.name.size(), 2);
  append_number(to, 0, 2);  // extra field
}

void append_name(Bytes& to, const std::string& name) {
  const auto bytes = bytes_of_text(name);
  to.insert(to.end(), bytes.begin(), bytes.end());
}

}  // namespace

bool is_amf_name(std::string_view name) {
  return lower(std::string(name)).ends_with(".amf");
}

std::string_view first_zip_entry(std::string_view beginning) {
  constexpr std::size_t kNameLength = 26;
  if (beginning.size() < kLocalSize || !beginning.starts_with("PK\x03\x04")) return {};
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(beginning[at]); };
  return beginning.substr(kLocalSize, byte(kNameLength) + 256u * byte(kNameLength + 1));
}

ZipArchive::ZipArchive(std::span<const std::byte> bytes, std::string where)
    : bytes_(bytes), where_(std::move(where)) {
  read_directory();
  for (std::size_t i = 0; i < entries_.size(); ++i) by_name_.emplace(lower(entries_[i].name), i);
}

void ZipArchive::fail(const std::string& why) const {
  throw InputError(where_, fmt::format("is damaged or cut off: it does not open as a ZIP archive ({})", why));
}

std::uint64_t ZipArchive::number(std::uint64_t at, int width) const {
  const auto count = static_cast<std::uint64_t>(width);
  if (at > bytes_.size() || bytes_.size() - at < count) fail("its directory is cut off");
  std::uint64_t value = 0;
  for (std::uint64_t i = 0; i < count; ++i) value |= static_cast<std::uint64_t>(bytes_[at + i]) << 8 * i;
  return value;
}

// The end of the directory lies before a comment of at most 64 kB.
std::uint64_t ZipArchive::find_end() const {
  constexpr std::uint64_t kLongestComment = 0xffff;
  if (bytes_.size() < kEndSize) fail("it has no directory");
  const std::uint64_t last = bytes_.size() - kEndSize;
  for (std::uint64_t at = last; at + kLongestComment >= last; --at) {
    if (number(at, 4) == kEnd && number(at + 20, 2) <= last - at) return at;
    if (at == 0) break;
  }
  fail("it has no directory");
}

void ZipArchive::read_directory() {
  const std::uint64_t end = find_end();
  std::uint64_t count = number(end + 10, 2), begin = number(end + 16, 4);
  if (end >= kLocatorSize && number(end - kLocatorSize, 4) == kLargeLocator) {
    const std::uint64_t large = number(end - kLocatorSize + 8, 8);
    if (large > bytes_.size() || bytes_.size() - large < kLargeEndSize || number(large, 4) != kLargeEnd)
      fail("its directory is not where it says");
    count = number(large + 32, 8);
    begin = number(large + 48, 8);
  }
  if (begin > end || count > (end - begin) / kCentralSize) fail("its directory is not where it says");
  for (std::uint64_t i = 0, at = begin; i < count; ++i) at = read_entry(at);
}

// Returns where the next one begins.
std::uint64_t ZipArchive::read_entry(std::uint64_t at) {
  if (number(at, 4) != kCentral) fail("its directory is damaged");
  ZipEntry entry;
  const auto word = [&](std::uint64_t offset) { return static_cast<std::uint16_t>(number(at + offset, 2)); };
  entry.made_by = word(4);
  entry.flags = word(8);
  entry.method = word(10);
  entry.time = word(12);
  entry.date = word(14);
  entry.checksum = static_cast<std::uint32_t>(number(at + 16, 4));
  entry.packed = number(at + 20, 4);
  entry.size = number(at + 24, 4);
  entry.attributes = static_cast<std::uint32_t>(number(at + 38, 4));
  entry.header = number(at + 42, 4);
  const std::uint64_t name = word(28), extra = word(30), comment = word(32), begin = at + kCentralSize;
  if (bytes_.size() - begin < name + extra + comment) fail("its directory is cut off");
  entry.name.assign(reinterpret_cast<const char*>(bytes_.data() + begin), name);
  read_large_sizes(entry, begin + name, extra);
  entries_.push_back(std::move(entry));
  return begin + name + extra + comment;
}

// ZIP64: numbers of 64 bits in an extra field, in place of those that say 0xffffffff.
void ZipArchive::read_large_sizes(ZipEntry& entry, std::uint64_t at, std::uint64_t length) const {
  const std::uint64_t end = at + length;
  while (end - at >= 4) {
    const std::uint64_t kind = number(at, 2), next = at + 4 + number(at + 2, 2);
    if (next > end) return;
    at += 4;
    for (std::uint64_t* value : {&entry.size, &entry.packed, &entry.header}) {
      if (kind != 1 || *value != kSays32 || next - at < 8) continue;
      *value = number(at, 8);
      at += 8;
    }
    at = next;
  }
}

std::optional<std::size_t> ZipArchive::find(const std::string& name) const {
  const auto found = by_name_.find(lower(name));
  return found == by_name_.end() ? std::nullopt : std::optional(found->second);
}

std::span<const std::byte> ZipArchive::packed(std::size_t entry) const {
  const ZipEntry& about = entries_.at(entry);
  const auto damaged = [&] {
    return InputError(where_, fmt::format("is damaged: \"{}\" in it is not where its directory says",
                                          printable(about.name)));
  };
  if (about.header > bytes_.size() || bytes_.size() - about.header < kLocalSize ||
      number(about.header, 4) != kLocal)
    throw damaged();
  const std::uint64_t begin =
      about.header + kLocalSize + number(about.header + 26, 2) + number(about.header + 28, 2);
  if (begin > bytes_.size() || bytes_.size() - begin < about.packed) throw damaged();
  return bytes_.subspan(begin, about.packed);
}

void ZipArchive::refuse_bomb(std::uint64_t size) {
  unpacked_ += size;
  if (unpacked_ > std::max<std::uint64_t>(kAlwaysSound, kSoundRatio * bytes_.size()))
    throw InputError(where_,
                     fmt::format("unpacks to {}, more than {} times its size: it is damaged, or made to "
                                 "fill the memory",
                                 human_bytes(static_cast<double>(unpacked_)), kSoundRatio));
  if (kBytesToRead * static_cast<double>(unpacked_) > .8 * available_memory())
    throw InputError(where_,
                     fmt::format("needs {} of memory to read, more than is free: export its parts one by "
                                 "one",
                                 human_bytes(kBytesToRead * static_cast<double>(unpacked_))));
}

Bytes ZipArchive::read(std::size_t entry) {
  const ZipEntry& about = entries_.at(entry);
  const auto damaged = [&](const std::string& why) {
    return InputError(
        where_, fmt::format("is damaged: \"{}\" in it does not unpack ({})", printable(about.name), why));
  };
  if ((about.flags & kEncrypted) != 0)
    throw InputError(where_, fmt::format("\"{}\" in it is encrypted", printable(about.name)));
  if (about.method != kStored && about.method != kDeflated)
    throw damaged(fmt::format("method {} is not one of 3MF", about.method));
  if (about.packed > bytes_.size() || about.size / kBestRatio > about.packed ||
      (about.method == kStored && about.size != about.packed))
    throw damaged("its sizes do not agree");
  refuse_bomb(about.size);
  const auto data = packed(entry);
  Bytes bytes(about.size);
  if (about.method == kStored)
    std::copy(data.begin(), data.end(), bytes.begin());
  else if (!inflate_raw(data, bytes))
    throw damaged("its compressed data is damaged");
  if (checksum_of(bytes) != about.checksum) throw damaged("its checksum does not fit");
  return bytes;
}

void ZipWriter::put(ZipEntry entry, std::span<const std::byte> packed) {
  entry.header = archive_.size();
  if (archive_.size() + packed.size() + kLocalSize + entry.name.size() >= kSays32 || entry.size >= kSays32 ||
      entries_.size() >= 0xffff)
    throw InputError("the part does not fit into a 3MF file of less than 4 GB: write another format");
  append_number(archive_, kLocal, 4);
  append_common(archive_, entry);
  append_name(archive_, entry.name);
  archive_.insert(archive_.end(), packed.begin(), packed.end());
  entries_.push_back(std::move(entry));
}

void ZipWriter::add(const std::string& name, std::string_view data) {
  ZipEntry entry;
  entry.name = name;
  const auto bytes = bytes_of_text(data);
  const Bytes packed = deflate_raw(bytes);
  entry.method = kDeflated;
  entry.checksum = checksum_of(bytes);
  entry.packed = packed.size();
  entry.size = bytes.size();
  put(std::move(entry), packed);
}

void ZipWriter::copy(const ZipArchive& archive, std::size_t entry) {
  ZipEntry copy = archive.entries().at(entry);
  copy.flags = static_cast<std::uint16_t>(copy.flags & ~kSizesFollow);  // they are in the header now
  put(std::move(copy), archive.packed(entry));
}

void ZipWriter::replace(const ZipArchive& archive, std::size_t entry, std::string_view data) {
  constexpr std::uint16_t kNameIsUtf8 = 0x0800;
  ZipEntry copy = archive.entries().at(entry);
  const auto bytes = bytes_of_text(data);
  const Bytes packed = deflate_raw(bytes);
  copy.flags &= kNameIsUtf8;
  copy.method = kDeflated;
  copy.checksum = checksum_of(bytes);
  copy.packed = packed.size();
  copy.size = bytes.size();
  put(std::move(copy), packed);
}

Bytes ZipWriter::finish() {
  const std::uint64_t begin = archive_.size();
  for (const ZipEntry& entry : entries_) {
    append_number(archive_, kCentral, 4);
    append_number(archive_, entry.made_by, 2);
    append_common(archive_, entry);
    append_number(archive_, 0, 6);  // comment, disk, text or not
    append_number(archive_, entry.attributes, 4);
    append_number(archive_, entry.header, 4);
    append_name(archive_, entry.name);
  }
  const std::uint64_t size = archive_.size() - begin;
  append_number(archive_, kEnd, 4);
  append_number(archive_, 0, 4);  // disks
  append_number(archive_, entries_.size(), 2);
  append_number(archive_, entries_.size(), 2);
  append_number(archive_, size, 4);
  append_number(archive_, begin, 4);
  append_number(archive_, 0, 2);  // comment
  return std::move(archive_);
}

}  // namespace flexel
