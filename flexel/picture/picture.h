// Draws surfaces and bodies: `flexel picture` without its arguments and files.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "flexel/picture/canvas/image.h"
#include "flexel/picture/picture_options.h"

namespace flexel::picture {

struct PictureResult {
  Image image;
  std::vector<std::string> notes;  // for the user: the view, the range, what was left out
};

// Throws InputError: an attribute that is not there (with those that are), a range that is none, cells asked
// of a surface, a body without a surface or cells.
[[nodiscard]] PictureResult draw_picture(const std::vector<PictureSubject>& subjects,
                                         const PictureOptions& options, Progress& progress);

}  // namespace flexel::picture
