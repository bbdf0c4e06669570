// Pattern of the stiffness: count the cells at each element, gather the elements of those cells into sorted
// rows, then look up where each cell's blocks lie. Rows are independent, so everything but the counting runs
// in parallel.
#include "simulate/models/stiffness.h"

#include <algorithm>
#include <unordered_map>

#include "base/parallel.h"
#include "simulate/linear/transfer.h"

namespace flexel::simulate {
namespace {

void fill_incidences(const Body& body, const std::vector<std::uint8_t>& active, Stencil& stencil) {
  stencil.offsets.assign(body.element_count() + 1, 0);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (active[c])
      for (const std::uint32_t e : body.cell_elements[c]) ++stencil.offsets[e + 1];
  for (std::size_t e = 0; e < body.element_count(); ++e) stencil.offsets[e + 1] += stencil.offsets[e];
  stencil.incidences.resize(stencil.offsets.back());
  std::vector<std::uint32_t> next(stencil.offsets.begin(), stencil.offsets.end() - 1);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (active[c])
      for (std::uint32_t a = 0; a < 8; ++a) stencil.incidences[next[body.cell_elements[c][a]]++] = {c, a};
}

// What makes elements neighbours: cells, connections, and groups by the elements that they hold.
struct Neighbourhood {
  const Body& body;
  const Stencil& stencil;
  const ConnectionRows& connections;
  std::unordered_map<std::uint32_t, std::vector<const CoupledElements*>> groups;
};

Neighbourhood neighbourhood(const Body& body, const Stencil& stencil, const ConnectionRows& connections,
                            const std::vector<CoupledElements>& coupled) {
  Neighbourhood result{body, stencil, connections, {}};
  for (const CoupledElements& group : coupled)
    for (const std::uint32_t e : group) result.groups[e].push_back(&group);
  return result;
}

// Appends the neighbours of `element`, itself among them. They are few, and most of them come up in several
// cells: each is looked for at once.
void append_neighbours(const Neighbourhood& near, std::uint32_t element, std::vector<std::uint32_t>& row) {
  row.push_back(element);
  for (const Incidence& at : near.stencil.of(element))
    for (const std::uint32_t other : near.body.cell_elements[at.cell])
      if (std::find(row.begin(), row.end(), other) == row.end()) row.push_back(other);
  for (const ConnectionRows::Entry& entry : near.connections.of(element)) row.push_back(entry.other);
  if (const auto groups = near.groups.find(element); groups != near.groups.end())
    for (const CoupledElements* group : groups->second) row.insert(row.end(), group->begin(), group->end());
}

}  // namespace

StiffnessPattern stiffness_pattern(const Body& body, const std::vector<std::uint8_t>& active,
                                   const ConnectionRows& connections,
                                   const std::vector<CoupledElements>& coupled, bool stored) {
  StiffnessPattern pattern;
  Stencil& stencil = pattern.stencil;
  BlockMatrix& matrix = pattern.matrix;
  const std::size_t n = body.element_count();
  fill_incidences(body, active, stencil);
  const Neighbourhood near = neighbourhood(body, stencil, connections, coupled);
  Pattern rows = collect_pattern(n, 4096, [&](std::size_t e, std::vector<std::uint32_t>& row) {
    append_neighbours(near, static_cast<std::uint32_t>(e), row);
  });
  matrix.row_offsets = std::move(rows.offsets);
  matrix.columns = std::move(rows.columns);
  if (stored) matrix.values.assign(matrix.row_offsets[n], Block::Zero());
  stencil.slot.resize(body.cell_count());
  parallel_for_each(n, [&](std::size_t e) {
    const auto begin = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[e]);
    const auto end = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[e + 1]);
    for (const Incidence& at : stencil.of(static_cast<std::uint32_t>(e)))
      for (std::size_t b = 0; b < 8; ++b)
        stencil.slot[at.cell][8 * at.corner + b] =
            static_cast<std::uint16_t>(std::lower_bound(begin, end, body.cell_elements[at.cell][b]) - begin);
  });
  return pattern;
}

}  // namespace flexel::simulate
