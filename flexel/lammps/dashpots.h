// What LAMMPS's own Python does where a scene has [damping]: no style of bond in Debian's build resists
// velocities.
#pragma once
#include <string>
#include <vector>

namespace flexel::lammps {

// A LAMMPS `python` command that defines `dashpots` (for fix python/invoke) and `begin`, which adds to every
// velocity what the dashpots' forces make of it in `kick` [s]. `damping` (bond types): N s/m.
[[nodiscard]] std::string dashpot_commands(const std::vector<double>& damping, double kick);

}  // namespace flexel::lammps
