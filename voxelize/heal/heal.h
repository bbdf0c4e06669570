// Healing: repairs of a part's surface that make inside and outside well defined. They apply to a copy; in
// the surface that the user gets back only the orientation of polygons changes (outward.h).
#pragma once
#include "base/error.h"
#include "voxelize/heal/heal_holes.h"
#include "voxelize/mesh/part_mesh.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {

struct HealedPart {
  PartMesh mesh;      // what is classified
  PartMesh original;  // the part's own triangles where `mesh` lacks some of them; else empty
  Healing done;
  std::vector<Hole> holes;  // those left open
};

// Heals one part, whose equal positions are one vertex. Heal::none: nothing. Heal::automatic: leaves out
// repeated facets, welds open edges within 1e-7 of the diagonal, leaves out fins, fills small holes, and
// makes triangles and shells face outwards. Heal::wrap: the same, then an alpha wrap around it; throws
// InputError where that goes through an opening and keeps no volume.
[[nodiscard]] HealedPart heal(PartMesh mesh, const HealChoice& how, const std::string& name);

// Throws InputError where a wrap of the width in `how` would take more than `memory` [bytes].
void refuse_fine_wrap(const PartMesh& mesh, const HealChoice& how, double memory, const std::string& name);

// Whether a hole that is too large to fill is left in a shell of a tenth of the area or more.
[[nodiscard]] bool has_large_hole(const HealedPart& part);

// A part of which inside cannot be told from outside.
struct UndecidedPart {
  std::string name, file;
  const HealedPart* part = nullptr;
};

// Why, in one line for all of them (at least one, of `all` parts), and what to do: a wrap is advised where it
// was tried and keeps a volume, for 10 s in all.
[[nodiscard]] InputError undecided(const std::vector<UndecidedPart>& parts, std::size_t all);

// What was healed, one phrase each: "140 open edges closed by welding at 1e-7 of the diagonal". Empty:
// nothing.
[[nodiscard]] std::vector<std::string> healing_lines(const Healing& done);

}  // namespace flexel::voxelize
