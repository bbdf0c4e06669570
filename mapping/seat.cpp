// Nearly every vertex lies inside the voxel of a cell that its first polygon bounds: that is found first,
// without a table of the polygons around each vertex. The rest (on the face between two voxels, or of matter
// too thin for a cell of its own, so that it hangs on a neighbour) looks through the cells of all polygons
// around it for the nearest, so that the order of the polygons does not matter; what finds no cell at all
// takes the nearest element of its part.
//
// Vertices at one position in one part (an OBJ has them along texture seams) have one representative, which
// alone is seated.
#include "mapping/seat.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>

#include "formats/bucket.h"
#include "formats/error.h"
#include "formats/locate.h"
#include "formats/topology.h"

namespace flexel {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr double kUnreached = std::numeric_limits<double>::infinity();

// First polygon around each vertex, and the vertex whose seat it shares.
struct Corners {
  std::vector<std::uint32_t> first_polygon;   // (vertices) kNone: unused
  std::vector<std::uint32_t> representative;  // (vertices) the first of those at this position in this part
};

Corners corners_of(const Surface& surface) {
  constexpr std::size_t kGrain = 1 << 14;
  Corners corners;
  resize_touched(corners.first_polygon, surface.vertices.size());
  std::fill(corners.first_polygon.begin(), corners.first_polygon.end(), kNone);
  parallel_chunks(surface.polygon_count(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      for (const std::uint32_t v : surface.polygon(p)) {
        const std::atomic_ref<std::uint32_t> first(corners.first_polygon[v]);
        std::uint32_t known = first.load(std::memory_order_relaxed);
        while (p < known && !first.compare_exchange_weak(known, static_cast<std::uint32_t>(p),
                                                         std::memory_order_relaxed)) {
        }
      }
  });
  corners.representative = weld(surface.vertices);
  // A representative that is unused, or of another part, cannot speak for the vertex; the vertex then speaks
  // for itself.
  parallel_for_each(surface.vertices.size(), [&](std::size_t v) {
    std::uint32_t& representative = corners.representative[v];
    if (representative == v) return;
    const std::uint32_t mine = corners.first_polygon[v], other = corners.first_polygon[representative];
    if (mine == kNone || other == kNone || surface.polygon_part(mine) != surface.polygon_part(other))
      representative = static_cast<std::uint32_t>(v);
  });
  return corners;
}

// The nearest voxel so far; of those equally near, the one nearest to the middle of the part, then the cell
// of lowest number.
struct Home {
  double squared_distance = kUnreached;  // m^2, 0 inside
  bool on_face = false;                  // inside, but another voxel may hold the point as well
  Seat seat;
  [[nodiscard]] bool certain() const { return squared_distance == 0 && !on_face; }
};

// Parts are modelled in round numbers and lattices snapped to them: vertices lie on the faces of voxels and
// half-way between elements. What is closer than this to such a place, in spacings, counts as on it, so that
// rounding (another unit, a turned part) decides nothing.
constexpr double kSeatTie = 1e-9;

// (parts x 3) The middle of each part's elements, in lattice coordinates. Where nothing else decides, what is
// nearer to it is taken: so the mirrored or turned part decides alike. Only on a part's own plane of symmetry
// is there no such choice, and the higher side is taken.
std::vector<Vec3> middles(const Body& body) {
  std::vector<Vec3> result;
  for (const Part& part : body.parts) {
    Index3 low{}, high{};
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      for (int a = 0; a < 3; ++a) {
        const std::int32_t i = body.lattice_index[e][a];
        low[a] = e == part.element_begin ? i : std::min(low[a], i);
        high[a] = e == part.element_begin ? i : std::max(high[a], i);
      }
    const double half = part.placement == Placement::centre ? 0.5 : 0;
    result.push_back(0.5 * Vec3(low[0] + high[0], low[1] + high[1], low[2] + high[2]) + Vec3::Constant(half));
  }
  return result;
}

// Whether a point at `at`, `offset` above the place half-way between two elements (spacings), goes with the
// higher one.
bool goes_up(double offset, double at, double middle) {
  if (std::abs(offset) < kSeatTie) return middle >= at - kSeatTie;
  return offset > 0;
}

// Whether of two cells equally near the first is taken.
bool is_preferred(const Body& body, std::uint32_t cell, std::uint32_t other, const Vec3& middle) {
  const auto squared_distance = [&](std::uint32_t c) {
    const Index3& index = body.lattice_index[body.cell_elements[c][0]];
    return (Vec3(index[0], index[1], index[2]) + Vec3::Constant(0.5) - middle).squaredNorm();
  };
  const double mine = squared_distance(cell), its = squared_distance(other);
  return mine < its - kSeatTie || (mine <= its + kSeatTie && cell < other);
}

// Compares `cell` with the nearest so far; `u` is a point in lattice coordinates.
void consider(const Body& body, std::uint32_t cell, const Vec3& u, const Vec3& spacing, const Vec3& middle,
              Home& home) {
  const Index3& index = body.lattice_index[body.cell_elements[cell][0]];
  const Vec3 within = u - Vec3(index[0], index[1], index[2]);
  const Vec3 clamped = within.cwiseMax(Vec3::Zero()).cwiseMin(Vec3::Ones());
  const bool inside = (within - clamped).cwiseAbs().maxCoeff() < kSeatTie;
  const double squared_distance = inside ? 0 : (within - clamped).cwiseProduct(spacing).squaredNorm();
  const bool nearer = squared_distance < (1 - kSeatTie) * home.squared_distance;
  if (!nearer && squared_distance > (1 + kSeatTie) * home.squared_distance) return;
  if (!nearer && !is_preferred(body, cell, home.seat.owner, middle)) return;
  const bool on_face = inside && within.cwiseMin(Vec3::Ones() - within).minCoeff() < kSeatTie;
  int corner = 0;
  for (int a = 0; a < 3; ++a) corner += goes_up(within[a] - 0.5, u[a], middle[a]) << a;
  home = {squared_distance, on_face, {cell, true, static_cast<std::uint8_t>(corner)}};
}

// Beyond this many cells under a polygon a search by bisection is faster than looking at each.
constexpr std::size_t kManyCells = 64;

// Looks through the cells that polygon `p` bounds for one nearer to `point`.
void look_under(const Body& body, std::size_t p, const Vec3& point, const std::vector<Vec3>& middle,
                Home& home) {
  if (body.surface_cell_offsets.empty()) return;
  const std::uint32_t begin = body.surface_cell_offsets[p], end = body.surface_cell_offsets[p + 1];
  const std::uint32_t part = body.surface.polygon_part(p);
  const Lattice& lattice = body.parts[part].lattice;
  const Vec3 u = lattice.to_lattice(point);
  if (end - begin > kManyCells) {
    consider(body, locate_on_surface(body, p, point)->cell, u, lattice.spacing, middle[part], home);
    if (!home.on_face) return;
  }
  for (std::uint32_t s = begin; s < end && !home.certain(); ++s)
    consider(body, body.surface_cells[s], u, lattice.spacing, middle[part], home);
}

// Of the cells around `element`, the nearest element to `point`: the one that the point is in, or nearest to;
// where there is none, the element itself.
Seat seat_near_element(const Body& body, const Buckets<std::uint32_t>& cells_of, std::uint32_t part,
                       std::uint32_t element, const Vec3& point, const Vec3& middle) {
  const Lattice& lattice = body.parts[part].lattice;
  if (body.parts[part].placement == Placement::corner && !cells_of.begin.empty()) {
    Home home;
    const Vec3 u = lattice.to_lattice(point);
    for (std::uint32_t i = cells_of.begin[element]; i < cells_of.begin[element + 1]; ++i)
      consider(body, cells_of.values[i], u, lattice.spacing, middle, home);
    if (home.squared_distance < kUnreached) return home.seat;
  }
  return seat_at_element(body, part, element, point, middle);
}

// Polygons around some of the vertices.
struct Around {
  std::vector<std::uint32_t> slot;      // (vertices) kNone: not asked for
  std::vector<std::uint32_t> offsets;   // (slots + 1)
  std::vector<std::uint32_t> polygons;  // ascending within a slot
};

// The polygons around each vertex of `wanted`, and around those that it speaks for.
Around polygons_around(const Surface& surface, const Corners& corners,
                       const std::vector<std::uint32_t>& wanted) {
  Around around;
  around.slot.assign(surface.vertices.size(), kNone);
  for (std::size_t i = 0; i < wanted.size(); ++i) around.slot[wanted[i]] = static_cast<std::uint32_t>(i);
  around.offsets.assign(wanted.size() + 1, 0);
  const auto for_each_corner = [&](const auto& visit) {
    for (std::size_t p = 0; p < surface.polygon_count(); ++p)
      for (const std::uint32_t v : surface.polygon(p)) {
        const std::uint32_t slot = around.slot[corners.representative[v]];
        if (slot != kNone) visit(slot, static_cast<std::uint32_t>(p));
      }
  };
  for_each_corner([&](std::uint32_t slot, std::uint32_t) { ++around.offsets[slot + 1]; });
  for (std::size_t i = 1; i < around.offsets.size(); ++i) around.offsets[i] += around.offsets[i - 1];
  std::vector<std::uint32_t> next(around.offsets.begin(), around.offsets.end() - 1);
  around.polygons.resize(around.offsets.back());
  for_each_corner([&](std::uint32_t slot, std::uint32_t p) { around.polygons[next[slot]++] = p; });
  return around;
}

class Seating {
 public:
  explicit Seating(const Body& body)
      : body_(body), corners_(corners_of(body.surface)), middle_(middles(body)), grids_(body.parts.size()) {
    const std::size_t n = body.surface.vertices.size();
    resize_touched(seats_.seat, n);
    resize_touched(seats_.referenced, n);
    resize_touched(certain_, n);
  }

  Seats take() {
    seat_under_first_polygon();
    seat_remaining();
    parallel_for_each(seats_.seat.size(), [&](std::size_t v) {
      seats_.referenced[v] = corners_.first_polygon[v] != kNone;
      seats_.seat[v] = seats_.seat[corners_.representative[v]];
    });
    return std::move(seats_);
  }

 private:
  [[nodiscard]] Home look(std::uint32_t v, std::size_t polygon, Home home) const {
    look_under(body_, polygon, body_.surface.vertices[v], middle_, home);
    return home;
  }

  void seat_under_first_polygon() {
    parallel_for_each(seats_.seat.size(), [&](std::size_t v) {
      certain_[v] = 0;
      if (corners_.first_polygon[v] == kNone || corners_.representative[v] != v) return;
      const Home home = look(static_cast<std::uint32_t>(v), corners_.first_polygon[v], {});
      seats_.seat[v] = home.seat;
      certain_[v] = home.certain();
    });
  }

  void seat_remaining() {
    std::vector<std::uint32_t> remaining;
    for (std::uint32_t v = 0; v < seats_.seat.size(); ++v)
      if (corners_.representative[v] == v && !certain_[v]) remaining.push_back(v);
    if (remaining.empty()) return;
    const Around around =
        body_.surface_cells.empty() ? Around{} : polygons_around(body_.surface, corners_, remaining);
    make_grids(remaining, around);
    parallel_for_each(
        remaining.size(),
        [&](std::size_t i) {
          const std::uint32_t v = remaining[i];
          const Home home = nearest_under(v, around);
          seats_.seat[v] = home.squared_distance < kUnreached ? home.seat : seat_nearest(v);
        },
        256);
  }

  [[nodiscard]] Home nearest_under(std::uint32_t v, const Around& around) const {
    Home home;
    if (around.slot.empty()) return home;
    const std::uint32_t slot = around.slot[v];
    for (std::uint32_t i = around.offsets[slot]; i < around.offsets[slot + 1] && !home.certain(); ++i)
      home = look(v, around.polygons[i], home);
    return home;
  }

  void find_cells_of_elements() {
    cells_of_ = sort_into_buckets<std::uint32_t>(body_.element_count(), [&](const auto& use) {
      for (std::uint32_t c = 0; c < body_.cell_count(); ++c)
        for (const std::uint32_t element : body_.cell_elements[c]) use(element, c);
    });
  }

  [[nodiscard]] std::uint32_t part_of(std::uint32_t v) const {
    return body_.surface.polygon_part(corners_.first_polygon[v]);
  }

  // Grids of the parts that a vertex without a cell belongs to.
  void make_grids(const std::vector<std::uint32_t>& remaining, const Around& around) {
    std::vector<std::uint8_t> needed(body_.parts.size(), 0);
    for (const std::uint32_t v : remaining) {
      if (corners_.first_polygon[v] == kNone)
        std::fill(needed.begin(), needed.end(), std::uint8_t{1});
      else if (nearest_under(v, around).squared_distance == kUnreached)
        needed[part_of(v)] = 1;
    }
    for (std::uint32_t part = 0; part < needed.size(); ++part)
      if (needed[part] && body_.parts[part].element_begin < body_.parts[part].element_end)
        grids_[part] = std::make_unique<ElementGrid>(body_, part);
    if (std::any_of(needed.begin(), needed.end(), [](std::uint8_t part) { return part != 0; }))
      find_cells_of_elements();
  }

  [[nodiscard]] Seat seat_nearest(std::uint32_t v) const {
    const Vec3& point = body_.surface.vertices[v];
    if (corners_.first_polygon[v] != kNone) {
      const std::uint32_t part = part_of(v);
      return seat_near_element(body_, cells_of_, part, grids_[part]->nearest(point), point, middle_[part]);
    }
    std::uint32_t best_part = 0, best = kNone;
    for (std::uint32_t part = 0; part < grids_.size(); ++part) {
      const std::uint32_t element = grids_[part]->nearest(point);
      if (best != kNone &&
          (body_.rest[element] - point).squaredNorm() >= (body_.rest[best] - point).squaredNorm())
        continue;
      best = element;
      best_part = part;
    }
    return seat_near_element(body_, cells_of_, best_part, best, point, middle_[best_part]);
  }

  const Body& body_;
  Corners corners_;
  std::vector<Vec3> middle_;                         // (parts x 3) lattice coordinates
  std::vector<std::unique_ptr<ElementGrid>> grids_;  // (parts)
  Buckets<std::uint32_t> cells_of_;                  // (elements) cells around each, where grids are needed
  std::vector<std::uint8_t> certain_;                // (vertices) 1: its first polygon has settled its seat
  Seats seats_;
};

}  // namespace

Seat seat_at_element(const Body& body, std::uint32_t part, std::uint32_t element, const Vec3& point,
                     const Vec3& middle) {
  const Lattice& lattice = body.parts[part].lattice;
  const Vec3 offset =
      (lattice.axes.transpose() * (point - body.rest[element])).cwiseQuotient(lattice.spacing);
  const Vec3 at = lattice.to_lattice(point);
  int octant = 0;
  for (int a = 0; a < 3; ++a) octant += goes_up(offset[a], at[a], middle[a]) << a;
  return {element, false, static_cast<std::uint8_t>(octant)};
}

Seats take_seats(const Body& body) {
  if (body.surface.vertices.empty())
    throw InputError(
        "the body carries no surface to map onto; only frame 0 of a series does: take the body that "
        "flexel-voxelize or flexel-simulate wrote");
  for (const Part& part : body.parts)
    if (part.element_begin == part.element_end)
      throw InputError("part \"" + part.name + "\" has no elements: voxelize it with a smaller --size");
  return Seating(body).take();
}

}  // namespace flexel
