// fmt::format_to at the end of a string, compiled once: every file that calls fmt's own takes four seconds
// longer to compile.
#pragma once
#include <fmt/format.h>

#include <string>

namespace flexel {

void append_values(std::string& to, fmt::string_view format, fmt::format_args values);

template <class... T>
void append_text(std::string& to, fmt::format_string<T...> format, T&&... values) {
  append_values(to, format, fmt::make_format_args(values...));
}

}  // namespace flexel
