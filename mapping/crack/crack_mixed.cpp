// Boxes with elements of several fragments, such as two leaves a third of a spacing apart of which one broke
// off. All their squares were cut, so each facet and each wall lies in one box; those that share an edge
// inside it bound the same matter. The cells under the facets give the element.
#include <algorithm>
#include <map>

#include "base/disjoint_sets.h"
#include "mapping/crack/crack_caps.h"

namespace flexel::mapping {
namespace {

// A bit or a cap, in a mixed box.
struct Item {
  std::uint32_t box;
  std::uint32_t bit;  // kNoBox: a cap
  std::uint32_t cap;
};

// An edge of an item.
struct Side {
  std::uint32_t box, low, high, item;
};

class Mixed {
 public:
  Mixed(const CrackMesh& mesh, const std::vector<CrackCap>& caps) {
    const CrackBoxes& boxes = mesh.boxes();
    const std::vector<CrackBit>& bits = mesh.bits();
    for (std::uint32_t b = 0; b < bits.size(); ++b) {
      if (bits[b].fragment != kMixed) continue;
      // The only box of its range that holds matter.
      std::uint32_t box = kNoBox;
      Index3 index{};
      for (index[2] = bits[b].range.low[2]; index[2] <= bits[b].range.high[2]; ++index[2])
        for (index[1] = bits[b].range.low[1]; index[1] <= bits[b].range.high[1]; ++index[1])
          for (index[0] = bits[b].range.low[0]; index[0] <= bits[b].range.high[0]; ++index[0])
            if (const std::uint32_t found = boxes.find(index); found != kNoBox) box = found;
      add(mesh, {box, b, kNoBox}, mesh.corners(bits[b]));
    }
    for (std::uint32_t c = 0; c < caps.size(); ++c)
      if (caps[c].fragment == kMixed) add(mesh, {boxes.find(caps[c].box), kNoBox, c}, caps[c].corners);
  }

  // For each item the first of those that it is connected with.
  [[nodiscard]] std::vector<std::uint32_t> components() {
    const auto key = [](const Side& side) { return std::array{side.box, side.low, side.high}; };
    std::sort(sides_.begin(), sides_.end(), [&](const Side& a, const Side& b) {
      return key(a) != key(b) ? key(a) < key(b) : a.item < b.item;
    });
    DisjointSets sets(items.size());
    for (std::size_t s = 1; s < sides_.size(); ++s)
      if (key(sides_[s]) == key(sides_[s - 1])) sets.unite(sides_[s].item, sides_[s - 1].item);
    std::vector<std::uint32_t> roots;
    for (std::uint32_t i = 0; i < items.size(); ++i) roots.push_back(sets.root(i));
    return roots;
  }

  std::vector<Item> items;

 private:
  void add(const CrackMesh& mesh, const Item& item, std::span<const std::uint32_t> corners) {
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const std::uint32_t a = mesh.welded(corners[k]), b = mesh.welded(corners[(k + 1) % corners.size()]);
      sides_.push_back({item.box, std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(items.size())});
    }
    items.push_back(item);
  }

  std::vector<Side> sides_;
};

// visit(fragment) for the elements at the box's index in the cells under polygon `p`.
template <class Visit>
void for_each_element_under(const Body& body, std::uint32_t p, const Index3& index,
                            const Components& fragments, const Visit& visit) {
  if (body.surface_cell_offsets.empty()) return;
  for (std::uint32_t s = body.surface_cell_offsets[p]; s < body.surface_cell_offsets[p + 1]; ++s)
    for (const std::uint32_t e : body.cell_elements[body.surface_cells[s]])
      if (body.lattice_index[e] == index) visit(fragments.of[e]);
}

}  // namespace

void resolve_mixed(const Body& body, const std::vector<std::uint32_t>& polygon_of,
                   const Components& fragments, CrackMesh& mesh, std::vector<CrackCap>& caps) {
  Mixed mixed(mesh, caps);
  if (mixed.items.empty()) return;
  const CrackBoxes& boxes = mesh.boxes();
  const std::vector<std::uint32_t> roots = mixed.components();
  // Votes for each component and fragment.
  std::vector<std::map<std::uint32_t, int>> votes(mixed.items.size());
  for (std::size_t i = 0; i < mixed.items.size(); ++i) {
    const Item& item = mixed.items[i];
    if (item.bit == kNoBox) continue;
    const Index3& index = body.lattice_index[boxes.owner(item.box)];
    for_each_element_under(body, polygon_of[mesh.bits()[item.bit].triangle], index, fragments,
                           [&](std::uint32_t fragment) { ++votes[roots[i]][fragment]; });
  }
  for (std::size_t i = 0; i < mixed.items.size(); ++i) {
    const Item& item = mixed.items[i];
    std::uint32_t fragment = fragments.of[boxes.owner(item.box)];
    int most = 0;
    for (const auto& [candidate, count] : votes[roots[i]])
      if (count > most) most = count, fragment = candidate;
    (item.bit != kNoBox ? mesh.bits()[item.bit].fragment : caps[item.cap].fragment) = fragment;
  }
  // Caps come in pairs, one for each side: where both turn out to be of one fragment there is no wall.
  const auto mixed_box = [&](const CrackCap& cap) { return boxes.fragment(boxes.find(cap.box)) == kMixed; };
  std::size_t kept = 0;
  for (std::size_t c = 0; c + 1 < caps.size(); c += 2)
    if (caps[c].fragment != caps[c + 1].fragment || (!mixed_box(caps[c]) && !mixed_box(caps[c + 1]))) {
      caps[kept] = caps[c];
      caps[kept + 1] = caps[c + 1];
      kept += 2;
    }
  caps.resize(kept);
}

}  // namespace flexel::mapping
