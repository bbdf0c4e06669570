// check(Body): every invariant that the stages rely on. One parallel pass over each array; the message names
// the field and the first wrong entry, numbered from 0.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "base/error.h"
#include "base/parallel.h"
#include "formats/lattice/body.h"
#include "formats/lattice/cell_moments.h"

namespace flexel {
namespace {

struct First {
  std::size_t index = std::numeric_limits<std::size_t>::max();
  First& operator+=(const First& other) {
    index = std::min(index, other.index);
    return *this;
  }
};

class Checker {
 public:
  Checker(const Body& body, const std::string& where) : body_(body), where_(where) {}

  void run() const {
    sizes();
    ranges();
    lattices();
    numbers();
    order();
    cells();
    moments();
    columns("element_columns", body_.element_columns, body_.element_count());
    columns("cell_columns", body_.cell_columns, body_.cell_count());
    surface();
  }

 private:
  template <class... Arguments>
  [[noreturn]] void fail(fmt::format_string<Arguments...> text, Arguments&&... arguments) const {
    throw InputError(where_, "damaged body: " + fmt::format(text, std::forward<Arguments>(arguments)...));
  }

  // Fails with the first index in [begin, end) for which good(index) is false.
  template <class Good>
  void all(std::size_t begin, std::size_t end, const char* field, const char* demand,
           const Good& good) const {
    const First first = parallel_sum<First>(
        end - begin, [&](std::size_t i) { return good(begin + i) ? First{} : First{begin + i}; }, 16384);
    if (first.index < end) fail("{}[{}] {}", field, first.index, demand);
  }

  void size(const char* field, std::size_t have, std::size_t want, const char* of) const {
    if (have != want) fail("{} has {} entries for {} {}", field, have, want, of);
  }

  void sizes() const {
    const std::size_t n = body_.element_count(), m = body_.cell_count();
    if (body_.parts.empty()) fail("parts is empty");
    if (n == 0) fail("rest is empty: there are no elements");
    if (n > kMost || m > kMost) fail("more than 4,294,967,295 elements or cells");
    size("lattice_index", body_.lattice_index.size(), n, "elements");
    size("piece", body_.piece.size(), n, "elements");
    size("position", body_.position.size(), n, "elements");
    size("connections", body_.connections.size(), n, "elements");
    size("fill", body_.fill.size(), m, "cells");
    size("broken", body_.broken.size(), m, "cells");
  }

  void ranges() const {
    std::uint32_t elements = 0, cells = 0;
    for (std::size_t p = 0; p < body_.parts.size(); ++p) {
      const Part& part = body_.parts[p];
      if (part.element_begin != elements || part.element_end < elements)
        fail("parts[{}].element_begin and element_end do not continue the ranges before", p);
      if (part.cell_begin != cells || part.cell_end < cells)
        fail("parts[{}].cell_begin and cell_end do not continue the ranges before", p);
      if (part.placement == Placement::centre && part.cell_end > part.cell_begin)
        fail("parts[{}] has cells although its placement is centre", p);
      elements = part.element_end;
      cells = part.cell_end;
    }
    if (elements != body_.element_count())
      fail("parts: their elements are {} of {}", elements, body_.element_count());
    if (cells != body_.cell_count()) fail("parts: their cells are {} of {}", cells, body_.cell_count());
  }

  void lattices() const {
    for (std::size_t p = 0; p < body_.parts.size(); ++p) {
      const Part& part = body_.parts[p];
      const Lattice& lattice = part.lattice;
      if (!lattice.origin.allFinite()) fail("parts[{}].lattice.origin is not finite", p);
      if (!lattice.spacing.allFinite() || lattice.spacing.minCoeff() <= 0)
        fail("parts[{}].lattice.spacing is not positive", p);
      constexpr double kTolerance = 1e-9;  // far above rounding, far below any harm
      const Mat3& axes = lattice.axes;
      const double deviation = (axes.transpose() * axes - Mat3::Identity()).cwiseAbs().maxCoeff();
      if (!axes.allFinite() || deviation > kTolerance || axes.determinant() <= 0)
        fail("parts[{}].lattice.axes is not a rotation", p);
      if (!std::isfinite(part.surface_volume)) fail("parts[{}].surface_volume is not finite", p);
    }
  }

  void numbers() const {
    const std::size_t n = body_.element_count(), m = body_.cell_count();
    all(0, n, "rest", "is not finite", [&](std::size_t i) { return body_.rest[i].allFinite(); });
    all(0, n, "position", "is not finite", [&](std::size_t i) { return body_.position[i].allFinite(); });
    all(0, m, "fill", "is not in (0, 1]",
        [&](std::size_t i) { return body_.fill[i] > 0 && body_.fill[i] <= 1; });
    all(0, m, "broken", "is not 0 or 1", [&](std::size_t i) { return body_.broken[i] <= 1; });
    constexpr std::uint32_t kNoBits = ~0u << half_neighbourhood.size();
    all(0, n, "connections", "has bits beyond the 13 neighbours",
        [&](std::size_t i) { return (body_.connections[i] & kNoBits) == 0; });
    constexpr std::int32_t kFarthest = 1 << 30;  // so that a neighbour's index cannot overflow
    all(0, n, "lattice_index", "is too large", [&](std::size_t i) {
      const Index3& at = body_.lattice_index[i];
      return std::all_of(at.begin(), at.end(),
                         [](std::int32_t v) { return v > -kFarthest && v < kFarthest; });
    });
  }

  [[nodiscard]] auto element_key(std::size_t e) const {
    const Index3& at = body_.lattice_index[e];
    return std::tuple(at[2], at[1], at[0], body_.piece[e]);
  }

  void order() const {
    for (const Part& part : body_.parts) {
      if (part.element_end > part.element_begin)
        all(part.element_begin + std::size_t{1}, part.element_end, "lattice_index",
            "is not after the element before it in the order (k, j, i, piece)",
            [&](std::size_t e) { return element_key(e - 1) < element_key(e); });
    }
  }

  void cells() const {
    for (const Part& part : body_.parts) {
      all(part.cell_begin, part.cell_end, "cell_elements", "names an element outside its part",
          [&](std::size_t c) {
            return std::all_of(
                body_.cell_elements[c].begin(), body_.cell_elements[c].end(),
                [&](std::uint32_t e) { return e >= part.element_begin && e < part.element_end; });
          });
      all(part.cell_begin, part.cell_end, "cell_elements", "is not a voxel of its lattice",
          [&](std::size_t c) { return is_voxel(c); });
      if (part.cell_end > part.cell_begin)
        all(part.cell_begin + std::size_t{1}, part.cell_end, "cell_elements",
            "is before the cell before it in the order (k, j, i)", [&](std::size_t c) {
              const auto at = [&](std::size_t cell) {
                const Index3& index = body_.lattice_index[body_.cell_elements[cell][0]];
                return std::tuple(index[2], index[1], index[0]);
              };
              return at(c - 1) <= at(c);
            });
    }
  }

  [[nodiscard]] bool is_voxel(std::size_t c) const {
    const Index3& lowest = body_.lattice_index[body_.cell_elements[c][0]];
    for (int a = 1; a < 8; ++a) {
      const Index3& at = body_.lattice_index[body_.cell_elements[c][a]];
      if (at[0] != lowest[0] + (a & 1) || at[1] != lowest[1] + (a >> 1 & 1) || at[2] != lowest[2] + (a >> 2))
        return false;
    }
    return true;
  }

  void moments() const {
    const std::vector<std::uint32_t>& cells = body_.moment_cells;
    const std::vector<double>& values = body_.moments;
    size("moments", values.size(), kMoments * cells.size(), "moments of moment_cells");
    all(0, cells.size(), "moment_cells", "is not a cell after the one before it",
        [&](std::size_t c) { return cells[c] < body_.cell_count() && (c == 0 || cells[c - 1] < cells[c]); });
    all(0, values.size(), "moments", "is not finite",
        [&](std::size_t k) { return std::isfinite(values[k]); });
    constexpr double kTolerance = 1e-6;
    all(0, cells.size(), "moments of moment_cells", "do not add up to the fill of its cell",
        [&](std::size_t c) {
          const auto begin = values.begin() + static_cast<std::ptrdiff_t>(kMoments * c);
          const double sum = std::accumulate(begin, begin + kMoments, 0.0);
          return std::abs(sum - body_.fill[cells[c]]) <= kTolerance;
        });
  }

  void columns(const char* field, const std::map<std::string, Column>& columns, std::size_t count) const {
    for (const auto& [name, column] : columns) {
      if (name.empty()) fail("{} has a column without a name", field);
      if (column.components < 1) fail("{} \"{}\" has no components", field, name);
      if (column.values.size() != count * static_cast<std::size_t>(column.components))
        fail("{} \"{}\" has {} values for {} x {}", field, name, column.values.size(), count,
             column.components);
      all(0, column.values.size(), name.c_str(), "is not finite",
          [&values = column.values](std::size_t i) { return std::isfinite(values[i]); });
    }
  }

  void surface() const {
    const std::size_t polygons = body_.surface.polygon_count();
    if (polygons > 0) {
      check(body_.surface, where_);
      size("surface.parts", body_.surface.parts.size(), body_.parts.size(), "parts");
      for (std::size_t p = 0; p < body_.parts.size(); ++p)
        if (body_.parts[p].name != body_.surface.parts[p].name)
          fail("parts[{}].name \"{}\" is not that of surface.parts[{}], \"{}\"", p, body_.parts[p].name, p,
               body_.surface.parts[p].name);
    }
    const std::vector<std::uint32_t>& offsets = body_.surface_cell_offsets;
    if (offsets.empty()) return size("surface_cells", body_.surface_cells.size(), 0, "polygons");
    size("surface_cell_offsets", offsets.size(), polygons + 1, "ends of polygons");
    if (offsets.front() != 0) fail("surface_cell_offsets[0] is not 0");
    all(1, offsets.size(), "surface_cell_offsets", "is less than the one before",
        [&](std::size_t p) { return offsets[p - 1] <= offsets[p]; });
    size("surface_cells", body_.surface_cells.size(), offsets.back(), "places in surface_cell_offsets");
    surface_cells();
  }

  void surface_cells() const {
    const std::vector<std::uint32_t>&offsets = body_.surface_cell_offsets, &cells = body_.surface_cells;
    all(0, offsets.size() - 1, "surface_cells of polygon", "are not ascending cells of its part",
        [&](std::size_t p) {
          const Part& part = body_.parts[body_.surface.polygon_part(p)];
          for (std::uint32_t at = offsets[p]; at < offsets[p + 1]; ++at) {
            if (cells[at] < part.cell_begin || cells[at] >= part.cell_end) return false;
            if (at > offsets[p] && cells[at] <= cells[at - 1]) return false;
          }
          return true;
        });
  }

  static constexpr std::size_t kMost = 0xffffffffu;
  const Body& body_;
  const std::string& where_;
};

}  // namespace

void check(const Body& body, const std::string& where) {
  Checker(body, where).run();
}

}  // namespace flexel
