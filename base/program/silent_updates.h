// Who hears the updates of silent and quiet Progresses: runs within runs (base/program/progress_stretch.h).
#pragma once
#include <string>

namespace flexel {

class Progress;
using SilentUpdate = void (*)(const Progress& of, double share, const std::string& note);
// Null: nobody.
void set_silent_update(SilentUpdate hears) noexcept;

}  // namespace flexel
