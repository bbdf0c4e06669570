// `flexel picture` of what is in memory, and what other commands that draw share with it.
#pragma once
#include <string>
#include <vector>

#include "base/program/arguments.h"
#include "base/program/progress.h"
#include "flexel/picture/picture.h"
#include "formats/exchange/import.h"

namespace flexel::commands {

// Options that view, picture and clay share: --up; --unit and --input-format.
void declare_up(CommandLine& app, std::string& up);
void declare_import_to_draw(CommandLine& app, std::string& unit, std::string& format);
// Parts as they are drawn: `unit` and `format` are those options, "" where they were not given. Throws InputError.
[[nodiscard]] ImportOptions import_to_draw(const std::string& unit, const std::string& format);

// The picture of `subjects` with options of the command (without its name), which name neither files nor -o. Throws
// InputError.
[[nodiscard]] picture::PictureResult draw_subjects(const std::vector<std::string>& arguments,
                                                   const std::vector<picture::PictureSubject>& subjects,
                                                   Progress& progress);

}  // namespace flexel::commands
