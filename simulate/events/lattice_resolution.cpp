// Part by part: taken out of the body, split or merged, put into the new one in its order.
#include "simulate/events/lattice_resolution.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <tuple>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/matter/masses.h"
#include "simulate/matter/voxel_pieces.h"
#include "simulate/models/cells.h"

namespace flexel::simulate {
namespace {

constexpr std::uint32_t kNoNeighbour = ~0u, kTwoNeighbours = ~0u - 1;

// One part; elements are numbered within it.
struct PartLattice {
  Part part;
  std::vector<Index3> index;
  std::vector<std::vector<Vec3>> fields;  // (fields x elements)
  std::vector<std::array<std::uint32_t, 8>> cells;
  std::vector<double> fill;
  std::vector<std::uint32_t>
      sources;  // (cells x n) those that were there before: each is of one, or has eight
};

PartLattice taken_out(const Body& body, const Part& part, const std::vector<std::vector<Vec3>>& fields) {
  PartLattice out;
  out.part = part;
  const auto range = [&](const auto& rows) {
    return std::decay_t<decltype(rows)>(rows.begin() + part.element_begin, rows.begin() + part.element_end);
  };
  out.index = range(body.lattice_index);
  for (const std::vector<Vec3>& each : fields) out.fields.push_back(range(each));
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
    out.cells.push_back(body.cell_elements[c]);
    for (std::uint32_t& e : out.cells.back()) e -= part.element_begin;
    out.fill.push_back(body.fill[c]);
    out.sources.push_back(c);
  }
  return out;
}

// The edges of the cells along an axis, ascending, and of each element the next one in its row.
struct ElementRows {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> before, after;  // (elements)
};

// A row that forks, as at the end of a slit, ends there.
ElementRows rows_along(const PartLattice& lattice, std::size_t axis) {
  const std::size_t bit = std::size_t{1} << axis;
  ElementRows rows;
  rows.edges.reserve(4 * lattice.cells.size());
  for (const auto& corners : lattice.cells)
    for (std::size_t a = 0; a < 8; ++a)
      if (!(a & bit)) rows.edges.push_back({corners[a], corners[a | bit]});
  std::sort(rows.edges.begin(), rows.edges.end());
  rows.edges.erase(std::unique(rows.edges.begin(), rows.edges.end()), rows.edges.end());
  rows.before.assign(lattice.index.size(), kNoNeighbour);
  rows.after = rows.before;
  const auto enter = [](std::uint32_t& place, std::uint32_t element) {
    place = place == kNoNeighbour ? element : kTwoNeighbours;
  };
  for (const auto& [low, high] : rows.edges) {
    enter(rows.after[low], high);
    enter(rows.before[high], low);
  }
  return rows;
}

Vec3 between(const std::vector<Vec3>& values, const ElementRows& rows, std::size_t edge) {
  const auto [low, high] = rows.edges[edge];
  const std::uint32_t before = rows.before[low], after = rows.after[high];
  const bool has_before = before < kTwoNeighbours, has_after = after < kTwoNeighbours;
  const Vec3 middle = 0.5 * (values[low] + values[high]);
  if (has_before && has_after) return middle + (middle - 0.5 * (values[before] + values[after])) / 8;
  if (has_after) return middle + (2 * values[high] - values[low] - values[after]) / 8;
  if (has_before) return middle + (2 * values[low] - values[high] - values[before]) / 8;
  return middle;
}

// Cells become two along the axis.
PartLattice split(PartLattice whole, std::size_t axis) {
  const ElementRows rows = rows_along(whole, axis);
  const auto first = static_cast<std::uint32_t>(whole.index.size());
  const std::size_t bit = std::size_t{1} << axis;
  PartLattice halves = std::move(whole);
  for (Index3& at : halves.index) at[axis] *= 2;
  for (const auto& [low, high] : rows.edges) {
    Index3 at = halves.index[low];
    ++at[axis];
    halves.index.push_back(at);
  }
  for (std::vector<Vec3>& values : halves.fields) {
    values.resize(halves.index.size());
    parallel_for_each(rows.edges.size(),
                      [&](std::size_t n) { values[first + n] = between(values, rows, n); });
  }
  const auto middle = [&](std::uint32_t low, std::uint32_t high) {
    const std::array<std::uint32_t, 2> edge{low, high};
    const auto found = std::lower_bound(rows.edges.begin(), rows.edges.end(), edge);
    return first + static_cast<std::uint32_t>(found - rows.edges.begin());
  };
  const auto cells = std::move(halves.cells);
  const auto fill = std::move(halves.fill);
  const auto sources = std::move(halves.sources);
  halves.cells.clear();
  halves.fill.clear();
  halves.sources.clear();
  for (std::size_t c = 0; c < cells.size(); ++c) {
    std::array<std::uint32_t, 8> lower = cells[c], upper = cells[c];
    for (std::size_t a = 0; a < 8; ++a)
      if (!(a & bit)) lower[a | bit] = upper[a] = middle(cells[c][a], cells[c][a | bit]);
    halves.cells.insert(halves.cells.end(), {lower, upper});
    halves.fill.insert(halves.fill.end(), {fill[c], fill[c]});
    halves.sources.insert(halves.sources.end(), {sources[c], sources[c]});
  }
  halves.part.lattice.spacing[static_cast<Eigen::Index>(axis)] /= 2;
  return halves;
}

PartLattice split(PartLattice lattice) {
  for (std::size_t axis = 0; axis < 3; ++axis) lattice = split(std::move(lattice), axis);
  return lattice;
}

[[noreturn]] void refuse_merging(const PartLattice& lattice, std::size_t cell) {
  const Index3& at = lattice.index[lattice.cells[cell][0]];
  const Vec3 middle = lattice.part.lattice.to_world(Vec3(at[0] + 0.5, at[1] + 0.5, at[2] + 0.5)) * 1e3;
  throw InputError(fmt::format(
      "part \"{}\" cannot be made coarser: its cells do not make larger ones, 2 x 2 x 2 each, near "
      "({:.4g}, {:.4g}, {:.4g}) mm; what was made finer can, and a box of even numbers of cells",
      lattice.part.name, middle.x(), middle.y(), middle.z()));
}

// The eight cells around the middle of each larger one, by the corner that they are at.
std::vector<std::array<std::uint32_t, 8>> groups_of_eight(const PartLattice& lattice, const Index3& origin) {
  std::vector<std::array<std::uint32_t, 8>> groups;
  std::vector<std::uint32_t> group_at(lattice.index.size(),
                                      kNoNeighbour);  // (elements) in whose middle it is
  for (std::uint32_t c = 0; c < lattice.cells.size(); ++c) {
    const Index3& at = lattice.index[lattice.cells[c][0]];
    std::size_t corner = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      corner |= static_cast<std::size_t>((at[axis] - origin[axis]) & 1) << axis;
    std::uint32_t& group = group_at[lattice.cells[c][7 - corner]];
    if (group == kNoNeighbour) {
      group = static_cast<std::uint32_t>(groups.size());
      groups.emplace_back().fill(kNoNeighbour);
    }
    if (groups[group][corner] != kNoNeighbour) refuse_merging(lattice, c);
    groups[group][corner] = c;
  }
  for (const auto& group : groups)
    if (std::find(group.begin(), group.end(), kNoNeighbour) != group.end())
      refuse_merging(lattice, *std::min_element(group.begin(), group.end()));
  return groups;
}

// The lowest corner of all cells, moved to the planes that go on.
Index3 plane_that_stays(const PartLattice& lattice) {
  Index3 origin = lattice.index[lattice.cells.front()[0]];
  for (const auto& corners : lattice.cells)
    for (std::size_t axis = 0; axis < 3; ++axis)
      origin[axis] = std::min(origin[axis], lattice.index[corners[0]][axis]);
  for (std::int32_t& at : origin) at &= 1;
  return origin;
}

PartLattice merge(const PartLattice& fine) {
  if (fine.cells.empty()) return fine;
  const Index3 origin = plane_that_stays(fine);
  PartLattice coarse;
  coarse.part = fine.part;
  coarse.part.lattice.origin = fine.part.lattice.to_world(Vec3(origin[0], origin[1], origin[2]));
  coarse.part.lattice.spacing *= 2;
  std::vector<std::uint32_t> number(fine.index.size(), kNoNeighbour);
  for (const auto& group : groups_of_eight(fine, origin)) {
    double fill = 0;
    auto& corners = coarse.cells.emplace_back();
    for (std::size_t a = 0; a < 8; ++a) {
      corners[a] = fine.cells[group[a]][a];
      number[corners[a]] = 0;
      fill += fine.fill[group[a]];
      coarse.sources.push_back(fine.sources[group[a]]);
    }
    coarse.fill.push_back(fill / 8);
  }
  coarse.fields.resize(fine.fields.size());
  for (std::uint32_t e = 0; e < fine.index.size(); ++e) {
    if (number[e] == kNoNeighbour) continue;
    number[e] = static_cast<std::uint32_t>(coarse.index.size());
    Index3& at = coarse.index.emplace_back(fine.index[e]);
    for (std::size_t axis = 0; axis < 3; ++axis) at[axis] = (at[axis] - origin[axis]) / 2;
    for (std::size_t f = 0; f < fine.fields.size(); ++f) coarse.fields[f].push_back(fine.fields[f][e]);
  }
  for (auto& corners : coarse.cells)
    for (std::uint32_t& e : corners) e = number[e];
  // A slit as long as one small cell leaves no trace in the large ones, which would close it.
  PartLattice again = coarse;
  again.fields.clear();
  if (split(std::move(again)).index.size() != fine.index.size())
    throw InputError(fmt::format(
        "part \"{}\" cannot be made coarser: a slit within it is as long as one cell", fine.part.name));
  return coarse;
}

// The numbers of rows, ascending by key(row), then by the row.
template <class Key>
std::vector<std::uint32_t> sorted_rows(std::size_t rows, const Key& key) {
  std::vector<std::uint32_t> order(rows);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Index3 &x = key(a), &y = key(b);
    return std::tuple(x[2], x[1], x[0], a) < std::tuple(y[2], y[1], y[0], b);
  });
  return order;
}

// Puts parts into a body; `replaced` (pairs) says which cell came from which.
class NewBody {
 public:
  explicit NewBody(std::size_t fields) : fields_(fields) {}
  void append(const PartLattice& lattice);
  // As it is, of any placement, with what is broken of it.
  void append(const Body& old, const Part& part, const std::vector<std::vector<Vec3>>& fields);
  // Of the cells of `old` under each polygon those that came from them.
  Body finish(const Body& old, std::vector<std::vector<Vec3>>& fields);

 private:
  void append_cells(const PartLattice& lattice, const std::vector<std::uint32_t>& number);
  [[nodiscard]] bool touches(const Outline& outline, std::uint32_t cell) const;

  Body body_;
  std::vector<std::vector<Vec3>> fields_;
  std::vector<std::array<std::uint32_t, 2>> replaced_;  // old, new
};

void NewBody::append(const PartLattice& lattice) {
  Part part = lattice.part;
  part.element_begin = static_cast<std::uint32_t>(body_.element_count());
  part.cell_begin = static_cast<std::uint32_t>(body_.cell_count());
  const std::vector<std::uint32_t> order =
      sorted_rows(lattice.index.size(), [&](std::uint32_t e) -> const Index3& { return lattice.index[e]; });
  std::vector<std::uint32_t> number(order.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    const Index3& at = lattice.index[order[n]];
    const bool again = n > 0 && lattice.index[order[n - 1]] == at;
    number[order[n]] = static_cast<std::uint32_t>(body_.element_count());
    body_.lattice_index.push_back(at);
    body_.piece.push_back(again ? static_cast<std::uint16_t>(body_.piece.back() + 1) : std::uint16_t{0});
    body_.rest.push_back(part.lattice.to_world(Vec3(at[0], at[1], at[2])));
    for (std::size_t f = 0; f < fields_.size(); ++f) fields_[f].push_back(lattice.fields[f][order[n]]);
  }
  append_cells(lattice, number);
  part.element_end = static_cast<std::uint32_t>(body_.element_count());
  part.cell_end = static_cast<std::uint32_t>(body_.cell_count());
  body_.parts.push_back(std::move(part));
}

void NewBody::append(const Body& old, const Part& part, const std::vector<std::vector<Vec3>>& fields) {
  Part moved = part;
  moved.element_begin = static_cast<std::uint32_t>(body_.element_count());
  moved.cell_begin = static_cast<std::uint32_t>(body_.cell_count());
  const auto elements = [&](const auto& from, auto& to) {
    to.insert(to.end(), from.begin() + part.element_begin, from.begin() + part.element_end);
  };
  body_.connections.resize(moved.element_begin, 0);
  elements(old.connections, body_.connections);
  elements(old.lattice_index, body_.lattice_index);
  elements(old.piece, body_.piece);
  elements(old.rest, body_.rest);
  for (std::size_t f = 0; f < fields_.size(); ++f) elements(fields[f], fields_[f]);
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
    replaced_.push_back({c, static_cast<std::uint32_t>(body_.cell_count())});
    auto& corners = body_.cell_elements.emplace_back(old.cell_elements[c]);
    for (std::uint32_t& e : corners) e = e - part.element_begin + moved.element_begin;
    body_.fill.push_back(old.fill[c]);
    body_.broken.push_back(old.broken[c]);
  }
  moved.element_end = static_cast<std::uint32_t>(body_.element_count());
  moved.cell_end = static_cast<std::uint32_t>(body_.cell_count());
  body_.parts.push_back(std::move(moved));
}

void NewBody::append_cells(const PartLattice& lattice, const std::vector<std::uint32_t>& number) {
  const std::size_t sources = lattice.sources.size() / std::max<std::size_t>(1, lattice.cells.size());
  for (const std::uint32_t c : sorted_rows(lattice.cells.size(), [&](std::uint32_t at) -> const Index3& {
         return lattice.index[lattice.cells[at][0]];
       })) {
    for (std::size_t n = 0; n < sources; ++n)
      replaced_.push_back({lattice.sources[sources * c + n], static_cast<std::uint32_t>(body_.cell_count())});
    auto& corners = body_.cell_elements.emplace_back(lattice.cells[c]);
    for (std::uint32_t& e : corners) e = number[e];
    body_.fill.push_back(lattice.fill[c]);
    body_.broken.push_back(0);
  }
}

// `outline` in the coordinates of the cell's lattice.
bool NewBody::touches(const Outline& outline, std::uint32_t cell) const {
  const Index3& at = body_.lattice_index[body_.cell_elements[cell][0]];
  const Vec3 lower(at[0], at[1], at[2]);
  return in_range(outline, {lower, lower + Vec3::Ones()}).size() >= 3;
}

Body NewBody::finish(const Body& old, std::vector<std::vector<Vec3>>& fields) {
  fields = std::move(fields_);
  derive_connections(body_);
  if (old.surface_cell_offsets.empty()) return std::move(body_);
  std::sort(replaced_.begin(), replaced_.end());
  const auto from = [&](std::uint32_t cell) {
    return std::lower_bound(replaced_.begin(), replaced_.end(), std::array<std::uint32_t, 2>{cell, 0});
  };
  const Triangles triangles = triangulate(old.surface);
  std::vector<Outline> outlines;  // of the polygon's triangles
  std::vector<std::uint32_t> under;
  body_.surface_cell_offsets = {0};
  std::size_t triangle = 0;
  for (std::uint32_t p = 0; p < old.surface.polygon_count(); ++p) {
    const Lattice& lattice = body_.parts[old.surface.polygon_part(p)].lattice;
    outlines.clear();
    for (; triangle < triangles.polygon.size() && triangles.polygon[triangle] == p; ++triangle) {
      Outline& outline = outlines.emplace_back();
      for (const std::uint32_t v : triangles.corners[triangle])
        outline.push_back(lattice.to_lattice(old.surface.vertices[v]));
    }
    under.clear();
    for (std::uint32_t at = old.surface_cell_offsets[p]; at < old.surface_cell_offsets[p + 1]; ++at) {
      const std::uint32_t cell = old.surface_cells[at];
      const std::size_t before = under.size();
      const auto begin = from(cell), end = from(cell + 1);
      for (auto each = begin; each != end; ++each)
        if (end - begin == 1 || std::any_of(outlines.begin(), outlines.end(), [&](const Outline& outline) {
              return touches(outline, (*each)[1]);
            }))
          under.push_back((*each)[1]);
      // A neighbour of what had too little matter for a cell: the polygon does not touch it.
      if (under.size() == before)
        for (auto each = begin; each != end; ++each) under.push_back((*each)[1]);
    }
    std::sort(under.begin(), under.end());
    under.erase(std::unique(under.begin(), under.end()), under.end());
    body_.surface_cells.insert(body_.surface_cells.end(), under.begin(), under.end());
    body_.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body_.surface_cells.size()));
  }
  return std::move(body_);
}

void refuse_part(const Body& body, const Part& part) {
  if (part.placement == Placement::centre)
    throw InputError(fmt::format(
        "part \"{}\" has its elements at the voxels' centres (model \"paper\"), where a run does not "
        "change its resolution; use model \"cells\"",
        part.name));
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
    if (body.broken[c])
      throw InputError(
          fmt::format("part \"{}\" has broken cells, which another lattice would not have", part.name));
}

}  // namespace

Body at_resolution(const Body& body, const std::vector<std::uint8_t>& changed, ResolutionChange to,
                   std::vector<std::vector<Vec3>>& fields) {
  NewBody made(fields.size());
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    if (!changed[p]) {
      made.append(body, body.parts[p], fields);
      continue;
    }
    refuse_part(body, body.parts[p]);
    PartLattice lattice = taken_out(body, body.parts[p], fields);
    made.append(to == ResolutionChange::finer ? split(std::move(lattice)) : merge(lattice));
  }
  return made.finish(body, fields);
}

// Those that are there, and one in the middle of each edge, face and cell, which are told apart by two
// opposite corners.
std::size_t finer_element_count(const Body& body, const Part& part) {
  const std::size_t cells = part.cell_end - part.cell_begin;
  std::size_t count = part.element_end - part.element_begin + cells;
  std::vector<std::array<std::uint32_t, 2>> ends;
  for (const std::size_t across : {1u, 2u, 4u, 3u, 5u, 6u}) {  // edges along an axis, faces along two
    ends.clear();
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      for (std::size_t a = 0; a < 8; ++a)
        if (!(a & across)) ends.push_back({body.cell_elements[c][a], body.cell_elements[c][a | across]});
    std::sort(ends.begin(), ends.end());
    count += static_cast<std::size_t>(std::unique(ends.begin(), ends.end()) - ends.begin());
  }
  return count;
}

std::array<double, 2> internal_and_kinetic(const Problem& problem, const State& state) {
  const std::vector<double> mass = lumped_masses(problem);
  Vec3 momentum = Vec3::Zero();
  double all = 0, kinetic = 0;
  for (std::size_t e = 0; e < mass.size(); ++e) {
    momentum += mass[e] * state.velocity[e];
    kinetic += 0.5 * mass[e] * state.velocity[e].squaredNorm();
    all += mass[e];
  }
  const Stencil none;
  return {Cells(problem, none).energy(state) + kinetic - 0.5 * momentum.squaredNorm() / all, kinetic};
}

}  // namespace flexel::simulate
