// The XML head of a .vtu, as it stands: what its arrays are called and where they claim to be.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/vtu/vtu.h"

namespace flexel::vtu {

struct HeadArray {
  Section section = Section::field;
  std::string name;
  std::string type;
  std::size_t components = 1;
  std::optional<std::size_t> tuples;        // field data only
  std::size_t offset = 0;                   // from the "_"
  [[nodiscard]] std::string shown() const;  // `point data "rest"`, for messages
};

struct Head {
  std::size_t points = 0, cells = 0;
  bool compressed = false;
  std::vector<HeadArray> arrays;
};

// `text` ends with the start tag of AppendedData. Throws InputError: not XML, not an UnstructuredGrid of one
// piece with appended raw data as VTK 9 writes it, numbers that are none.
[[nodiscard]] Head parse_head(std::string_view text, const std::string& where);

// True when the bytes begin like a file of VTK's of this type ("UnstructuredGrid").
[[nodiscard]] bool is_file_of(std::span<const std::byte> bytes, const std::string& type);

// As text of an attribute of XML.
[[nodiscard]] std::string escaped(const std::string& text);

[[nodiscard]] const char* section_name(Section section);
[[nodiscard]] std::size_t scalar_size(const std::string& type);  // bytes; 0 for an unknown type

}  // namespace flexel::vtu
