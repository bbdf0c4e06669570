// The page's own files, which are taken into the program when it is built: page/ and three.js.
#pragma once
#include <string_view>

namespace flexel::view {

struct PageFiles {
  std::string_view html, style, three, licence;
  std::string_view script;  // the modules of page/, one after the other
};

[[nodiscard]] const PageFiles& page_files();

}  // namespace flexel::view
