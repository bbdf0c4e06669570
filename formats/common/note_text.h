// Notes of a body (formats/lattice/body.h) that hold a table: a row a line, numbers with what ends each.
#pragma once
#include <charconv>
#include <functional>
#include <string_view>

namespace flexel {

// Takes a number off the front of `text`, and `end` after it; false where they are not there.
template <class Number>
[[nodiscard]] bool take_number(std::string_view& text, Number& number, char end) {
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
  if (error != std::errc() || text.empty() || text.front() != end) return false;
  text.remove_prefix(1);
  return true;
}

// Calls take_row(line) for each line of the note called `name`; it says whether the line is a row. Throws InputError: the note is
// damaged, and in which line.
void read_note_rows(std::string_view note, const char* name,
                    const std::function<bool(std::string_view line)>& take_row);

}  // namespace flexel
