// Quoted fields may go over several lines.
#include "base/files/csv.h"

namespace flexel {

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field(1, '"');
  for (const char c : text) {
    if (c == '"') field += c;
    field += c;
  }
  field += '"';
  return field;
}

bool read_csv_row(std::istream& in, std::vector<std::string>& fields) {
  fields.clear();
  if (in.peek() == std::istream::traits_type::eof()) return false;
  fields.emplace_back();
  bool quoted = false;
  for (char c = 0; in.get(c);) {
    if (c == '"' && quoted && in.peek() == '"')
      fields.back() += static_cast<char>(in.get());
    else if (c == '"' && (quoted || fields.back().empty()))
      quoted = !quoted;
    else if (c == ',' && !quoted)
      fields.emplace_back();
    else if (c == '\n' && !quoted)
      return true;
    else
      fields.back() += c;
  }
  return true;
}

}  // namespace flexel
