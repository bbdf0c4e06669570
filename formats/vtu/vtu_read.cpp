// Reading .vtu. The XML head, up to the "_" that begins the appended data, is parsed first; then offset, size
// and number of tuples of every array are checked. Nothing is allocated for a size that exceeds the bytes
// present.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "base/error.h"
#include "base/parallel.h"
#include "formats/vtu/vtu.h"
#include "formats/vtu/vtu_head.h"

namespace flexel::vtu {
namespace {

// Deflate never packs better than this: a larger size is a lie and must not be allocated.
constexpr std::size_t kBestRatio = 1032;

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

void File::fail(const std::string& what) const {
  throw InputError(where_, what);
}

void File::fail_truncated() const {
  fail(where_ == "stdin"
           ? "the body file is truncated: the program before it in the pipe failed"
           : "the body file is truncated: the program that wrote it was stopped, or its disk was full");
}

File::File(Bytes bytes, std::string where) : bytes_(std::move(bytes)), where_(std::move(where)) {
  const std::size_t head_end = find_data();
  const Head head = parse_head(text_of(bytes_).substr(0, head_end), where_);
  points_ = head.points;
  cells_ = head.cells;
  compressed_ = head.compressed;
  for (const HeadArray& array : head.arrays)
    if (!arrays_.emplace(std::pair(array.section, array.name), locate(array)).second)
      fail(fmt::format("damaged: {} is there twice", array.shown()));
}

// Finds where the appended data begins and ends; returns the end of the head. The end tags come last, so that
// they are missing exactly when something is.
std::size_t File::find_data() {
  const std::string_view text = text_of(bytes_);
  const std::size_t tag = text.find("<AppendedData");
  const std::size_t tag_end = tag == text.npos ? text.npos : text.find('>', tag);
  const std::size_t mark = tag_end == text.npos ? text.npos : text.find_first_not_of(" \t\r\n", tag_end + 1);
  if (mark == text.npos) {
    if (text.find("</VTKFile>") == text.npos) fail_truncated();
    fail("is a .vtu without appended data, not a body file: one written by this suite is needed");
  }
  if (text[mark] != '_') fail("damaged: the appended data does not begin with \"_\"");
  data_begin_ = mark + 1;
  constexpr std::size_t kTail = 128;
  const std::size_t tail_begin = std::max(data_begin_, text.size() - std::min(kTail, text.size()));
  const std::size_t tail = text.substr(tail_begin).rfind("</AppendedData>");
  if (tail == text.npos || text.find("</VTKFile>", tail_begin + tail) == text.npos) fail_truncated();
  data_end_ = tail_begin + tail;
  return tag_end + 1;
}

// The number of tuples that the head claims must be the number that the data have.
File::Stored File::locate(const HeadArray& array) const {
  Stored stored;
  stored.type = array.type;
  stored.components = array.components;
  const std::size_t begin = data_begin_ + array.offset;
  if (compressed_)
    locate_blocks(stored, array.shown(), begin);
  else
    locate_raw(stored, array.shown(), begin);
  const std::size_t tuple_size = scalar_size(array.type) * array.components;
  const bool free_size = array.section == Section::cells && array.name == "connectivity";
  const bool of_cells = array.section == Section::cells || array.section == Section::cell_data;
  stored.tuples = free_size ? stored.size / tuple_size : array.tuples.value_or(of_cells ? cells_ : points_);
  if (stored.size % tuple_size != 0 || stored.size / tuple_size != stored.tuples)
    fail(fmt::format("damaged: {} has {} bytes for {} x {} {}", array.shown(), stored.size, stored.tuples,
                     array.components, array.type));
  return stored;
}

std::uint64_t File::header(std::size_t at) const {
  if (at > data_end_ || data_end_ - at < sizeof(std::uint64_t)) fail_truncated();
  std::uint64_t value = 0;
  std::memcpy(&value, bytes_.data() + at, sizeof value);
  return value;
}

void File::locate_raw(Stored& stored, const std::string& name, std::size_t begin) const {
  stored.size = header(begin);
  stored.begin = begin + sizeof(std::uint64_t);
  if (stored.size > data_end_ - stored.begin)
    fail(fmt::format("damaged or truncated: {} has {} bytes, more than the file holds", name, stored.size));
}

void File::locate_blocks(Stored& stored, const std::string& name, std::size_t begin) const {
  constexpr std::size_t kWord = sizeof(std::uint64_t);
  constexpr std::uint64_t kLargestBlock = std::uint64_t{1} << 31;
  const std::uint64_t blocks = header(begin), block_size = header(begin + kWord),
                      last = header(begin + 2 * kWord);
  const std::uint64_t room = data_end_ - begin;  // bounds every size below, so that no sum overflows
  if (blocks > room / kWord || block_size > kLargestBlock || last > block_size ||
      (blocks > 0 && block_size == 0) || (blocks > 1 && (blocks - 1) > room * kBestRatio / block_size))
    fail(fmt::format("damaged: {} has wrong sizes of its compressed blocks", name));
  stored.begin = begin + (3 + blocks) * kWord;
  stored.block_size = block_size;
  stored.size = blocks == 0 ? 0 : (blocks - 1) * block_size + (last == 0 ? block_size : last);
  std::uint64_t packed = 0;
  for (std::uint64_t b = 0; b < blocks; ++b) {
    const std::uint64_t size = header(begin + (3 + b) * kWord);
    stored.packed_block_size.push_back(size);
    packed += std::min(size, room + 1);
    if (packed > room) break;
  }
  if (stored.begin > data_end_ || packed > data_end_ - stored.begin)
    fail(fmt::format("damaged or truncated: {} has more bytes than the file holds", name));
}

const File::Stored& File::stored(Section section, const std::string& name) const {
  const auto found = arrays_.find({section, name});
  if (found == arrays_.end()) fail(fmt::format("damaged: {} \"{}\" is missing", section_name(section), name));
  return found->second;
}

std::vector<std::string> File::names(Section section) const {
  std::vector<std::string> result;
  for (const auto& [key, array] : arrays_)
    if (key.first == section) result.push_back(key.second);
  return result;
}

const std::string& File::type(Section section, const std::string& name) const {
  return stored(section, name).type;
}

std::size_t File::tuples(Section section, const std::string& name) const {
  return stored(section, name).tuples;
}

std::size_t File::components(Section section, const std::string& name) const {
  return stored(section, name).components;
}

std::size_t File::expect(Section section, const std::string& name, const char* type,
                         std::size_t components) const {
  const Stored& array = stored(section, name);
  if (array.type != type || array.components != components)
    fail(fmt::format("damaged: {} \"{}\" has {} x {} in place of {} x {}", section_name(section), name,
                     array.components, array.type, components, type));
  if (compressed_ && array.size / kBestRatio > bytes_.size())
    fail(
        fmt::format("damaged: {} \"{}\" has more bytes than the file can hold", section_name(section), name));
  return array.tuples;
}

std::vector<double> File::read_flat(Section section, const std::string& name) const {
  const std::size_t components = stored(section, name).components;
  std::vector<double> values(expect(section, name, type_name<double>(), components) * components);
  unpack(section, name, values.data());
  return values;
}

void File::unpack(Section section, const std::string& name, void* out) const {
  const Stored& array = stored(section, name);
  std::byte* to = static_cast<std::byte*>(out);
  if (compressed_) {
    const std::span<const std::byte> packed(bytes_.data() + array.begin, data_end_ - array.begin);
    try {
      unpack_blocks(packed, array.packed_block_size, array.block_size, array.size, to);
    } catch (const InputError& error) {
      fail(fmt::format("{} \"{}\": {}", section_name(section), name, error.what()));
    }
    return;
  }
  const std::byte* from = bytes_.data() + array.begin;
  parallel_chunks(array.size, std::size_t{1} << 21, [&](std::size_t begin, std::size_t end) {
    std::memcpy(to + begin, from + begin, end - begin);
  });
}

void unpack_blocks(std::span<const std::byte> packed, std::span<const std::uint64_t> sizes,
                   std::size_t block_size, std::size_t size, std::byte* out) {
  std::vector<std::size_t> begins(sizes.size() + 1, 0);
  for (std::size_t b = 0; b < sizes.size(); ++b) {
    if (sizes[b] > packed.size() - begins[b]) throw InputError("compressed data is damaged");
    begins[b + 1] = begins[b] + sizes[b];
  }
  if (sizes.empty() ? size != 0
                    : (size > sizes.size() * block_size || size <= (sizes.size() - 1) * block_size))
    throw InputError("compressed data is damaged");
  parallel_for_each(
      sizes.size(),
      [&](std::size_t b) {
        const std::size_t begin = b * block_size;
        const Bytes plain =
            decompress(packed.subspan(begins[b], sizes[b]), std::min(block_size, size - begin));
        std::memcpy(out + begin, plain.data(), plain.size());
      },
      1);
}

}  // namespace flexel::vtu
