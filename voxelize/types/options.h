// Options of voxelization.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "formats/lattice/body.h"

namespace flexel::voxelize {

enum class Align { snap, box, none };
// What is done to surfaces that are not closed before inside is told from outside; docs/reference/healing.md.
enum class Heal { none, automatic, wrap };
struct HealChoice {
  Heal mode = Heal::automatic;
  // m, wrap: the widest opening that it spans; default a hundredth of the diagonal
  std::optional<double> alpha = std::nullopt;
};
// From "none", "auto", "wrap", "wrap:5 mm"; throws InputError naming --heal.
[[nodiscard]] HealChoice heal_choice(const std::string& word);

// From "corner", "centre"; throws InputError naming --placement.
[[nodiscard]] Placement placement_choice(const std::string& word);

struct VoxelizeOptions {
  std::optional<double> size;  // spacing h [m]
  // Or about this many cells (elements for centre placement) over all parts; default 20,000
  std::optional<std::size_t> count;
  // Of a spacing chosen for a count, both in m: only those that it gives are tried. Null: any.
  std::function<double(double)> rounded = {};
  Placement placement = Placement::corner;
  Align align = Align::snap;
  bool cubic = false;      // no part's lattice is stretched (elements at voxel centres: never)
  std::size_t pieces = 0;  // that the lattice is cut into, one after another; 0: it is made as a whole
  bool moments = false;    // also the exact moments of cut cells (Body::moments); corner placement
  HealChoice heal;
  std::string material;              // of every part; "" leaves it to the scene
  std::optional<double> max_memory;  // bytes; default memory_to_use()
};

}  // namespace flexel::voxelize
