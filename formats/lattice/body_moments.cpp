// Moments belong to cells, by number.
#include "formats/lattice/body_moments.h"

#include <algorithm>

#include "formats/lattice/cell_moments.h"

namespace flexel {

bool has_all_moments(const Body& body) {
  std::size_t next = 0;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (next < body.moment_cells.size() && body.moment_cells[next] == c)
      ++next;
    else if (body.fill[c] < kWholeFill)
      return false;
  return true;
}

void append_moments(Body& body, const Body& other) {
  const auto cells = static_cast<std::uint32_t>(body.cell_count());
  for (const std::uint32_t cell : other.moment_cells) body.moment_cells.push_back(cells + cell);
  body.moments.insert(body.moments.end(), other.moments.begin(), other.moments.end());
}

void renumber_moments(Body& body, const std::vector<std::uint32_t>& number, std::uint32_t gone) {
  std::size_t to = 0;
  for (std::size_t from = 0; from < body.moment_cells.size(); ++from) {
    const std::uint32_t cell = number[body.moment_cells[from]];
    if (cell == gone) continue;
    body.moment_cells[to] = cell;
    std::copy_n(body.moments.begin() + static_cast<std::ptrdiff_t>(kMoments * from), kMoments,
                body.moments.begin() + static_cast<std::ptrdiff_t>(kMoments * to));
    ++to;
  }
  body.moment_cells.resize(to);
  body.moments.resize(kMoments * to);
}

}  // namespace flexel
