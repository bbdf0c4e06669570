// Text of files and file names made fit for a terminal, in one place: whatever prints goes through it.
#pragma once
#include <string>
#include <string_view>

namespace flexel {

// Length of the UTF-8 sequence at the front of `text`, which is not empty; 0 where there is none (RFC 3629).
[[nodiscard]] std::size_t utf8_length(std::string_view text);

// Whether the character that is all of `text` (valid UTF-8) does something to a terminal or to the text beside
// it in place of being seen: control characters (C0, DEL, C1), marks of the direction of writing, ends of lines.
[[nodiscard]] bool acts_on_terminal(std::string_view character);

// `text` with "\x1b" for control characters and bytes that are no UTF-8, and "\u202e" for what else acts on a
// terminal. A line stays one line.
[[nodiscard]] std::string printable(std::string_view text);

// The same of a text of several lines, whose ends stay.
[[nodiscard]] std::string printable_lines(std::string_view text);

}  // namespace flexel
