// A series of bodies (.pvd): which files it lists, and what is written for each.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::mapping {

// The frames' files, in order, with the folder of the .pvd. Throws InputError: unreadable, no collection, no
// frame.
[[nodiscard]] std::vector<std::string> series_files(const std::string& pvd);
// Their times [s]; frame n without one is at n.
[[nodiscard]] std::vector<double> series_times(const std::string& pvd);

// Output name of frame `number`: {frame} in `pattern` becomes the number, as 00000; without one it goes
// before the extension, "bent.stl" -> "bent_00000.stl".
[[nodiscard]] std::string frame_name(const std::string& pattern, std::size_t number);

// True when the lattice of both is the same in all that a binding depends on: elements, cells, what is
// broken.
[[nodiscard]] bool same_lattice(const Body& a, const Body& b);

}  // namespace flexel::mapping
