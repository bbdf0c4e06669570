// Reading .vtu. The XML head, up to the "_" that begins the appended data, is parsed on its own; then every
// array's header is followed once and its place, size and number of tuples are made sure of. Nothing is
// allocated for a size that the bytes present cannot hold.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <pugixml.hpp>
#include <string_view>

#include "formats/error.h"
#include "formats/parallel.h"
#include "formats/vtu.h"

namespace flexel::vtu {
namespace {

constexpr std::uint64_t kMostTuples = 0xffffffffu;  // of points and cells
constexpr std::uint64_t kMostComponents = 1024;

std::size_t scalar_size(const std::string& type) {
  static const std::map<std::string, std::size_t> sizes = {
      {"Float64", 8}, {"Float32", 4}, {"Int64", 8},  {"UInt64", 8}, {"Int32", 4},
      {"UInt32", 4},  {"Int16", 2},   {"UInt16", 2}, {"Int8", 1},   {"UInt8", 1}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? 0 : found->second;
}

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The attribute as a whole number up to `most`, or nothing.
bool whole_number(const pugi::xml_node& node, const char* attribute, std::uint64_t most,
                  std::uint64_t& value) {
  const std::string_view text = node.attribute(attribute).value();
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && !text.empty() && end == text.data() + text.size() && value <= most;
}

const char* section_name(Section section) {
  switch (section) {
    case Section::field:
      return "field data";
    case Section::points:
      return "points";
    case Section::point_data:
      return "point data";
    case Section::cells:
      return "cells";
    default:
      return "cell data";
  }
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
  const std::string_view text = text_of(bytes_);
  const std::size_t tag_begin = text.find("<AppendedData");
  const std::size_t tag_end = tag_begin == text.npos ? text.npos : text.find('>', tag_begin);
  const std::size_t mark = tag_end == text.npos ? text.npos : text.find_first_not_of(" \t\r\n", tag_end + 1);
  if (mark == text.npos) {
    const bool whole = text.find("</VTKFile>") != text.npos;
    if (!whole) fail_truncated();
    fail("is a .vtu without appended data, not a body file: a .vtu written by this suite is needed");
  }
  if (text[mark] != '_') fail("damaged: the appended data does not begin with \"_\"");
  data_begin_ = mark + 1;
  constexpr std::size_t kTail = 128;
  const std::size_t tail_begin = std::max(data_begin_, text.size() - std::min(kTail, text.size()));
  const std::size_t tail = text.substr(tail_begin).rfind("</AppendedData>");
  if (tail == text.npos || text.find("</VTKFile>", tail_begin + tail) == text.npos) fail_truncated();
  data_end_ = tail_begin + tail;
  read_head(tag_end + 1);
}

void File::read_head(std::size_t head_end) {
  const std::string head = std::string(text_of(bytes_).substr(0, head_end)) + "</AppendedData></VTKFile>";
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(head.data(), head.size());
  if (!parsed)
    fail(fmt::format("damaged: its XML head does not parse at byte {} ({})", parsed.offset,
                     parsed.description()));
  const pugi::xml_node file = document.child("VTKFile");
  const pugi::xml_node grid = file.child("UnstructuredGrid"), piece = grid.child("Piece");
  const auto demand = [&](const pugi::xml_node& node, const char* attribute, std::string_view value) {
    if (node.attribute(attribute).value() != value)
      fail(fmt::format("damaged, or not written by this suite: {} is \"{}\" instead of \"{}\"", attribute,
                       node.attribute(attribute).value(), value));
  };
  demand(file, "type", "UnstructuredGrid");
  demand(file, "version", "1.0");
  demand(file, "byte_order", "LittleEndian");
  demand(file, "header_type", "UInt64");
  demand(file.child("AppendedData"), "encoding", "raw");
  compressed_ = !file.attribute("compressor").empty();
  if (compressed_) demand(file, "compressor", "vtkZLibDataCompressor");
  if (!piece || piece.next_sibling("Piece")) fail("damaged: exactly one Piece is needed");
  if (!whole_number(piece, "NumberOfPoints", kMostTuples, points_))
    fail("damaged: NumberOfPoints is not a number of points");
  if (!whole_number(piece, "NumberOfCells", kMostTuples, cells_))
    fail("damaged: NumberOfCells is not a number of cells");

  const auto add = [&](const pugi::xml_node& parent, Section section) {
    for (const pugi::xml_node& node : parent.children()) {
      if (node.type() != pugi::node_element) continue;
      const std::string name = node.attribute("Name").value();
      Stored stored;
      stored.type = node.attribute("type").value();
      const std::string shown = fmt::format("{} \"{}\"", section_name(section), name);
      if (name.empty() || scalar_size(stored.type) == 0)
        fail(fmt::format("damaged: {} has no name or an unknown type \"{}\"", shown, stored.type));
      demand(node, "format", "appended");
      std::uint64_t components = 1, tuples = 0, offset = 0;
      if (!node.attribute("NumberOfComponents").empty() &&
          (!whole_number(node, "NumberOfComponents", kMostComponents, components) || components == 0))
        fail(fmt::format("damaged: {} has a wrong NumberOfComponents", shown));
      if (!whole_number(node, "offset", bytes_.size(), offset))
        fail(fmt::format("damaged: {} has a wrong offset", shown));
      stored.components = components;
      locate(stored, shown, offset);
      const std::size_t tuple_size = scalar_size(stored.type) * components;
      if (section == Section::field) {
        if (!whole_number(node, "NumberOfTuples", bytes_.size() * 1032 + 1, tuples))
          fail(fmt::format("damaged: {} has a wrong NumberOfTuples", shown));
      } else if (section == Section::cells) {
        tuples = name == "connectivity" ? stored.size / tuple_size : cells_;
      } else {
        tuples = section == Section::cell_data ? cells_ : points_;
      }
      stored.tuples = tuples;
      if (stored.size % tuple_size != 0 || stored.size / tuple_size != tuples)
        fail(fmt::format("damaged: {} has {} bytes for {} x {} {}", shown, stored.size, tuples, components,
                         stored.type));
      if (!arrays_.emplace(std::pair(section, name), std::move(stored)).second)
        fail(fmt::format("damaged: {} is there twice", shown));
    }
  };
  add(grid.child("FieldData"), Section::field);
  add(piece.child("PointData"), Section::point_data);
  add(piece.child("CellData"), Section::cell_data);
  add(piece.child("Points"), Section::points);
  add(piece.child("Cells"), Section::cells);
}

std::uint64_t File::header(std::size_t at) const {
  if (at > data_end_ || data_end_ - at < sizeof(std::uint64_t)) fail_truncated();
  std::uint64_t value = 0;
  std::memcpy(&value, bytes_.data() + at, sizeof value);
  return value;
}

void File::locate(Stored& stored, const std::string& name, std::uint64_t offset) const {
  const std::size_t begin = data_begin_ + offset;
  const std::uint64_t first = header(begin);
  if (compressed_) return locate_blocks(stored, name, begin);
  stored.begin = begin + sizeof(std::uint64_t);
  stored.size = first;
  if (first > data_end_ - stored.begin)
    fail(fmt::format("damaged or truncated: {} has {} bytes, more than the file holds", name, first));
}

void File::locate_blocks(Stored& stored, const std::string& name, std::size_t begin) const {
  constexpr std::size_t kWord = sizeof(std::uint64_t);
  constexpr std::uint64_t kLargestBlock = std::uint64_t{1} << 31;
  const std::uint64_t blocks = header(begin), block_size = header(begin + kWord),
                      last = header(begin + 2 * kWord);
  if (blocks > (data_end_ - begin) / kWord || block_size > kLargestBlock || last > block_size ||
      (blocks > 0 && block_size == 0))
    fail(fmt::format("damaged: {} has wrong sizes of its compressed blocks", name));
  stored.begin = begin + (3 + blocks) * kWord;
  stored.block_size = block_size;
  stored.size = blocks == 0 ? 0 : (last == 0 ? blocks * block_size : (blocks - 1) * block_size + last);
  std::uint64_t packed = 0;
  for (std::uint64_t b = 0; b < blocks; ++b) {
    stored.packed_block_size.push_back(header(begin + (3 + b) * kWord));
    packed += stored.packed_block_size.back();
    if (stored.packed_block_size.back() > data_end_ - begin || packed > data_end_ - begin)
      fail(fmt::format("damaged or truncated: {} has more bytes than the file holds", name));
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
  // Deflate never packs better than 1032:1: a larger size is a lie and must not be allocated.
  if (compressed_ && array.size / 1032 > bytes_.size())
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
