// One call of fmt for every format string.
#include "base/files/append_text.h"

#include <iterator>

namespace flexel {

void append_values(std::string& to, fmt::string_view format, fmt::format_args values) {
  fmt::vformat_to(std::back_inserter(to), format, values);
}

}  // namespace flexel
