// Pieces of a part that are not firmly connected with one another, and loose crumbs among them.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/models/stiffness.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// A firm group of whole cells (simulate/matter/firm_groups.h), or a connected set of the elements of a centre-placed
// part.
struct Fragment {
  std::uint32_t part = 0;
  std::size_t size = 0;        // cells; elements at centre placement
  double volume = 0;           // m^3, filled
  Vec3 centre = Vec3::Zero();  // m, rest, of its matter
  bool stray = false;          // under a thousandth of its part's volume, and not its largest
  bool hinged = false;         // shares elements with another fragment
};

struct Fragments {
  std::vector<Fragment> list;          // in order of their first cell, then of their first element
  std::vector<std::uint32_t> of_cell;  // (cells) index into list; kNoFragment where broken
  // (elements) likewise; kNoFragment where no whole cell is; of fragments that share one, any that is
  // simulated
  std::vector<std::uint32_t> of_element;
};
constexpr std::uint32_t kNoFragment = 0xffffffffu;

[[nodiscard]] Fragments find_fragments(const Body& body);

// (cells) 1 in the cells of stray fragments; (elements) 1 in those of centre-placed ones.
[[nodiscard]] std::vector<std::uint8_t> stray_cells(const Fragments& fragments);
[[nodiscard]] std::vector<std::uint8_t> stray_elements(const Fragments& fragments, const Body& body);

// Throws InputError naming the part, and the fragment where there are several, when no element of a fragment
// that is not stray is tied, nor any of those that it is bonded with (`coupled` elements), and when no cell
// is whole. `scene` is the scene's name for the message.
void refuse_loose_fragments(const Fragments& fragments, const Body& body,
                            const std::vector<std::uint8_t>& tied_elements,
                            const std::vector<CoupledElements>& coupled, const std::string& scene);

// Moves the elements of stray fragments (and those without a whole cell) as the matter nearest to the
// fragment's centre moved, by that cell's mean deformation; stray elements of a centre-placed part as the
// element nearest to them and its neighbours. `stencil` is that of the cells that were simulated.
void carry_strays(const Fragments& fragments, const Problem& problem, const Stencil& stencil, State& state);
// Likewise; `lone`: lone_elements().
void carry_strays(const Fragments& fragments, const Problem& problem, const std::vector<std::uint8_t>& lone,
                  State& state);
// (elements) 1: of no cell that resists.
[[nodiscard]] std::vector<std::uint8_t> lone_elements(const Problem& problem);

}  // namespace flexel::simulate
