// Rows are read one by one; the first that is damaged is named.
#include "formats/common/note_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"

namespace flexel {

void read_note_rows(std::string_view note, const char* name,
                    const std::function<bool(std::string_view line)>& take_row) {
  for (std::size_t line = 1; !note.empty(); ++line) {
    const std::size_t end = std::min(note.find('\n'), note.size());
    if (!take_row(note.substr(0, end)))
      throw InputError(fmt::format("the body's note \"{}\" is damaged in line {}", name, line));
    note.remove_prefix(std::min(end + 1, note.size()));
  }
}

}  // namespace flexel
