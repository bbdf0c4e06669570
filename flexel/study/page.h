// A study as a page of HTML.
#pragma once
#include <map>
#include <string>

#include "flexel/study/study.h"

namespace flexel::study {

// study.html: the page. `plots` are SVG texts by name ("size", "error", "stages"); those that are missing
// are said to be.
[[nodiscard]] std::string page(const Study& study, const std::map<std::string, std::string>& plots);

}  // namespace flexel::study
