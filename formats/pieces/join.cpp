// Elements come from the piece that owns them, cells from that whose own they are; both are sorted at the end into the
// order of every body. Of some pieces and what is around, elements come from whichever piece is read first: all have the same.
#include "formats/pieces/join.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <tuple>

#include "base/error.h"
#include "base/stop.h"
#include "formats/lattice/cell_moments.h"

namespace flexel {
namespace {

// Voxels of one part near those that were added.
class NearVoxels {
 public:
  void add(const Index3& voxel) {
    for (int a = 0; a < 3; ++a) {
      low_[a] = voxels_.empty() ? voxel[a] : std::min(low_[a], voxel[a]);
      high_[a] = voxels_.empty() ? voxel[a] : std::max(high_[a], voxel[a]);
    }
    voxels_.push_back(voxel);
  }

  // Once all are added.
  void widen(int cells) {
    if (voxels_.empty()) return;
    std::size_t all = 1;
    for (int a = 0; a < 3; ++a) {
      low_[a] -= cells;
      size_[a] = static_cast<std::size_t>(high_[a] + cells - low_[a]) + 1;
      stride_[a] = all;
      all *= size_[a];
    }
    near_.assign(all, false);
    for (const Index3& voxel : voxels_) near_[place(voxel)] = true;
    voxels_ = {};
    for (int a = 0; a < 3; ++a) widen_along(a, static_cast<std::size_t>(cells));
  }

  [[nodiscard]] bool has(const Index3& voxel) const {
    if (near_.empty()) return false;
    for (int a = 0; a < 3; ++a)
      if (voxel[a] < low_[a] || voxel[a] >= low_[a] + static_cast<int>(size_[a])) return false;
    return near_[place(voxel)];
  }

 private:
  [[nodiscard]] std::size_t place(const Index3& voxel) const {
    std::size_t at = 0;
    for (int a = 0; a < 3; ++a) at += static_cast<std::size_t>(voxel[a] - low_[a]) * stride_[a];
    return at;
  }

  void widen_along(int axis, std::size_t cells) {
    const std::size_t n = size_[axis], step = stride_[axis];
    std::vector<std::size_t> within(n + 1);  // of the line's places, so many lie before each
    for (std::size_t first = 0; first < near_.size(); ++first) {
      if (first / step % n != 0) continue;
      for (std::size_t i = 0; i < n; ++i) within[i + 1] = within[i] + near_[first + i * step];
      if (within[n] == 0) continue;
      for (std::size_t i = 0; i < n; ++i)
        near_[first + i * step] = within[std::min(n, i + cells + 1)] > within[i - std::min(i, cells)];
    }
  }

  std::vector<Index3> voxels_;
  Index3 low_{}, high_{};
  std::array<std::size_t, 3> size_{}, stride_{};
  std::vector<bool> near_;
};

const Index3& voxel_of(const Body& body, std::size_t cell) {
  return body.lattice_index[body.cell_elements[cell][0]];
}

std::vector<NearVoxels> near_surface(const PieceFiles& files, int cells) {
  std::vector<NearVoxels> parts;
  for (std::uint32_t index = 0; index < files.files.size(); ++index) {
    check_stop();
    const PieceBody piece = read_piece(files, index);
    parts.resize(std::max(parts.size(), piece.body.parts.size()));
    const std::vector<std::uint32_t> part = cell_parts(piece.body);
    std::vector<bool> under(piece.body.cell_count(), false);
    for (const std::uint32_t cell : piece.body.surface_cells) under[cell] = true;
    for (std::size_t cell = 0; cell < under.size(); ++cell)
      if (under[cell] && !piece.ghost_cells[cell]) parts[part[cell]].add(voxel_of(piece.body, cell));
  }
  for (NearVoxels& part : parts) part.widen(cells);
  return parts;
}

template <class Value>
void permute(const std::vector<std::uint32_t>& from, std::vector<Value>& values, std::size_t each = 1) {
  std::vector<Value> ordered;
  ordered.reserve(values.size());
  for (const std::uint32_t i : from)
    for (std::size_t c = 0; c < each; ++c) ordered.push_back(values[i * each + c]);
  values = std::move(ordered);
}

// Whose own a cell is: a piece owns the points of the planes above its layers.
std::uint32_t piece_of_cell(const PieceBody& piece, std::size_t cell) {
  std::uint32_t found = 0;
  for (const std::uint32_t e : piece.body.cell_elements[cell])
    found = std::max(found, piece.numbers.owner(piece.global_point[e]));
  return found;
}

// Numbers of points, ascending.
using Points = std::vector<std::int64_t>;

bool has_one_of(const PieceBody& piece, std::size_t cell, const Points& points) {
  const auto& elements = piece.body.cell_elements[cell];
  return std::any_of(elements.begin(), elements.end(), [&](std::uint32_t e) {
    return std::binary_search(points.begin(), points.end(), piece.global_point[e]);
  });
}

// Adds those of the cells with ring[cell] == `of`.
void add_points(const PieceBody& piece, const std::vector<std::uint8_t>& ring, std::uint8_t of, Points& to) {
  for (std::size_t c = 0; c < ring.size(); ++c)
    if (ring[c] == of)
      for (const std::uint32_t e : piece.body.cell_elements[c]) to.push_back(piece.global_point[e]);
  std::sort(to.begin(), to.end());
  to.erase(std::unique(to.begin(), to.end()), to.end());
}

class Joiner {
 public:
  Joiner(std::string list, std::optional<std::vector<NearVoxels>> near)
      : list_(std::move(list)), near_(std::move(near)) {}

  void add(PieceBody& piece, const std::string& where) {
    start(piece, where);
    const Body& from = piece.body;
    const std::vector<std::uint32_t> part = cell_parts(from);
    std::vector<bool> kept(from.cell_count());
    for (std::size_t c = 0; c < kept.size(); ++c)
      kept[c] = !near_ || (*near_)[part[c]].has(voxel_of(from, c));
    add_elements(piece, used_by(from, kept), false);  // some of a piece's own are of ghosts alone
    for (std::size_t c = 0; c < kept.size(); ++c) kept[c] = kept[c] && !piece.ghost_cells[c];
    add_cells(piece, kept, part);
  }

  // Of a piece the cells with ring[cell] < 3, ghosts too, and all of their elements.
  void add_around(PieceBody& piece, const std::string& where, const std::vector<std::uint8_t>& ring) {
    start(piece, where);
    const Body& from = piece.body;
    std::vector<bool> kept(from.cell_count());
    for (std::size_t c = 0; c < kept.size(); ++c) {
      kept[c] = ring[c] < 3;
      if (!kept[c]) continue;
      ring_.push_back(ring[c]);
      piece_.push_back(piece_of_cell(piece, c));
    }
    add_elements(piece, used_by(from, kept), true);
    add_cells(piece, kept, cell_parts(from));
  }

  Body take() {
    order_elements();
    order_cells();
    set_ranges();
    derive_connections(body_);
    return std::move(body_);
  }
  // After take(), of what add_around() added.
  void take_rest(PiecesAround& to) {
    to.point = std::move(point_);
    to.piece = std::move(piece_);
    to.ring = std::move(ring_);
  }

 private:
  void start(PieceBody& piece, const std::string& where) {
    Body& from = piece.body;
    if (body_.parts.empty()) {
      body_.parts = from.parts;
      body_.notes = from.notes;
      body_.notes.erase("piece");
      body_.surface = std::move(from.surface);
      start_columns(from.element_columns, body_.element_columns);
      start_columns(from.cell_columns, body_.cell_columns);
    }
    require_same(from, where);
  }

  static std::vector<bool> used_by(const Body& from, const std::vector<bool>& kept) {
    std::vector<bool> used(from.element_count(), false);
    for (std::size_t c = 0; c < kept.size(); ++c)
      if (kept[c])
        for (const std::uint32_t e : from.cell_elements[c]) used[e] = true;
    return used;
  }

  static void start_columns(const Columns& from, Columns& to) {
    for (const auto& [name, column] : from) to[name].components = column.components;
  }

  void require_same(const Body& from, const std::string& where) const {
    const auto same_names = [](const Columns& a, const Columns& b) {
      return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
        return x.first == y.first && x.second.components == y.second.components;
      });
    };
    const bool same_parts =
        std::equal(from.parts.begin(), from.parts.end(), body_.parts.begin(), body_.parts.end(),
                   [](const Part& a, const Part& b) { return a.name == b.name; });
    if (from.surface_cell_offsets.size() != body_.surface.polygon_count() + 1)
      throw InputError(where, "has another surface than piece 0: take all files of one run");
    if (!same_parts) throw InputError(where, "has other parts than piece 0: take all files of one run");
    if (!same_names(from.element_columns, body_.element_columns) ||
        !same_names(from.cell_columns, body_.cell_columns))
      throw InputError(where, "has other columns than piece 0: take all files of one run");
  }

  static void append(const Column& from, std::size_t i, Column& to) {
    const auto n = static_cast<std::size_t>(from.components);
    to.values.insert(to.values.end(), from.values.begin() + static_cast<std::ptrdiff_t>(i * n),
                     from.values.begin() + static_cast<std::ptrdiff_t>((i + 1) * n));
  }

  // `all`: those that other pieces own too.
  void add_elements(const PieceBody& piece, const std::vector<bool>& used, bool all) {
    const Body& from = piece.body;
    const std::vector<std::uint32_t> part = element_parts(from);
    for (std::size_t e = 0; e < used.size(); ++e) {
      if (!used[e] || !(all || piece.numbers.owns(piece.global_point[e]))) continue;
      point_.push_back(piece.global_point[e]);
      element_part_.push_back(part[e]);
      body_.lattice_index.push_back(from.lattice_index[e]);
      body_.piece.push_back(from.piece[e]);
      body_.rest.push_back(from.rest[e]);
      body_.position.push_back(from.position[e]);
      for (auto& [name, column] : body_.element_columns) append(from.element_columns.at(name), e, column);
    }
  }

  void add_cells(const PieceBody& piece, const std::vector<bool>& kept,
                 const std::vector<std::uint32_t>& part) {
    const Body& from = piece.body;
    constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<std::uint32_t> number(from.cell_count(), kNone);
    for (std::size_t c = 0; c < kept.size(); ++c) {
      if (!kept[c]) continue;
      number[c] = static_cast<std::uint32_t>(cell_points_.size());
      std::array<std::int64_t, 8> points{};
      for (std::size_t a = 0; a < 8; ++a) points[a] = piece.global_point[from.cell_elements[c][a]];
      cell_points_.push_back(points);
      cell_part_.push_back(part[c]);
      cell_voxel_.push_back(voxel_of(from, c));
      body_.fill.push_back(from.fill[c]);
      body_.broken.push_back(from.broken[c]);
      for (auto& [name, column] : body_.cell_columns) append(from.cell_columns.at(name), c, column);
    }
    for (std::size_t p = 0; p + 1 < from.surface_cell_offsets.size(); ++p)
      for (std::uint32_t i = from.surface_cell_offsets[p]; i < from.surface_cell_offsets[p + 1]; ++i)
        if (const std::uint32_t cell = number[from.surface_cells[i]]; cell != kNone)
          under_.emplace_back(static_cast<std::uint32_t>(p), cell);
    for (std::size_t m = 0; m < from.moment_cells.size(); ++m)
      if (const std::uint32_t cell = number[from.moment_cells[m]]; cell != kNone) {
        body_.moment_cells.push_back(cell);
        const auto begin = from.moments.begin() + static_cast<std::ptrdiff_t>(m * kMoments);
        body_.moments.insert(body_.moments.end(), begin, begin + kMoments);
      }
  }

  void order_elements() {
    std::vector<std::uint32_t> from(point_.size());
    std::iota(from.begin(), from.end(), 0u);
    const auto key = [&](std::uint32_t e) {
      const Index3& at = body_.lattice_index[e];
      return std::tuple(element_part_[e], at[2], at[1], at[0], body_.piece[e]);
    };
    std::sort(from.begin(), from.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    const auto same = [&](std::uint32_t a, std::uint32_t b) { return point_[a] == point_[b]; };
    from.erase(std::unique(from.begin(), from.end(), same), from.end());
    permute(from, point_);
    permute(from, element_part_);
    permute(from, body_.lattice_index);
    permute(from, body_.piece);
    permute(from, body_.rest);
    permute(from, body_.position);
    for (auto& [name, column] : body_.element_columns)
      permute(from, column.values, static_cast<std::size_t>(column.components));
  }

  void order_cells() {
    std::vector<std::uint32_t> from(cell_points_.size()), number(cell_points_.size());
    std::iota(from.begin(), from.end(), 0u);
    const auto key = [&](std::uint32_t c) {
      const Index3& at = cell_voxel_[c];
      return std::tuple(cell_part_[c], at[2], at[1], at[0]);
    };
    std::stable_sort(from.begin(), from.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    for (std::uint32_t c = 0; c < from.size(); ++c) number[from[c]] = c;
    permute(from, cell_points_);
    permute(from, cell_part_);
    permute(from, body_.fill);
    permute(from, body_.broken);
    if (!ring_.empty()) permute(from, ring_);
    if (!piece_.empty()) permute(from, piece_);
    for (auto& [name, column] : body_.cell_columns)
      permute(from, column.values, static_cast<std::size_t>(column.components));
    name_elements();
    order_moments(number);
    order_under(number);
  }

  // What cells call by its number over the whole lattice has a place here now.
  void name_elements() {
    std::vector<std::uint32_t> by_point(point_.size());
    std::iota(by_point.begin(), by_point.end(), 0u);
    std::sort(by_point.begin(), by_point.end(),
              [&](std::uint32_t a, std::uint32_t b) { return point_[a] < point_[b]; });
    const auto element = [&](std::int64_t point) {
      const auto at =
          std::lower_bound(by_point.begin(), by_point.end(), point,
                           [&](std::uint32_t e, std::int64_t value) { return point_[e] < value; });
      if (at == by_point.end() || point_[*at] != point)
        throw InputError(list_, fmt::format("damaged: a cell has point {}, which no piece owns", point));
      return *at;
    };
    body_.cell_elements.resize(cell_points_.size());
    for (std::size_t c = 0; c < cell_points_.size(); ++c)
      for (std::size_t a = 0; a < 8; ++a) body_.cell_elements[c][a] = element(cell_points_[c][a]);
  }

  void order_moments(const std::vector<std::uint32_t>& number) {
    std::vector<std::uint32_t> from(body_.moment_cells.size());
    std::iota(from.begin(), from.end(), 0u);
    for (std::uint32_t& cell : body_.moment_cells) cell = number[cell];
    std::sort(from.begin(), from.end(), [&](std::uint32_t a, std::uint32_t b) {
      return body_.moment_cells[a] < body_.moment_cells[b];
    });
    permute(from, body_.moment_cells);
    permute(from, body_.moments, kMoments);
  }

  void order_under(const std::vector<std::uint32_t>& number) {
    for (auto& [polygon, cell] : under_) cell = number[cell];
    std::sort(under_.begin(), under_.end());
    body_.surface_cell_offsets.assign(body_.surface.polygon_count() + 1, 0);
    for (const auto& [polygon, cell] : under_) {
      ++body_.surface_cell_offsets[polygon + 1];
      body_.surface_cells.push_back(cell);
    }
    std::partial_sum(body_.surface_cell_offsets.begin(), body_.surface_cell_offsets.end(),
                     body_.surface_cell_offsets.begin());
  }

  void set_ranges() {
    const auto begin = [](const std::vector<std::uint32_t>& part, std::size_t p) {
      return static_cast<std::uint32_t>(std::lower_bound(part.begin(), part.end(), p) - part.begin());
    };
    for (std::size_t p = 0; p < body_.parts.size(); ++p) {
      Part& part = body_.parts[p];
      part.element_begin = begin(element_part_, p);
      part.element_end = begin(element_part_, p + 1);
      part.cell_begin = begin(cell_part_, p);
      part.cell_end = begin(cell_part_, p + 1);
    }
  }

  std::string list_;
  std::optional<std::vector<NearVoxels>> near_;
  Body body_;
  std::vector<std::int64_t> point_;                             // (elements)
  std::vector<std::uint32_t> element_part_, cell_part_;         // (elements), (cells)
  std::vector<std::array<std::int64_t, 8>> cell_points_;        // (cells)
  std::vector<Index3> cell_voxel_;                              // (cells)
  std::vector<std::uint8_t> ring_;                              // (cells) of add_around()
  std::vector<std::uint32_t> piece_;                            // (cells) likewise
  std::vector<std::pair<std::uint32_t, std::uint32_t>> under_;  // polygons and their cells
};

}  // namespace

Body join_pieces(const PieceFiles& files, const std::optional<NearSurface>& near,
                 const std::function<void(const PieceBody& piece)>& see) {
  Joiner joiner(files.list, near ? std::optional(near_surface(files, near->cells)) : std::nullopt);
  for (std::uint32_t index = 0; index < files.files.size(); ++index) {
    check_stop();
    PieceBody piece = read_piece(files, index);
    if (see) see(piece);
    joiner.add(piece, files.files[index]);
  }
  Body body = joiner.take();
  check(body, files.list);
  return body;
}

namespace {

using CellPoints = std::array<std::int64_t, 8>;  // numbers

CellPoints points_of_cell(const PieceBody& piece, std::size_t cell) {
  CellPoints points{};
  for (std::size_t a = 0; a < 8; ++a) points[a] = piece.global_point[piece.body.cell_elements[cell][a]];
  return points;
}

// PiecesAround::ring of the cells of a piece beside those asked for, 3: none of them. `own`: points of the cells of ring 0;
// `ghosts`: of those pieces.
std::vector<std::uint8_t> rings_beside(const PieceBody& piece, std::uint32_t first, std::uint32_t end,
                                       const Points& own, const std::set<CellPoints>& ghosts) {
  std::vector<std::uint8_t> ring(piece.body.cell_count(), 3);
  std::vector<std::uint8_t> others(ring.size());
  for (std::size_t c = 0; c < ring.size(); ++c) {
    const std::uint32_t of = piece_of_cell(piece, c);
    others[c] = of < first || of >= end;
    if (others[c] && has_one_of(piece, c, own)) ring[c] = 1;
  }
  Points next;
  add_points(piece, ring, 1, next);
  for (std::size_t c = 0; c < ring.size(); ++c)
    if (others[c] && ring[c] == 3 &&
        (has_one_of(piece, c, next) || ghosts.contains(points_of_cell(piece, c))))
      ring[c] = 2;
  return ring;
}

}  // namespace

PiecesAround join_around(const PieceFiles& files, std::uint32_t first, std::uint32_t end) {
  Joiner joiner(files.list, std::nullopt);
  PiecesAround found;
  Points own;
  std::set<CellPoints> ghosts;
  for (std::uint32_t index = first; index < end; ++index) {
    check_stop();
    PieceBody piece = read_piece(files, index);
    found.first_point = piece.numbers.first_point;
    std::vector<std::uint8_t> ring(piece.body.cell_count());
    for (std::size_t c = 0; c < ring.size(); ++c) {
      ring[c] = piece.ghost_cells[c] ? 3 : 0;
      if (piece.ghost_cells[c]) ghosts.insert(points_of_cell(piece, c));
    }
    add_points(piece, ring, 0, own);
    joiner.add_around(piece, files.files[index], ring);
  }
  for (const std::uint32_t index : {first - 1, end}) {
    if (index >= files.files.size()) continue;  // before the first, too
    check_stop();
    PieceBody piece = read_piece(files, index);
    joiner.add_around(piece, files.files[index], rings_beside(piece, first, end, own, ghosts));
  }
  found.body = joiner.take();
  joiner.take_rest(found);
  check(found.body, files.list);
  return found;
}

}  // namespace flexel
