// The picture that `flexel deform -o bent.png` writes.
#pragma once
#include <string>

#include "base/program/progress.h"
#include "formats/lattice/body.h"

namespace flexel::picture {

// The deformed part coloured by its displacement, with a legend and the part at rest in outline;
// displacements that are too small to be seen are drawn larger, and it says so. `body` is lent to the
// picture, unchanged after it.
void write_bent_picture(Body& body, const std::string& path, Progress& progress);

}  // namespace flexel::picture
