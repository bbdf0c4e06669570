// The page that `flexel deform --html` writes.
#pragma once
#include <string>

#include "base/program/progress.h"
#include "flexel/view/page.h"

namespace flexel::view {

// The deformed part, and what the run said. `body` is lent to the page, unchanged after it. Throws as write_page().
void write_result_page(Body& body, const std::string& label, const RunWords& words, const std::string& path,
                       Progress& progress);

}  // namespace flexel::view
