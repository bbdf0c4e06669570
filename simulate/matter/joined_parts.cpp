// The note is read line by line.
#include "simulate/matter/joined_parts.h"

#include <string_view>

#include "base/files/append_text.h"
#include "formats/common/note_text.h"

namespace flexel::simulate {

std::vector<std::uint8_t> joined_parts(const Body& body) {
  std::vector<std::uint8_t> joined(body.parts.size(), 0);
  const auto note = body.notes.find(kJoinedNote);
  if (note == body.notes.end()) return joined;
  read_note_rows(note->second, kJoinedNote, [&](std::string_view line) {
    std::size_t part = 0;
    if (!take_number(line, part, ' ') || !line.empty() || part >= joined.size()) return false;
    joined[part] = 1;
    return true;
  });
  return joined;
}

void note_joined_parts(Body& body, std::size_t first) {
  const std::vector<std::uint8_t> joined = joined_parts(body);
  for (std::size_t part = first; part < body.parts.size(); ++part)
    if (!joined[part]) append_text(body.notes[kJoinedNote], "{} \n", part);
}

}  // namespace flexel::simulate
