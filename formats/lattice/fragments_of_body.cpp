// Union-find over the connections, then a sort of the components of each part.
#include "formats/lattice/fragments_of_body.h"

#include <algorithm>

namespace flexel {

DisjointSets connected_elements(const Adjacency& connections) {
  const auto n = static_cast<std::uint32_t>(connections.offsets.size() - 1);
  DisjointSets sets(n);
  for (std::uint32_t e = 0; e < n; ++e)
    for (const std::uint32_t other : connections.of(e)) sets.unite(e, other);
  return sets;
}

Components find_components(const Body& body, const Adjacency& connections) {
  const auto n = static_cast<std::uint32_t>(body.element_count());
  DisjointSets sets = connected_elements(connections);
  Components fragments;
  std::vector<std::uint32_t> size(n, 0), number(n, 0);
  for (std::uint32_t e = 0; e < n; ++e) ++size[sets.root(e)];
  fragments.offset.push_back(0);
  for (std::uint32_t part = 0; part < body.parts.size(); ++part) {
    std::vector<std::uint32_t> roots;
    for (std::uint32_t e = body.parts[part].element_begin; e < body.parts[part].element_end; ++e)
      if (sets.root(e) == e) roots.push_back(e);
    std::stable_sort(roots.begin(), roots.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return size[a] > size[b]; });
    for (const std::uint32_t root : roots) {
      number[root] = static_cast<std::uint32_t>(fragments.list.size());
      fragments.list.push_back({part, size[root]});
    }
    fragments.offset.push_back(static_cast<std::uint32_t>(fragments.list.size()));
  }
  fragments.of.resize(n);
  for (std::uint32_t e = 0; e < n; ++e) fragments.of[e] = number[sets.root(e)];
  return fragments;
}

bool may_be_broken(const Body& body) {
  const bool centre = std::any_of(body.parts.begin(), body.parts.end(),
                                  [](const Part& part) { return part.placement == Placement::centre; });
  return centre || body.notes.count(kCarvedNote) > 0 ||
         std::find(body.broken.begin(), body.broken.end(), 1) != body.broken.end();
}

}  // namespace flexel
