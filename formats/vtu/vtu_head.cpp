// Parses the XML head of a .vtu with pugixml. Numbers are range-checked; vtu::File checks offsets and sizes
// against the data.
#include "formats/vtu/vtu_head.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <pugixml.hpp>

#include "base/error.h"

namespace flexel::vtu {
namespace {

constexpr std::uint64_t kMostTuples = 0xffffffffu;  // of points and cells
constexpr std::uint64_t kMostComponents = 1024;
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 48;

class HeadParser {
 public:
  explicit HeadParser(const std::string& where) : where_(where) {}

  Head parse(std::string_view text) const {
    const std::string closed = std::string(text) + "</AppendedData></VTKFile>";
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(closed.data(), closed.size());
    if (!parsed)
      fail(fmt::format("its XML head does not parse at byte {} ({})", parsed.offset, parsed.description()));
    const pugi::xml_node file = document.child("VTKFile");
    const pugi::xml_node grid = file.child("UnstructuredGrid"), piece = grid.child("Piece");
    Head head;
    head.compressed = !file.attribute("compressor").empty();
    demand_kind(file, head.compressed);
    if (!piece || piece.next_sibling("Piece")) fail("exactly one Piece is needed");
    head.points = number(piece, "NumberOfPoints", kMostTuples, "the Piece");
    head.cells = number(piece, "NumberOfCells", kMostTuples, "the Piece");
    add(grid.child("FieldData"), Section::field, head);
    add(piece.child("PointData"), Section::point_data, head);
    add(piece.child("CellData"), Section::cell_data, head);
    add(piece.child("Points"), Section::points, head);
    add(piece.child("Cells"), Section::cells, head);
    return head;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(where_, "damaged: " + what); }

  void demand(const pugi::xml_node& node, const char* attribute, std::string_view value) const {
    if (node.attribute(attribute).value() != value)
      fail(fmt::format("or not written by this suite: {} is \"{}\" instead of \"{}\"", attribute,
                       node.attribute(attribute).value(), value));
  }

  void demand_kind(const pugi::xml_node& file, bool compressed) const {
    demand(file, "type", "UnstructuredGrid");
    demand(file, "version", "1.0");
    demand(file, "byte_order", "LittleEndian");
    demand(file, "header_type", "UInt64");
    demand(file.child("AppendedData"), "encoding", "raw");
    if (compressed) demand(file, "compressor", "vtkZLibDataCompressor");
  }

  std::size_t number(const pugi::xml_node& node, const char* attribute, std::uint64_t most,
                     const std::string& of) const {
    const std::string_view text = node.attribute(attribute).value();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || text.empty() || end != text.data() + text.size() || value > most)
      fail(fmt::format("{} of {} is \"{}\"", attribute, of, text));
    return value;
  }

  void add(const pugi::xml_node& parent, Section section, Head& head) const {
    for (const pugi::xml_node& node : parent.children())
      if (node.type() == pugi::node_element) head.arrays.push_back(array(node, section));
  }

  HeadArray array(const pugi::xml_node& node, Section section) const {
    HeadArray array;
    array.section = section;
    array.name = node.attribute("Name").value();
    array.type = node.attribute("type").value();
    const std::string shown = array.shown();
    if (array.name.empty()) fail(fmt::format("{} without a name", section_name(section)));
    if (scalar_size(array.type) == 0) fail(fmt::format("{} has the unknown type \"{}\"", shown, array.type));
    demand(node, "format", "appended");
    if (!node.attribute("NumberOfComponents").empty())
      array.components = number(node, "NumberOfComponents", kMostComponents, shown);
    if (array.components == 0) fail(fmt::format("{} has no components", shown));
    if (section == Section::field) array.tuples = number(node, "NumberOfTuples", kMostBytes, shown);
    array.offset = number(node, "offset", kMostBytes, shown);
    return array;
  }

  const std::string& where_;
};

}  // namespace

std::string HeadArray::shown() const {
  return fmt::format("{} \"{}\"", section_name(section), name);
}

Head parse_head(std::string_view text, const std::string& where) {
  return HeadParser(where).parse(text);
}

bool is_file_of(std::span<const std::byte> bytes, const std::string& type) {
  constexpr std::size_t kHead = 1024;
  std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), kHead));
  head.remove_prefix(std::min(head.find_first_not_of(" \t\r\n"), head.size()));
  return (head.starts_with("<?xml") || head.starts_with("<VTKFile")) && head.find("<VTKFile") != head.npos &&
         head.find('"' + type + '"') != head.npos;
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

std::size_t scalar_size(const std::string& type) {
  constexpr std::pair<const char*, std::size_t> kSizes[] = {
      {"Float64", 8}, {"Float32", 4}, {"Int64", 8},  {"UInt64", 8}, {"Int32", 4},
      {"UInt32", 4},  {"Int16", 2},   {"UInt16", 2}, {"Int8", 1},   {"UInt8", 1}};
  for (const auto& [name, size] : kSizes)
    if (type == name) return size;
  return 0;
}

}  // namespace flexel::vtu
