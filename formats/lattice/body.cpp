// The graph of a body. In a corner-placed part two elements are connected while a whole cell contains both,
// so the neighbours of an element are gathered from its cells (an incidence table by counting). In a
// centre-placed part they come from the bits of Body::connections: elements are sorted by (k, j, i, piece)
// and a shift by a fixed offset keeps that order, so one merge of the list with its shifted self a direction
// pairs all neighbours without a search.
#include "formats/lattice/body.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <tuple>

#include "base/error.h"
#include "base/parallel.h"

namespace flexel {
namespace {

std::vector<std::uint32_t> spread(const std::vector<Part>& parts, std::uint32_t Part::*begin,
                                  std::uint32_t Part::*end, std::size_t count) {
  std::vector<std::uint32_t> result(count);
  for (std::size_t p = 0; p < parts.size(); ++p)
    std::fill(result.begin() + parts[p].*begin, result.begin() + parts[p].*end,
              static_cast<std::uint32_t>(p));
  return result;
}

// Compressed rows: which whole cells contain each element.
struct Incidence {
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint32_t> cells;
};

Incidence whole_cells_of_elements(const Body& body) {
  Incidence result;
  result.offsets.assign(body.element_count() + 1, 0);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    if (body.broken[c] == 0)
      for (const std::uint32_t element : body.cell_elements[c]) ++result.offsets[element + 1];
  std::partial_sum(result.offsets.begin(), result.offsets.end(), result.offsets.begin());
  result.cells.resize(result.offsets.back());
  std::vector<std::uint64_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    if (body.broken[c] == 0)
      for (const std::uint32_t element : body.cell_elements[c])
        result.cells[next[element]++] = static_cast<std::uint32_t>(c);
  return result;
}

// Calls pair(a, b) for every connection of a centre-placed part, a having the bit.
template <class Pair>
void for_each_bit_connection(const Body& body, const Part& part, const Pair& pair) {
  const auto key = [&](std::uint32_t e, const Index3& shift) {
    const Index3& at = body.lattice_index[e];
    return std::tuple<std::int64_t, std::int64_t, std::int64_t, std::uint16_t>(
        std::int64_t{at[2]} + shift[2], std::int64_t{at[1]} + shift[1], std::int64_t{at[0]} + shift[0],
        body.piece[e]);
  };
  for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
    std::uint32_t other = part.element_begin;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
      if ((body.connections[e] >> bit & 1u) == 0) continue;
      const auto wanted = key(e, half_neighbourhood[bit]);
      while (other < part.element_end && key(other, {0, 0, 0}) < wanted) ++other;
      if (other < part.element_end && key(other, {0, 0, 0}) == wanted) pair(e, other);
    }
  }
}

// Elements that share a whole cell with `element`, ascending, appended to `neighbours`. In each of the 27
// places around an element there is one element at most, except where pieces branch: `place` finds all that
// are twice among the cells' corners without sorting.
void append_cell_neighbours(const Body& body, const Incidence& incidence, std::size_t element,
                            std::vector<std::uint32_t>& neighbours) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  const std::size_t begin = neighbours.size();
  std::array<std::uint32_t, 27> place;
  place.fill(kNone);
  bool branches = false;
  for (std::uint64_t at = incidence.offsets[element]; at < incidence.offsets[element + 1]; ++at) {
    const std::array<std::uint32_t, 8>& corner = body.cell_elements[incidence.cells[at]];
    // The place of the cell's lowest corner: 13 is the element's own.
    std::size_t low = 0;
    while (corner[low] != element) ++low;
    low = 13 - (low & 1) - 3 * (low >> 1 & 1) - 9 * (low >> 2);
    for (std::size_t a = 0; a < 8; ++a) {
      std::uint32_t& there = place[low + (a & 1) + 3 * (a >> 1 & 1) + 9 * (a >> 2)];
      branches = branches || (there != kNone && there != corner[a]);
      there = corner[a];
    }
  }
  place[13] = kNone;
  if (branches)
    for (std::uint64_t at = incidence.offsets[element]; at < incidence.offsets[element + 1]; ++at)
      for (const std::uint32_t other : body.cell_elements[incidence.cells[at]])
        neighbours.push_back(other == element ? kNone : other);
  else
    neighbours.insert(neighbours.end(), place.begin(), place.end());
  const auto own = neighbours.begin() + static_cast<std::ptrdiff_t>(begin);
  neighbours.erase(std::remove(own, neighbours.end(), kNone), neighbours.end());
  const auto first = neighbours.begin() + static_cast<std::ptrdiff_t>(begin);
  if (!std::is_sorted(first, neighbours.end())) std::sort(first, neighbours.end());
  if (branches) neighbours.erase(std::unique(first, neighbours.end()), neighbours.end());
}

void check_graph_size(std::uint64_t neighbours) {
  if (neighbours > std::numeric_limits<std::uint32_t>::max())
    throw InputError("the body has more than 4,294,967,295 connections: choose a larger spacing");
}

Adjacency adjacency_of_cells(const Body& body) {
  constexpr std::size_t kGrain = 4096;
  const Incidence incidence = whole_cells_of_elements(body);
  const std::size_t n = body.element_count();
  std::vector<std::vector<std::uint32_t>> chunks((n + kGrain - 1) / kGrain);
  std::vector<std::uint64_t> offsets(n + 1, 0);
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& own = chunks[begin / kGrain];
    for (std::size_t e = begin; e < end; ++e) {
      const std::size_t before = own.size();
      append_cell_neighbours(body, incidence, e, own);
      offsets[e + 1] = own.size() - before;
    }
  });
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  check_graph_size(offsets.back());
  Adjacency result;
  result.offsets.assign(offsets.begin(), offsets.end());
  result.neighbours.resize(offsets.back());
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t) {
    const std::vector<std::uint32_t>& own = chunks[begin / kGrain];
    std::copy(own.begin(), own.end(), result.neighbours.begin() + result.offsets[begin]);
  });
  return result;
}

// Connections given as pairs, added to the (empty) rows of their elements.
Adjacency with_bit_connections(const Body& body, const Adjacency& cells) {
  std::vector<std::uint64_t> offsets(body.element_count() + 1, 0);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    offsets[e + 1] = cells.offsets[e + 1] - cells.offsets[e];
  const auto for_each_pair = [&](const auto& pair) {
    for (const Part& part : body.parts)
      if (part.placement == Placement::centre) for_each_bit_connection(body, part, pair);
  };
  for_each_pair([&](std::uint32_t a, std::uint32_t b) {
    ++offsets[a + 1];
    ++offsets[b + 1];
  });
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  check_graph_size(offsets.back());
  Adjacency result;
  result.offsets.assign(offsets.begin(), offsets.end());
  result.neighbours.resize(offsets.back());
  std::vector<std::uint64_t> next(offsets.begin(), offsets.end() - 1);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    for (const std::uint32_t other : cells.of(static_cast<std::uint32_t>(e)))
      result.neighbours[next[e]++] = other;
  for_each_pair([&](std::uint32_t a, std::uint32_t b) {
    result.neighbours[next[a]++] = b;
    result.neighbours[next[b]++] = a;
  });
  parallel_for_each(body.element_count(), [&](std::size_t e) {
    std::sort(result.neighbours.begin() + result.offsets[e],
              result.neighbours.begin() + result.offsets[e + 1]);
  });
  return result;
}

// A whole cell connects each of its corners with all others: the bits that each corner then has.
std::array<std::uint32_t, 8> corner_bits() {
  std::array<std::uint32_t, 8> bits{};
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b) {
      const Index3 offset = {(b & 1) - (a & 1), (b >> 1 & 1) - (a >> 1 & 1), (b >> 2) - (a >> 2)};
      const auto found = std::find(half_neighbourhood.begin(), half_neighbourhood.end(), offset);
      if (found != half_neighbourhood.end()) bits[a] |= 1u << (found - half_neighbourhood.begin());
    }
  return bits;
}

}  // namespace

std::vector<std::uint32_t> element_parts(const Body& body) {
  return spread(body.parts, &Part::element_begin, &Part::element_end, body.element_count());
}

std::vector<std::uint32_t> cell_parts(const Body& body) {
  return spread(body.parts, &Part::cell_begin, &Part::cell_end, body.cell_count());
}

Adjacency element_adjacency(const Body& body) {
  Adjacency cells = adjacency_of_cells(body);
  const bool bits = std::any_of(body.parts.begin(), body.parts.end(),
                                [](const Part& part) { return part.placement == Placement::centre; });
  return bits ? with_bit_connections(body, cells) : cells;
}

void derive_connections(Body& body) {
  static const std::array<std::uint32_t, 8> bits = corner_bits();
  body.connections.resize(body.element_count(), 0);
  for (const Part& part : body.parts)
    if (part.placement == Placement::corner)
      std::fill(body.connections.begin() + part.element_begin, body.connections.begin() + part.element_end,
                0u);
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    if (body.broken[c] != 0) continue;
    const std::array<std::uint32_t, 8>& cell = body.cell_elements[c];
    for (std::size_t a = 0; a < 8; ++a) body.connections[cell[a]] |= bits[a];
  }
}

}  // namespace flexel
