// Fine cells are cut at the planes of the coarse lattice into up to eight boxes. Boxes of one coarse voxel
// that share a face are joined to a coarse cell; boxes that share a face which lies in a plane of the coarse
// lattice join the four corners there of their two coarse cells. Both are disjoint sets, numbered in the
// order of the fine cells, so the result does not depend on threads.
#include "simulate/estimate/coarsen.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "formats/lattice/body_moments.h"
#include "formats/lattice/cell_moments.h"
#include "formats/lattice/fused_points.h"
#include "formats/lattice/quadratic_field.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/estimate/coarse_grid.h"
#include "simulate/estimate/coarse_moments.h"
#include "simulate/matter/joined_parts.h"
#include "simulate/matter/stress.h"
#include "simulate/thermal/thermal_settings.h"

namespace flexel::simulate {
namespace {

// One part on its coarse lattice.
class PartCoarsening {
 public:
  PartCoarsening(const Body& fine, const Part& part, const FacePairs& pairs,
                 const std::array<CoarseGrid, 3>& grids)
      : fine_(fine), part_(part), grids_(grids), offset_(part_.cell_end - part_.cell_begin + 1, 0) {
    cut_cells();
    boxes_ = DisjointSets(offset_.back());
    for (std::size_t axis = 0; axis < 3; ++axis) join_boxes(axis, pairs[axis], false);
    number_cells();
    corners_ = DisjointSets(8 * voxel_.size());
    for (std::size_t axis = 0; axis < 3; ++axis) join_boxes(axis, pairs[axis], true);
  }

  // Appends the part to `coarse`, without moments; coarse cells of a fine one: cells_of().
  void append_to(Body& coarse);
  // Afterwards. The fine body has moments for every cell that is cut.
  void append_moments(Body& coarse) const;
  void cells_of(std::uint32_t cell, std::vector<std::uint32_t>& out) const {
    const std::uint32_t local = cell - part_.cell_begin;
    for (std::uint32_t box = offset_[local]; box < offset_[local + 1]; ++box)
      if (cell_of_box_[box] != kNone) out.push_back(first_cell_ + cell_of_box_[box]);
  }

 private:
  static constexpr std::uint32_t kNone = ~0u;

  [[nodiscard]] std::array<GridCut, 3> cuts(std::uint32_t local) const {
    const Index3& at = fine_.lattice_index[fine_.cell_elements[part_.cell_begin + local][0]];
    return {cut(grids_[0], at[0]), cut(grids_[1], at[1]), cut(grids_[2], at[2])};
  }
  // The box of a cell at the given places of its cuts.
  [[nodiscard]] std::uint32_t box(std::uint32_t local, const std::array<GridCut, 3>& at,
                                  const std::array<std::uint32_t, 3>& place) const {
    return offset_[local] + place[0] + at[0].count * (place[1] + at[1].count * place[2]);
  }
  template <class Visit>
  static void for_each_place(const std::array<GridCut, 3>& at, const Visit& visit) {
    for (std::uint32_t z = 0; z < at[2].count; ++z)
      for (std::uint32_t y = 0; y < at[1].count; ++y)
        for (std::uint32_t x = 0; x < at[0].count; ++x) visit(std::array<std::uint32_t, 3>{x, y, z});
  }
  void cut_cells();
  void join_boxes(std::size_t axis, const std::vector<std::array<std::uint32_t, 2>>& pairs, bool across);
  void join(std::size_t axis, std::uint32_t low, std::int32_t low_voxel, std::uint32_t high,
            std::int32_t high_voxel, bool across);
  void number_cells();

  const Body& fine_;
  const Part& part_;
  std::array<CoarseGrid, 3> grids_;
  std::vector<std::uint32_t> offset_;  // (cells + 1) of the boxes of each fine cell
  DisjointSets boxes_{0}, corners_{0};
  std::vector<std::uint32_t> cell_of_box_;  // (boxes) coarse cell, of this part
  std::vector<Index3> voxel_;               // (coarse cells)
  std::vector<double> fill_;                // (coarse cells)
  std::uint32_t first_cell_ = 0;
};

void PartCoarsening::cut_cells() {
  for (std::uint32_t c = 0; c + 1 < offset_.size(); ++c) {
    std::uint32_t count = 1;
    for (const GridCut& each : cuts(c)) count *= each.count;
    offset_[c + 1] = offset_[c] + count;
  }
}

// Two boxes that share a face: of one coarse voxel, or on either side of a coarse plane.
void PartCoarsening::join(std::size_t axis, std::uint32_t low, std::int32_t low_voxel, std::uint32_t high,
                          std::int32_t high_voxel, bool across) {
  if (across != (low_voxel != high_voxel)) return;
  if (!across) {
    boxes_.unite(low, high);
    return;
  }
  const std::uint32_t bit = 1u << axis;
  for (std::uint32_t a = 0; a < 8; ++a)
    if (a & bit) corners_.unite(8 * cell_of_box_[low] + a, 8 * cell_of_box_[high] + (a ^ bit));
}

void PartCoarsening::join_boxes(std::size_t axis, const std::vector<std::array<std::uint32_t, 2>>& pairs,
                                bool across) {
  for (std::uint32_t c = 0; c + 1 < offset_.size(); ++c) {
    if (fine_.broken[part_.cell_begin + c]) continue;
    const std::array<GridCut, 3> at = cuts(c);
    if (at[axis].count < 2) continue;
    for_each_place(at, [&](std::array<std::uint32_t, 3> place) {
      if (place[axis] != 0) return;
      const std::uint32_t low = box(c, at, place);
      place[axis] = 1;
      join(axis, low, at[axis].voxel, box(c, at, place), at[axis].voxel + 1, across);
    });
  }
  for (const auto& [lower, upper] : pairs) {
    if (lower < part_.cell_begin || lower >= part_.cell_end) continue;
    const std::uint32_t low = lower - part_.cell_begin, high = upper - part_.cell_begin;
    const std::array<GridCut, 3> below = cuts(low), above = cuts(high);
    std::array<GridCut, 3> shared = below;  // the cuts across the axis are the same
    shared[axis].count = 1;
    const std::uint32_t last = below[axis].count - 1;
    for_each_place(shared, [&](std::array<std::uint32_t, 3> place) {
      place[axis] = last;
      const std::uint32_t under = box(low, below, place);
      place[axis] = 0;
      join(axis, under, below[axis].voxel + static_cast<std::int32_t>(last), box(high, above, place),
           above[axis].voxel, across);
    });
  }
}

// Coarse cells by (k, j, i), then by their first box.
void PartCoarsening::number_cells() {
  struct FoundVoxel {
    Index3 voxel;
    std::uint32_t root = 0;
    double fill = 0;
  };
  std::vector<FoundVoxel> found;
  std::vector<std::uint32_t> place_of_root(offset_.back(), kNone);
  const double ratio = grids_[0].pitch * grids_[1].pitch * grids_[2].pitch;
  for (std::uint32_t c = 0; c + 1 < offset_.size(); ++c) {
    const std::uint32_t cell = part_.cell_begin + c;
    if (fine_.broken[cell]) continue;
    const std::array<GridCut, 3> at = cuts(c);
    for_each_place(at, [&](const std::array<std::uint32_t, 3>& place) {
      const std::uint32_t root = boxes_.root(box(c, at, place));
      if (place_of_root[root] == kNone) {
        place_of_root[root] = static_cast<std::uint32_t>(found.size());
        Index3 voxel;
        for (std::size_t i = 0; i < 3; ++i) voxel[i] = at[i].voxel + static_cast<std::int32_t>(place[i]);
        found.push_back({voxel, root, 0});
      }
      found[place_of_root[root]].fill +=
          fine_.fill[cell] * at[0].share[place[0]] * at[1].share[place[1]] * at[2].share[place[2]] / ratio;
    });
  }
  std::vector<std::uint32_t> order(found.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto key = [&](std::uint32_t n) {
      const Index3& v = found[n].voxel;
      return std::tuple(v[2], v[1], v[0], n);
    };
    return key(a) < key(b);
  });
  std::vector<std::uint32_t> number(found.size());
  for (std::uint32_t n = 0; n < order.size(); ++n) {
    number[order[n]] = n;
    voxel_.push_back(found[order[n]].voxel);
    fill_.push_back(std::min(1.0, found[order[n]].fill));
  }
  cell_of_box_.assign(offset_.back(), kNone);
  for (std::uint32_t b = 0; b < offset_.back(); ++b)
    if (const std::uint32_t place = place_of_root[boxes_.root(b)]; place != kNone)
      cell_of_box_[b] = number[place];
}

void PartCoarsening::append_to(Body& coarse) {
  Part part = part_;
  const Vec3 begin(grids_[0].begin, grids_[1].begin, grids_[2].begin);
  part.lattice.origin = part_.lattice.to_world(begin);
  part.lattice.spacing =
      part_.lattice.spacing.cwiseProduct(Vec3(grids_[0].pitch, grids_[1].pitch, grids_[2].pitch));
  first_cell_ = part.cell_begin = static_cast<std::uint32_t>(coarse.cell_count());
  part.element_begin = static_cast<std::uint32_t>(coarse.element_count());
  const auto index = [&](std::uint32_t corner) {
    Index3 at = voxel_[corner / 8];
    for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += static_cast<std::int32_t>(corner >> axis & 1u);
    return at;
  };
  std::vector<std::uint32_t> roots;
  for (std::uint32_t corner = 0; corner < 8 * voxel_.size(); ++corner)
    if (corners_.root(corner) == corner) roots.push_back(corner);
  std::sort(roots.begin(), roots.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Index3 x = index(a), y = index(b);
    return std::tuple(x[2], x[1], x[0], a) < std::tuple(y[2], y[1], y[0], b);
  });
  std::vector<std::uint32_t> element(8 * voxel_.size());
  for (std::size_t n = 0; n < roots.size(); ++n) {
    const Index3 at = index(roots[n]);
    const bool again = n > 0 && index(roots[n - 1]) == at;
    element[roots[n]] = static_cast<std::uint32_t>(coarse.element_count());
    coarse.lattice_index.push_back(at);
    coarse.piece.push_back(again ? static_cast<std::uint16_t>(coarse.piece.back() + 1) : std::uint16_t{0});
    coarse.rest.push_back(part.lattice.to_world(Vec3(at[0], at[1], at[2])));
  }
  for (std::uint32_t c = 0; c < voxel_.size(); ++c) {
    std::array<std::uint32_t, 8> corners;
    for (std::uint32_t a = 0; a < 8; ++a) corners[a] = element[corners_.root(8 * c + a)];
    coarse.cell_elements.push_back(corners);
    coarse.fill.push_back(fill_[c]);
  }
  part.cell_end = static_cast<std::uint32_t>(coarse.cell_count());
  part.element_end = static_cast<std::uint32_t>(coarse.element_count());
  coarse.parts.push_back(part);
}

void PartCoarsening::append_moments(Body& coarse) const {
  constexpr CellMoments kWholeMoments = whole_moments();
  std::vector<std::size_t> begin(voxel_.size(), 0);  // of the cell's moments
  for (std::uint32_t c = 0; c < voxel_.size(); ++c) {
    if (fill_[c] >= kWholeFill) continue;
    begin[c] = kMoments * coarse.moment_cells.size();
    coarse.moment_cells.push_back(first_cell_ + c);
  }
  coarse.moments.resize(kMoments * coarse.moment_cells.size(), 0);
  auto cut_cell = std::lower_bound(fine_.moment_cells.begin(), fine_.moment_cells.end(), part_.cell_begin);
  for (std::uint32_t c = 0; c + 1 < offset_.size(); ++c) {
    const std::uint32_t cell = part_.cell_begin + c;
    const bool whole = cut_cell == fine_.moment_cells.end() || *cut_cell != cell;
    const double* moments =
        whole ? kWholeMoments.data()
              : &fine_.moments[kMoments * static_cast<std::size_t>(cut_cell - fine_.moment_cells.begin())];
    if (!whole) ++cut_cell;
    if (fine_.broken[cell]) continue;
    const std::array<GridCut, 3> at = cuts(c);
    const Index3& index = fine_.lattice_index[fine_.cell_elements[cell][0]];
    for_each_place(at, [&](const std::array<std::uint32_t, 3>& place) {
      const std::uint32_t number = cell_of_box_[box(c, at, place)];
      if (fill_[number] >= kWholeFill) return;
      std::array<double, 3> low{}, size{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const CoarseGrid& grid = grids_[axis];
        if (place[axis] == 0) low[axis] = (index[axis] - grid.begin) / grid.pitch - at[axis].voxel;
        size[axis] = at[axis].share[place[axis]] / grid.pitch;
      }
      add_box(moments, low, size, &coarse.moments[begin[number]]);
    });
  }
}

// `grids`: of the only part; null: chosen.
Coarsening coarsen(const Body& body, const std::array<CoarseGrid, 3>* grids) {
  const FacePairs pairs = face_pairs(body);
  const bool with_moments = has_all_moments(body);
  Coarsening result{{}, {0}, {}};
  Body& coarse = result.body;
  for (const Part& each : body.parts) {
    PartCoarsening part(body, each, pairs,
                        grids ? *grids : choose_grids(body, each, pairs, !body.moment_cells.empty()));
    part.append_to(coarse);
    if (with_moments) part.append_moments(coarse);
    for (std::uint32_t c = each.cell_begin; c < each.cell_end; ++c) {
      part.cells_of(c, result.cells);
      result.offsets.push_back(static_cast<std::uint32_t>(result.cells.size()));
    }
  }
  if (!body.surface_cell_offsets.empty()) coarse.surface_cell_offsets = {0};
  std::vector<std::uint32_t> under;
  for (std::size_t p = 0; p + 1 < body.surface_cell_offsets.size(); ++p) {
    under.clear();
    for (std::uint32_t at = body.surface_cell_offsets[p]; at < body.surface_cell_offsets[p + 1]; ++at) {
      const std::uint32_t cell = body.surface_cells[at];
      under.insert(under.end(), result.cells.begin() + result.offsets[cell],
                   result.cells.begin() + result.offsets[cell + 1]);
    }
    append_cells_under(under, coarse);
  }
  complete_at_rest(body.surface, coarse);
  return result;
}

}  // namespace

void refuse_to_coarsen(const Body& body) {
  for (const Columns* columns : {&body.cell_columns, &body.element_columns})
    for (const auto& [name, column] : *columns)
      if (!is_stress_column(name) && name != "velocity" && name != kQuadraticColumn &&
          name != kTemperatureColumn)
        throw InputError(fmt::format("the body remembers an earlier run or an event (\"{}\")", name));
  if (body.notes.contains(kFusedNote) || body.notes.contains(kJoinedNote))
    throw InputError("an earlier run or an event fused points of the body, or brought parts");
  for (const Part& part : body.parts) {
    if (part.placement == Placement::centre)
      throw InputError(fmt::format("part \"{}\" has its elements at the voxels' centres", part.name));
    if (part.cell_begin == part.cell_end)
      throw InputError(fmt::format("part \"{}\" has no cells", part.name));
  }
}

void append_cells_under(std::vector<std::uint32_t>& under, Body& coarse) {
  std::sort(under.begin(), under.end());
  under.erase(std::unique(under.begin(), under.end()), under.end());
  coarse.surface_cells.insert(coarse.surface_cells.end(), under.begin(), under.end());
  coarse.surface_cell_offsets.push_back(static_cast<std::uint32_t>(coarse.surface_cells.size()));
}

void complete_at_rest(const Surface& surface, Body& coarse) {
  coarse.position = coarse.rest;
  coarse.broken.assign(coarse.cell_count(), 0);
  coarse.surface.vertices = surface.vertices;
  coarse.surface.polygon_offsets = surface.polygon_offsets;
  coarse.surface.polygon_vertices = surface.polygon_vertices;
  coarse.surface.polygon_face = surface.polygon_face;
  coarse.surface.faces = surface.faces;
  coarse.surface.parts = surface.parts;
  derive_connections(coarse);
}

Coarsening coarsening(const Body& body) {
  refuse_to_coarsen(body);
  return coarsen(body, nullptr);
}

Coarsening coarsening(const Body& body, const std::array<CoarseGrid, 3>& grids) {
  return coarsen(body, &grids);
}

Body coarsened(const Body& body) {
  return coarsening(body).body;
}

namespace {

// In units of the cell's edges, from its first corner.
Vec3 place_in(const Body& body, const Part& part, std::uint32_t cell, const Vec3& rest) {
  const Index3& first = body.lattice_index[body.cell_elements[cell][0]];
  return part.lattice.to_lattice(rest) - Vec3(first[0], first[1], first[2]);
}

Vec3 moved_in(const Body& body, std::uint32_t cell, const Vec3& place) {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t a = 0; a < 8; ++a) {
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= a >> axis & 1u ? place[axis] : 1 - place[axis];
    const std::uint32_t e = body.cell_elements[cell][a];
    sum += weight * (body.position[e] - body.rest[e]);
  }
  return sum;
}

}  // namespace

std::vector<Vec3> prolonged_displacement(const Coarsening& coarse, const Body& fine) {
  std::vector<Vec3> moved(fine.element_count(), Vec3::Zero());
  std::vector<std::uint8_t> found(fine.element_count(), 0);
  for (std::size_t p = 0; p < fine.parts.size(); ++p) {
    const Part& part = coarse.body.parts[p];
    for (std::uint32_t c = fine.parts[p].cell_begin; c < fine.parts[p].cell_end; ++c)
      for (const std::uint32_t e : fine.cell_elements[c]) {
        if (found[e] || coarse.offsets[c] == coarse.offsets[c + 1]) continue;
        found[e] = 1;
        double nearest = std::numeric_limits<double>::infinity();
        for (std::uint32_t at = coarse.offsets[c]; at < coarse.offsets[c + 1]; ++at) {
          const Vec3 place = place_in(coarse.body, part, coarse.cells[at], fine.rest[e]);
          const double outside = (place.array() - 0.5).abs().maxCoeff();
          if (!(outside < nearest)) continue;
          nearest = outside;
          moved[e] = moved_in(coarse.body, coarse.cells[at], place);
        }
      }
  }
  return moved;
}

namespace {

// (cells) The thinnest wall of a cell, in cells: along an axis, the fills of the cells in a row.
std::vector<double> thinnest_walls(const Body& body) {
  std::vector<double> thinnest(body.cell_count(), 1e300);
  for (const auto& along : face_pairs(body)) {
    std::vector<std::uint32_t> next(body.cell_count(), ~0u);
    std::vector<std::uint8_t> has_previous(body.cell_count(), 0);
    for (const auto& [low, high] : along) {
      next[low] = high;
      has_previous[high] = 1;
    }
    for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
      if (has_previous[c]) continue;
      double thickness = 0;
      for (std::uint32_t at = c; at != ~0u; at = next[at]) thickness += body.fill[at];
      for (std::uint32_t at = c; at != ~0u; at = next[at]) thinnest[at] = std::min(thinnest[at], thickness);
    }
  }
  return thinnest;
}

// (cells) A corner whose element no other cell of the voxel has: the first. Such cells lie one after another.
std::vector<std::uint8_t> telling_corners(const Body& body) {
  const auto voxel = [&](std::uint32_t c) { return body.lattice_index[body.cell_elements[c][0]]; };
  std::vector<std::uint8_t> corner(body.cell_count(), 0);
  for (std::uint32_t begin = 0, end = 0; begin < corner.size(); begin = end) {
    while (end < corner.size() && voxel(end) == voxel(begin)) ++end;
    for (std::uint32_t c = begin; c < end; ++c) {
      const auto shared = [&](std::uint8_t a) {
        std::size_t with = 0;
        for (std::uint32_t other = begin; other < end; ++other)
          with += body.cell_elements[other][a] == body.cell_elements[c][a];
        return with > 1;
      };
      while (corner[c] < 7 && shared(corner[c])) ++corner[c];
    }
  }
  return corner;
}

// At cells next to own ones the values that others have of them. `corner`: telling_corners().
void exchange_at_cells(const Body& body, const std::vector<std::uint8_t>& corner, std::vector<Vec3>& values) {
  for (std::uint8_t a = 0; a < 8; ++a) {
    const bool here = std::find(corner.begin(), corner.end(), a) != corner.end();
    if (!(over_pieces(here ? 1 : 0) > 0)) continue;
    std::vector<Vec3> at_elements(body.element_count(), Vec3::Zero());
    for (std::uint32_t c = 0; c < body.cell_count(); ++c)
      if (corner[c] == a && counts_cell(c)) at_elements[body.cell_elements[c][a]] = values[c];
    other_pieces()->sum_at_elements(at_elements);
    for (std::uint32_t c = 0; c < body.cell_count(); ++c)
      if (corner[c] == a && !counts_cell(c)) values[c] = at_elements[body.cell_elements[c][a]];
  }
}

// (cells) As far as own ones go, of a body in pieces: a row may go on through several. No more than `most` is told apart.
std::vector<double> thinnest_walls_over_pieces(const Body& body, double most) {
  const FacePairs pairs = face_pairs(body);
  const std::vector<std::uint8_t> corner = telling_corners(body);
  std::vector<Vec3> after(body.cell_count()),
      before(body.cell_count());  // of the row, the cell with it, by axis
  for (std::size_t c = 0; c < after.size(); ++c) after[c] = before[c] = Vec3::Constant(body.fill[c]);
  for (double changed = 1; changed > 0;) {
    changed = 0;
    const auto extend = [&](Vec3& to, const Vec3& by, std::uint32_t cell, Eigen::Index axis) {
      const double reached = std::min(most, body.fill[cell] + by[axis]);
      if (!counts_cell(cell) || !(reached > to[axis])) return;
      to[axis] = reached;
      ++changed;
    };
    for (std::size_t a = 0; a < pairs.size(); ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      for (const auto& [low, high] : pairs[a]) extend(before[high], before[low], high, axis);
      for (auto pair = pairs[a].rbegin(); pair != pairs[a].rend(); ++pair)
        extend(after[(*pair)[0]], after[(*pair)[1]], (*pair)[0], axis);
    }
    exchange_at_cells(body, corner, after);
    exchange_at_cells(body, corner, before);
    changed = over_pieces(changed);
  }
  std::vector<double> thinnest(body.cell_count());
  for (std::size_t c = 0; c < thinnest.size(); ++c)
    thinnest[c] = (after[c] + before[c]).minCoeff() - body.fill[c];
  return thinnest;
}

}  // namespace

double share_of_thin_walls(const Body& body, double cells) {
  const std::vector<double> thinnest =
      other_pieces() ? thinnest_walls_over_pieces(body, 2 * cells) : thinnest_walls(body);
  double thin = 0, all = 0;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (body.broken[c] || !counts_cell(c)) continue;
    all += body.fill[c];
    if (thinnest[c] < cells * (1 - 1e-9)) thin += body.fill[c];
  }
  thin = over_pieces(thin);
  all = over_pieces(all);
  return all > 0 ? thin / all : 0;
}

}  // namespace flexel::simulate
