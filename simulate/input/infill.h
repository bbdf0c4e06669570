// Prints that are not solid: an infill of a given share of the volume, within solid walls. The lattice does
// not resolve the pattern: the part is one even material with the effective figures of the whole,
//     modulus    E / E_s = w + (1 - w) f^2
//     strength   S / S_s = w + (1 - w) s(f),  s = 0.3 f^1.5 up to f = 0.3, f^2.5 above it
//     density    d / d_s = w + (1 - w) f
// with the infill f, the walls' share of the volume w, and E_s, S_s, d_s of the solid. f^2 and 0.3 f^1.5 are
// the modulus and the plastic collapse of open cells (Gibson and Ashby 1997, Cellular Solids, chapter 5);
// f^2.5 meets the latter at 0.3 and the solid at 1. Walls and infill share the strain (Voigt): exact for a
// bar that is drawn, too soft for one that is bent or twisted, whose walls lie where it counts. Patterns
// whose walls run along the load are stiffer too, up to f. So this is an estimate, low rather than high.
#pragma once
#include <optional>
#include <string>

#include "simulate/input/materials.h"

namespace flexel {
struct Part;
struct Surface;
}  // namespace flexel

namespace flexel::simulate {

class TableReader;

// Keys `infill` and `shell` of a scene or of [parts.NAME].
struct Infill {
  std::optional<double> share;  // of the volume inside the walls, in [0.05, 1]; nothing: solid
  std::optional<double> shell;  // m, thickness of the walls; nothing: none, all is infill
};

constexpr double kLeastInfill = 0.05;

// Throws InputError: out of range, a shell without an infill.
[[nodiscard]] Infill parse_infill(TableReader& reader);
// `origin` is for messages.
void check_infill(const Infill& infill, const std::string& origin);

// Share of the part's volume V within `shell` of its surface, area A: x - x^2 / 4 of x = shell A / V, which
// is exact for a square bar, low for a plate; 1 from x = 2. Throws InputError(origin, ...) where the surface
// encloses no volume.
[[nodiscard]] double wall_share(double shell, const Part& part, const Surface& surface, std::size_t index,
                                const std::string& origin);

// The print as one even material. `walls` is a share of the volume.
[[nodiscard]] Material with_infill(Material solid, double infill, double walls);

// "part: PLA with 20 % infill within walls of 31 % ...: an estimate"; "" of a solid material.
[[nodiscard]] std::string infill_line(const std::string& part, const Material& material);

}  // namespace flexel::simulate
