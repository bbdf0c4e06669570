// The plots of a study.
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "flexel/study/study.h"

namespace flexel::study {

// Draws the plots with gnuplot in `folder`. Throws InputError: gnuplot is missing or failed.
[[nodiscard]] std::map<std::string, std::string> draw_plots(const Study& study,
                                                            const std::filesystem::path& folder);

}  // namespace flexel::study
