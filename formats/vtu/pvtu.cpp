// Lists are written as text and read with pugixml.
#include "formats/vtu/pvtu.h"

#include <fmt/format.h>

#include <pugixml.hpp>

#include "base/error.h"
#include "formats/vtu/vtu_head.h"

namespace flexel::vtu {
namespace {

std::string array_tags(const char* element, Section section, const std::vector<HeadArray>& arrays) {
  std::string text;
  bool numbered = false;
  for (const HeadArray& array : arrays) {
    if (array.section != section) continue;
    numbered = numbered || (section == Section::point_data && array.name == kGlobalPointIds);
    text += fmt::format("<PDataArray type=\"{}\" Name=\"{}\"", array.type, escaped(array.name));
    if (array.components != 1) text += fmt::format(" NumberOfComponents=\"{}\"", array.components);
    text += "/>\n";
  }
  return fmt::format("<{}{}>\n{}</{}>\n", element,
                     numbered ? fmt::format(" GlobalIds=\"{}\"", kGlobalPointIds) : "", text, element);
}

std::uint64_t run_of(const pugi::xml_node& grid, const std::string& where) {
  const std::string text = grid.attribute("run").value();
  if (text.empty())
    throw InputError(where,
                     "lists no pieces of a lattice: one that flexel-voxelize --pieces wrote is needed");
  if (text.size() != 16 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
    throw InputError(where, fmt::format("damaged: its run \"{}\" is not 16 hexadecimal digits", text));
  return std::stoull(text, nullptr, 16);
}

}  // namespace

std::string pvtu_text(const PieceList& list, const std::vector<HeadArray>& arrays) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<PUnstructuredGrid GhostLevel=\"1\" run=\"{:016x}\">\n",
      list.run);
  text += array_tags("PPointData", Section::point_data, arrays);
  text += array_tags("PCellData", Section::cell_data, arrays);
  text += array_tags("PPoints", Section::points, arrays);
  for (const std::string& file : list.files) text += fmt::format("<Piece Source=\"{}\"/>\n", escaped(file));
  return text + "</PUnstructuredGrid>\n</VTKFile>\n";
}

PieceList parse_pvtu(std::string_view text, const std::string& where) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  if (!parsed)
    throw InputError(where, fmt::format("damaged: the list of pieces does not parse at byte {} ({})",
                                        parsed.offset, parsed.description()));
  const pugi::xml_node file = document.child("VTKFile"), grid = file.child("PUnstructuredGrid");
  if (file.attribute("type").value() != std::string_view("PUnstructuredGrid") || !grid)
    throw InputError(where, "is no list of pieces (.pvtu)");
  PieceList list{run_of(grid, where), {}};
  for (const pugi::xml_node& piece : grid.children("Piece")) {
    std::string name = piece.attribute("Source").value();
    if (name.empty() || name == "." || name == ".." || name.find('/') != std::string::npos)
      throw InputError(where, fmt::format("damaged: piece {}, \"{}\", is no name of a file in its folder",
                                          list.files.size(), name));
    list.files.push_back(std::move(name));
  }
  if (list.files.empty()) throw InputError(where, "damaged: lists no piece");
  return list;
}

}  // namespace flexel::vtu
