// `flexel picture` of what is in memory.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "flexel/picture/picture.h"

namespace flexel::commands {

// The picture of `subjects` with options of the command (without its name), which name neither files nor -o. Throws
// InputError.
[[nodiscard]] picture::PictureResult draw_subjects(const std::vector<std::string>& arguments,
                                                   const std::vector<picture::PictureSubject>& subjects,
                                                   Progress& progress);

}  // namespace flexel::commands
