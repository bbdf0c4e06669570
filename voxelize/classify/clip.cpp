// A triangle is cut along z into a slab, that along y into rows, those along x into voxels. Each cut
// interpolates from the point below the plane to the one above, on sides that both triangles of an edge see
// alike: the two agree bit for bit on where their edge crosses a plane, and slabs agree with each other. A
// coordinate on a plane counts as above it, so every point of the surface is in exactly one voxel, as if the
// lattice were shifted down by an infinitesimal amount.
//
// Share of the fill (divergence theorem, one axis at a time). With solid inside an outward-oriented surface,
// the fill of voxel (i, j, k) is the winding number at its lowest corner plus, for every triangle in it, the
// sum of
//   the integral of (z - (k+1)) n_z dA over the clipped polygon,
//   the integral of ((j+1) - y) dx along its side on plane z = k, if it has one,
//   +-((i+1) - x) where that side starts or ends on plane y = j, + if the solid is entered there going along
//   +x.
#include "voxelize/classify/clip.h"

#include <algorithm>

namespace flexel::voxelize {
namespace {

using Point = std::array<double, 3>;

// Where the side from `below` (coordinate < plane) to `above` (>= plane) crosses the plane.
Point crossing(const Point& below, const Point& above, int axis, double plane) {
  if (above[axis] == plane) return above;
  const double t = (plane - below[axis]) / (above[axis] - below[axis]);
  Point point;
  for (int a = 0; a < 3; ++a) point[a] = below[a] + t * (above[a] - below[a]);
  point[axis] = plane;
  return point;
}

// The part of `in` with low <= coordinate < low + 1.
void cut_band(const Polygon& in, int axis, double low, Polygon& out) {
  const double high = low + 1;
  const auto low_bit = static_cast<std::uint16_t>(kXLow << (2 * axis)),
             high_bit = static_cast<std::uint16_t>(kXHigh << (2 * axis));
  out.count = 0;
  for (int v = 0; v < in.count; ++v) {
    const Point& p = in.corner[v];
    const Point& q = in.corner[v + 1 < in.count ? v + 1 : 0];
    const std::uint16_t side = in.side[v];
    const double pc = p[axis], qc = q[axis];
    if (pc < low) {
      if (qc >= low) out.add(crossing(p, q, axis, low), side);
      if (qc >= high) out.add(crossing(p, q, axis, high), high_bit);
    } else if (pc >= high) {
      if (qc < high) out.add(crossing(q, p, axis, high), side);
      if (qc < low) out.add(crossing(q, p, axis, low), low_bit);
    } else {
      out.add(p, side);
      if (qc >= high)
        out.add(crossing(p, q, axis, high), high_bit);
      else if (qc < low)
        out.add(crossing(q, p, axis, low), low_bit);
    }
  }
}

// Whole-number range of one coordinate over a polygon.
std::array<int, 2> band_range(const Polygon& polygon, int axis) {
  double low = polygon.corner[0][axis], high = low;
  for (int v = 1; v < polygon.count; ++v) {
    low = std::min(low, polygon.corner[v][axis]);
    high = std::max(high, polygon.corner[v][axis]);
  }
  return {floor_int(low), floor_int(high)};
}

Polygon whole_triangle(const TrianglePoints& points) {
  Polygon polygon;
  for (int a = 0; a < 3; ++a)
    polygon.add({points[a]->x(), points[a]->y(), points[a]->z()},
                static_cast<std::uint16_t>(kTriangleEdge0 << a));
  return polygon;
}

// Integral of (z - (k+1)) n_z dA over the polygon.
double column_volume(const Polygon& polygon, int k) {
  const Point& o = polygon.corner[0];
  double sum = 0;
  for (int v = 1; v + 1 < polygon.count; ++v) {
    const Point &p = polygon.corner[v], &q = polygon.corner[v + 1];
    const double twice_area = (p[0] - o[0]) * (q[1] - o[1]) - (q[0] - o[0]) * (p[1] - o[1]);
    sum += twice_area * ((o[2] - (k + 1)) + (p[2] - (k + 1)) + (q[2] - (k + 1)));
  }
  return sum / 6;
}

// Which voxel edge two planes meet in, and the sign of the winding change along it when a polygon's side on
// the first plane is followed by one on the second. Low planes: z then y enters along x; x then z enters
// along y; y then x enters along z. The opposite order leaves; each high plane instead of a low one mirrors
// the figure and so changes the sign.
struct EdgeCrossing {
  int edge = -1;
  int sign = 0;
};
EdgeCrossing edge_crossing(std::uint16_t first, std::uint16_t second) {
  const auto pair = static_cast<std::uint16_t>(first | second);
  switch (pair) {
    case kZLow | kYLow:
      return {kAlongX, first == kZLow ? 1 : -1};
    case kXLow | kZLow:
      return {kAlongYAtXLow, first == kXLow ? 1 : -1};
    case kXHigh | kZLow:
      return {kAlongYAtXHigh, first == kXHigh ? -1 : 1};
    case kXLow | kYLow:
      return {kAlongZ00, first == kYLow ? 1 : -1};
    case kXHigh | kYLow:
      return {kAlongZ10, first == kYLow ? -1 : 1};
    case kXLow | kYHigh:
      return {kAlongZ01, first == kYHigh ? -1 : 1};
    case kXHigh | kYHigh:
      return {kAlongZ11, first == kYHigh ? 1 : -1};
    default:
      return {};
  }
}

Record make_record(const Polygon& polygon, std::uint32_t triangle, int i, int j, int k) {
  Record record{.volume = column_volume(polygon, k), .i = i, .j = j, .triangle = triangle};
  std::array<int, kVoxelEdges> change{};
  bool changes = false;
  std::uint16_t before = polygon.side[polygon.count - 1];
  for (int v = 0; v < polygon.count; ++v) {
    const std::uint16_t side = polygon.side[v];
    record.sides |= side;
    if (side > kTriangleEdges) {
      const Point& p = polygon.corner[v];
      if (side == kZLow) {
        const Point& q = polygon.corner[v + 1 < polygon.count ? v + 1 : 0];
        record.volume += (((j + 1) - p[1]) + ((j + 1) - q[1])) / 2 * (q[0] - p[0]);
      }
      const EdgeCrossing at = before > kTriangleEdges ? edge_crossing(before, side) : EdgeCrossing{};
      if (at.edge >= 0) {
        changes = true;
        change[at.edge] += at.sign;
        if (at.edge == kAlongX) record.volume += at.sign * ((i + 1) - p[0]);
      }
    }
    before = side;
  }
  for (int edge = 0; changes && edge < kVoxelEdges; ++edge)
    record.windings = static_cast<std::uint16_t>(record.windings | ((change[edge] & 3) << (2 * edge)));
  return record;
}

// A cut that would keep everything is left out.
const Polygon& cut_to_slab(const Polygon& whole, int k, Polygon& slab) {
  const auto [k_begin, k_last] = band_range(whole, 2);
  if (k_begin == k_last) return whole;
  cut_band(whole, 2, k, slab);
  return slab;
}

// Change of the winding number along the row's lattice line, y = j and z = k, before x = `i`: that of the voxels' edges
// there, for the polygon's corners on the line are theirs.
int winding_before(const Polygon& in_row, int i) {
  int change = 0;
  std::uint16_t before = in_row.side[in_row.count - 1];
  for (int v = 0; v < in_row.count; ++v) {
    const std::uint16_t side = in_row.side[v];
    if (before > kTriangleEdges && side > kTriangleEdges && in_row.corner[v][0] < i) {
      const EdgeCrossing at = edge_crossing(before, side);
      if (at.edge == kAlongX) change += at.sign;
    }
    before = side;
  }
  return change;
}

// Voxels that a row's polygon reaches, and which of them are wanted.
struct VoxelRange {
  int begin = 0, last = 0, first_wanted = 0, last_wanted = 0;
};

void add_voxels(const Polygon& in_row, std::uint32_t triangle, const VoxelRange& range, int j, int k,
                std::vector<Record>& records) {
  if (range.first_wanted > range.last_wanted) return;
  if (range.begin == range.last) {
    records.push_back(make_record(in_row, triangle, range.begin, j, k));
    return;
  }
  Polygon voxel;
  for (int i = range.first_wanted; i <= range.last_wanted; ++i) {
    cut_band(in_row, 0, i, voxel);
    if (voxel.count > 0) records.push_back(make_record(voxel, triangle, i, j, k));
  }
}

}  // namespace

void clip_to_slab(const TrianglePoints& points, std::uint32_t triangle, int k, std::vector<Record>& records) {
  const Polygon whole = whole_triangle(points);
  Polygon slab, row;
  const Polygon& in_slab = cut_to_slab(whole, k, slab);
  if (in_slab.count == 0) return;
  const auto [j_begin, j_last] = band_range(in_slab, 1);
  for (int j = j_begin; j <= j_last; ++j) {
    if (j_begin != j_last) cut_band(in_slab, 1, j, row);
    const Polygon& in_row = j_begin != j_last ? row : in_slab;
    if (in_row.count == 0) continue;
    const auto [i_begin, i_last] = band_range(in_row, 0);
    add_voxels(in_row, triangle, {i_begin, i_last, i_begin, i_last}, j, k, records);
  }
}

void clip_to_window(const TrianglePoints& points, std::uint32_t triangle, int k, SlabWindow& window,
                    std::vector<Record>& records) {
  const Polygon whole = whole_triangle(points);
  Polygon slab, row;
  const Polygon& in_slab = cut_to_slab(whole, k, slab);
  if (in_slab.count == 0) return;
  const auto [j_begin, j_last] = band_range(in_slab, 1);
  const int j_end = window.j_begin + static_cast<int>(window.left.size());
  for (int j = std::max(j_begin, window.j_begin); j <= std::min(j_last, j_end - 1); ++j) {
    if (j_begin != j_last) cut_band(in_slab, 1, j, row);
    const Polygon& in_row = j_begin != j_last ? row : in_slab;
    if (in_row.count == 0) continue;
    const auto [i_begin, i_last] = band_range(in_row, 0);
    if (i_begin < window.i_begin)
      window.left[static_cast<std::size_t>(j - window.j_begin)] += winding_before(in_row, window.i_begin);
    add_voxels(in_row, triangle,
               {i_begin, i_last, std::max(i_begin, window.i_begin), std::min(i_last, window.i_end - 1)}, j, k,
               records);
  }
}

Polygon clip_to_voxel(const TrianglePoints& points, int i, int j, int k) {
  Polygon slab, row, voxel;
  cut_band(whole_triangle(points), 2, k, slab);
  cut_band(slab, 1, j, row);
  cut_band(row, 0, i, voxel);
  return voxel;
}

}  // namespace flexel::voxelize
