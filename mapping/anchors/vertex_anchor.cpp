// Nearly every vertex lies inside the voxel of a cell that its first polygon bounds. Those are found first,
// without a table of the polygons around each vertex. Other vertices (on the face between two voxels, or of
// matter too thin for a cell of its own) take the nearest of the cells of all polygons around them, so that
// the order of polygons does not matter; without any such cell, the nearest element of their part.
//
// Of the vertices at one position in one part (an OBJ has them along texture seams) one representative is
// located. Inside a voxel with one cell all of them find that cell, so representatives are needed only
// elsewhere.
#include "mapping/anchors/vertex_anchor.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <tuple>

#include "base/bucket.h"
#include "base/error.h"
#include "base/math/weld.h"
#include "formats/lattice/locate.h"
#include "mapping/anchors/polygons_around.h"

namespace flexel::mapping {
namespace {

constexpr double kUnreached = std::numeric_limits<double>::infinity();

// Where a cell lies, and whether another piece has a cell there too.
struct CellVoxel {
  Index3 index{};
  bool shared = false;
};

// (cells)
std::vector<CellVoxel> voxels_of_cells(const Body& body) {
  std::vector<CellVoxel> voxels(body.cell_count());
  const auto index = [&](std::size_t c) { return body.lattice_index[body.cell_elements[c][0]]; };
  for (const Part& part : body.parts)
    parallel_for_each(part.cell_end - part.cell_begin, [&](std::size_t i) {
      const std::size_t c = part.cell_begin + i;  // sorted by voxel
      voxels[c].index = index(c);
      voxels[c].shared = (c > part.cell_begin && index(c) == index(c - 1)) ||
                         (c + 1 < part.cell_end && index(c) == index(c + 1));
    });
  return voxels;
}

// The nearest voxel so far; of those equally near, the one nearest to the middle of the part, then the cell
// of lowest number.
struct Home {
  double squared_distance = kUnreached;  // m^2, 0 inside
  bool on_face = false;                  // inside, but another voxel may hold the point as well
  VertexAnchor anchor;
  [[nodiscard]] bool certain() const { return squared_distance == 0 && !on_face; }
};

// Parts are modelled in round numbers and lattices snapped to them: vertices lie on the faces of voxels and
// half-way between elements. What is closer than this to such a place, in spacings, counts as on it, so that
// rounding (another unit, a turned part) decides nothing.
constexpr double kAnchorTie = 1e-9;

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
  if (std::abs(offset) < kAnchorTie) return middle >= at - kAnchorTie;
  return offset > 0;
}

// The corner of a cell that a point goes with; `within` is the point as seen from the cell's lowest corner.
std::uint8_t corner_of(const Vec3& within, const Vec3& at, const Vec3& middle) {
  int corner = 0;
  for (int a = 0; a < 3; ++a) corner += goes_up(within[a] - 0.5, at[a], middle[a]) << a;
  return static_cast<std::uint8_t>(corner);
}

// Whether of two cells equally near the first is taken.
bool is_preferred(const Body& body, std::uint32_t cell, std::uint32_t other, const Vec3& middle) {
  const auto squared_distance = [&](std::uint32_t c) {
    const Index3& index = body.lattice_index[body.cell_elements[c][0]];
    return (Vec3(index[0], index[1], index[2]) + Vec3::Constant(0.5) - middle).squaredNorm();
  };
  const double mine = squared_distance(cell), its = squared_distance(other);
  return mine < its - kAnchorTie || (mine <= its + kAnchorTie && cell < other);
}

// Compares `cell` with the nearest so far; `u` is a point in lattice coordinates.
void consider(const Body& body, std::uint32_t cell, const Vec3& u, const Vec3& spacing, const Vec3& middle,
              Home& home) {
  const Index3& index = body.lattice_index[body.cell_elements[cell][0]];
  const Vec3 within = u - Vec3(index[0], index[1], index[2]);
  const Vec3 clamped = within.cwiseMax(Vec3::Zero()).cwiseMin(Vec3::Ones());
  const bool inside = (within - clamped).cwiseAbs().maxCoeff() < kAnchorTie;
  const double squared_distance = inside ? 0 : (within - clamped).cwiseProduct(spacing).squaredNorm();
  const bool nearer = squared_distance < (1 - kAnchorTie) * home.squared_distance;
  if (!nearer && squared_distance > (1 + kAnchorTie) * home.squared_distance) return;
  if (!nearer && !is_preferred(body, cell, home.anchor.owner, middle)) return;
  const bool on_face = inside && within.cwiseMin(Vec3::Ones() - within).minCoeff() < kAnchorTie;
  home = {squared_distance, on_face, {cell, true, corner_of(within, u, middle)}};
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
Home home_near_element(const Body& body, const Buckets<std::uint32_t>& cells_of, std::uint32_t part,
                       std::uint32_t element, const Vec3& point, const Vec3& middle) {
  const Lattice& lattice = body.parts[part].lattice;
  Home home;
  if (body.parts[part].placement == Placement::corner && !cells_of.begin.empty()) {
    const Vec3 u = lattice.to_lattice(point);
    for (std::uint32_t i = cells_of.begin[element]; i < cells_of.begin[element + 1]; ++i)
      consider(body, cells_of.values[i], u, lattice.spacing, middle, home);
    if (home.squared_distance < kUnreached) return home;
  }
  Vec3 beside =
      lattice.to_lattice(point) -
      Vec3(body.lattice_index[element][0], body.lattice_index[element][1], body.lattice_index[element][2]);
  if (body.parts[part].placement == Placement::centre)  // of its voxel
    beside = (-beside).cwiseMax(beside - Vec3::Ones()).cwiseMax(0.0);
  home.squared_distance = beside.cwiseProduct(lattice.spacing).squaredNorm();
  home.anchor = anchor_at_element(body, part, element, point, middle);
  return home;
}

class AnchorFinder {
 public:
  AnchorFinder(const Body& body, const std::vector<std::optional<PointHome>>& homes)
      : body_(body), homes_(homes), middle_(middles(body)), grids_(body.parts.size()) {
    const std::size_t n = body.surface.vertices.size();
    resize_touched(anchors_.anchor, n);
    resize_touched(anchors_.referenced, n);
    resize_touched(settled_, n);
  }

  VertexAnchors take() {
    if (!body_.surface_cell_offsets.empty()) anchor_inside_voxels();
    if (std::count(settled_.begin(), settled_.end(), kAlone) != std::ssize(settled_)) {
      first_polygon_ = first_polygons(body_.surface);
      anchor_under_first_polygon();
      find_representatives();
      anchor_remaining();
    }
    parallel_for_each(anchors_.anchor.size(), [&](std::size_t v) {
      anchors_.referenced[v] = settled_[v] != kUnused;
      if (!representative_.empty()) anchors_.anchor[v] = anchors_.anchor[representative_[v]];
    });
    return std::move(anchors_);
  }

 private:
  // What is known of a vertex's anchor from the polygons around it.
  enum Settled : std::uint8_t {
    kOpen,
    kAmongPieces,  // a cell that its first polygon bounds holds it
    kAlone,        // so does the only cell of its voxel, which every vertex of the part at its position finds
    kUnused,
  };

  // Of the vertices that lie inside a voxel with one cell, clear of its faces: any polygon around them that
  // bounds the cell will do, so polygons are gone through as they come, and threads that meet at a vertex
  // write the same.
  void anchor_inside_voxels() {
    const std::vector<CellVoxel> voxels = voxels_of_cells(body_);
    parallel_chunks(body_.surface.polygon_count(), kPolygonsAtATime, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p)
        for (const std::uint32_t v : body_.surface.polygon(p)) {
          const std::atomic_ref<Settled> settled(settled_[v]);
          if (settled.load(std::memory_order_relaxed) == kAlone) continue;
          const std::optional<VertexAnchor> anchor = anchor_inside(voxels, p, body_.surface.vertices[v]);
          if (!anchor) continue;
          std::atomic_ref<VertexAnchor>(anchors_.anchor[v]).store(*anchor, std::memory_order_relaxed);
          settled.store(kAlone, std::memory_order_relaxed);
        }
    });
  }

  [[nodiscard]] std::optional<VertexAnchor> anchor_inside(const std::vector<CellVoxel>& voxels, std::size_t p,
                                                          const Vec3& point) const {
    const std::uint32_t begin = body_.surface_cell_offsets[p], end = body_.surface_cell_offsets[p + 1];
    if (end - begin > kManyCells) return std::nullopt;
    const std::uint32_t part = body_.surface.polygon_part(p);
    const Vec3 u = body_.parts[part].lattice.to_lattice(point);
    for (std::uint32_t s = begin; s < end; ++s) {
      const CellVoxel& voxel = voxels[body_.surface_cells[s]];
      const Vec3 within = u - Vec3(voxel.index[0], voxel.index[1], voxel.index[2]);
      if (within.cwiseMin(Vec3::Ones() - within).minCoeff() < kAnchorTie) continue;
      if (voxel.shared) return std::nullopt;
      return VertexAnchor{body_.surface_cells[s], true, corner_of(within, u, middle_[part])};
    }
    return std::nullopt;
  }

  [[nodiscard]] Home look(std::uint32_t v, std::size_t polygon, Home home) const {
    look_under(body_, polygon, body_.surface.vertices[v], middle_, home);
    return home;
  }

  void anchor_under_first_polygon() {
    parallel_for_each(anchors_.anchor.size(), [&](std::size_t v) {
      if (settled_[v] == kAlone) return;
      if (first_polygon_[v] == kNone) {
        settled_[v] = kUnused;
        return;
      }
      const Home home = look(static_cast<std::uint32_t>(v), first_polygon_[v], {});
      anchors_.anchor[v] = home.anchor;
      if (home.certain()) settled_[v] = kAmongPieces;
    });
  }

  // A vertex whose representative is unused, or of another part, represents itself.
  void find_representatives() {
    std::vector<std::uint32_t> doubtful;
    for (std::uint32_t v = 0; v < settled_.size(); ++v)
      if (settled_[v] == kOpen || settled_[v] == kAmongPieces) doubtful.push_back(v);
    if (doubtful.empty()) return;
    const std::vector<Vec3>& vertices = body_.surface.vertices;
    const std::vector<std::uint32_t> members = at_positions_of(vertices, doubtful);
    const std::vector<std::uint32_t> first = first_equal(members.size(), [&](std::size_t i) {
      const Vec3& at = vertices[members[i]];
      return position_key(at.x(), at.y(), at.z());
    });
    resize_touched(representative_, vertices.size());
    std::iota(representative_.begin(), representative_.end(), 0u);
    parallel_for_each(members.size(), [&](std::size_t i) {
      const std::uint32_t v = members[i], other = members[first[i]];
      const std::uint32_t mine = first_polygon_[v], its = first_polygon_[other];
      if (mine != kNone && its != kNone &&
          body_.surface.polygon_part(mine) == body_.surface.polygon_part(its))
        representative_[v] = other;
    });
  }

  void anchor_remaining() {
    std::vector<std::uint32_t> remaining;
    for (std::uint32_t v = 0; v < anchors_.anchor.size(); ++v)
      if (settled_[v] == kUnused || (settled_[v] == kOpen && representative_[v] == v)) remaining.push_back(v);
    if (remaining.empty()) return;
    const Around around =
        body_.surface_cells.empty() ? Around{} : polygons_around(body_.surface, representative_, remaining);
    make_grids(remaining, around);
    parallel_for_each(
        remaining.size(),
        [&](std::size_t i) {
          const std::uint32_t v = remaining[i];
          const Home home = nearest_under(v, around);
          anchors_.anchor[v] = home.squared_distance < kUnreached ? home.anchor : anchor_nearest(v);
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
    return body_.surface.polygon_part(first_polygon_[v]);
  }

  // Grids of the parts that a vertex without a cell belongs to.
  void make_grids(const std::vector<std::uint32_t>& remaining, const Around& around) {
    std::vector<std::uint8_t> needed(body_.parts.size(), 0);
    for (const std::uint32_t v : remaining) {
      if (first_polygon_[v] == kNone)
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

  [[nodiscard]] VertexAnchor anchor_nearest(std::uint32_t v) const {
    const Vec3& point = body_.surface.vertices[v];
    if (first_polygon_[v] != kNone) {
      const std::uint32_t part = part_of(v);
      return home_near_element(body_, cells_of_, part, grids_[part]->nearest(point), point, middle_[part])
          .anchor;
    }
    if (v < homes_.size() && homes_[v]) return anchor_at_home(*homes_[v], point);
    // of the part in whose cells it is, or whose cells are nearest; of several the one with the nearest element
    Home best;
    double beside = kUnreached;  // m^2, of the best from its element
    for (std::uint32_t part = 0; part < grids_.size(); ++part) {
      const std::uint32_t element = grids_[part]->nearest(point);
      const Home home = home_near_element(body_, cells_of_, part, element, point, middle_[part]);
      const double from_element = (body_.rest[element] - point).squaredNorm();
      if (std::tie(home.squared_distance, from_element) >= std::tie(best.squared_distance, beside)) continue;
      best = home;
      beside = from_element;
    }
    return best.anchor;
  }

  [[nodiscard]] VertexAnchor anchor_at_home(const PointHome& known, const Vec3& point) const {
    const Vec3& middle = middle_[known.part];
    if (!known.cell)
      return anchor_at_element(body_, known.part, grids_[known.part]->nearest(point), point, middle);
    const Lattice& lattice = body_.parts[known.part].lattice;
    Home home;
    consider(body_, *known.cell, lattice.to_lattice(point), lattice.spacing, middle, home);
    return home.anchor;
  }

  const Body& body_;
  const std::vector<std::optional<PointHome>>& homes_;
  std::vector<std::uint32_t> first_polygon_;         // (vertices) kNone: unused
  std::vector<std::uint32_t> representative_;        // (vertices) whose anchor each shares; empty: its own
  std::vector<Vec3> middle_;                         // (parts x 3) lattice coordinates
  std::vector<std::unique_ptr<ElementGrid>> grids_;  // (parts)
  Buckets<std::uint32_t> cells_of_;                  // (elements) cells around each, where grids are needed
  std::vector<Settled> settled_;                     // (vertices)
  VertexAnchors anchors_;
};

}  // namespace

VertexAnchor anchor_at_element(const Body& body, std::uint32_t part, std::uint32_t element, const Vec3& point,
                               const Vec3& middle) {
  const Lattice& lattice = body.parts[part].lattice;
  const Vec3 offset =
      (lattice.axes.transpose() * (point - body.rest[element])).cwiseQuotient(lattice.spacing);
  const Vec3 at = lattice.to_lattice(point);
  int octant = 0;
  for (int a = 0; a < 3; ++a) octant += goes_up(offset[a], at[a], middle[a]) << a;
  return {element, false, static_cast<std::uint8_t>(octant)};
}

VertexAnchors locate_vertices(const Body& body, const std::vector<std::optional<PointHome>>& homes) {
  if (body.surface.vertices.empty())
    throw InputError(
        "the body carries no surface to map onto: take the body that "
        "flexel-voxelize or flexel-simulate wrote, a frame of a series by its name");
  for (const Part& part : body.parts)
    if (part.element_begin == part.element_end)
      throw InputError("part \"" + part.name + "\" has no elements: voxelize it with a smaller --size");
  return AnchorFinder(body, homes).take();
}

}  // namespace flexel::mapping
