// Scan conversion: every row of lines (constant v) cuts two edges of a triangle, interpolated from the lower
// to the upper vertex so that both triangles of an edge find the same u; lines between the two cross the
// triangle. A coordinate on a line counts as above it along u and v alike (see clip.cpp): the line runs a hair
// below its place, as the corners of voxels lie there.
#include "voxelize/mesh/line_crossings.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/parallel.h"

namespace flexel::voxelize {
namespace {

// How many grid lines lie below a coordinate.
int lines_below(double coordinate, double begin, double step, int count) {
  double n = std::ceil((coordinate - begin) / step);
  if (!(n > 0)) return 0;
  if (n > count) return count;
  // Rounding of the quotient must not contradict the comparison of coordinates.
  while (n > 0 && begin + (n - 1) * step >= coordinate) --n;
  while (n < count && begin + n * step < coordinate) ++n;
  return static_cast<int>(n);
}

// How many grid lines lie below a coordinate or on it.
int lines_up_to(double coordinate, double begin, double step, int count) {
  const int n = lines_below(coordinate, begin, step, count);
  return n < count && begin + n * step == coordinate ? n + 1 : n;
}

// Whether surely no grid line lies between the coordinates: a quick look that may say no where it is true.
bool between_lines(const std::array<double, 3>& coordinates, double begin, double step, int count) {
  constexpr double kMargin = 1e-6;
  const auto [low, high] = std::minmax({coordinates[0], coordinates[1], coordinates[2]});
  const double first = (low - begin) / step - kMargin, last = (high - begin) / step + kMargin;
  // Both are moved into [0, count + 1], where casting rounds down.
  const auto whole = [&](double lines) { return static_cast<int>(std::clamp(lines + 1, 0., count + 1.)); };
  return whole(first) == whole(last);
}

struct Triangle2 {
  std::array<double, 3> u, v, w;
};

// u where edge (p, q) of the triangle crosses the row at `v`, which it does.
double edge_at_row(const Triangle2& t, int p, int q, double v) {
  if (t.v[p] > t.v[q]) std::swap(p, q);
  return t.u[p] + (v - t.v[p]) / (t.v[q] - t.v[p]) * (t.u[q] - t.u[p]);
}

void cross_row(const Triangle2& t, double v, int b, const LineGrid& grid, std::uint32_t triangle,
               std::vector<LineCrossing>& out) {
  double ends[2];
  bool upward[2];
  int n = 0;
  for (int p = 0; p < 3 && n < 2; ++p) {
    const int q = (p + 1) % 3;
    if ((t.v[p] < v) == (t.v[q] < v)) continue;
    ends[n] = edge_at_row(t, p, q, v);
    upward[n++] = t.v[p] < v;
  }
  if (n < 2) return;
  // Counter-clockwise seen from +axis (normal along +axis: leaving): the upward edge is on the high side.
  const int high = ends[0] < ends[1] ? 1 : 0;
  const int begin = lines_up_to(ends[1 - high], grid.u_begin, grid.u_step, grid.u_count);
  const int end = lines_up_to(ends[high], grid.u_begin, grid.u_step, grid.u_count);
  if (begin >= end) return;
  const double du1 = t.u[1] - t.u[0], dv1 = t.v[1] - t.v[0], du2 = t.u[2] - t.u[0], dv2 = t.v[2] - t.v[0];
  const double twice_area = du1 * dv2 - du2 * dv1;
  const auto [low, top] = std::minmax({t.w[0], t.w[1], t.w[2]});
  for (int a = begin; a < end; ++a) {
    const double du = grid.u_begin + a * grid.u_step - t.u[0], dv = v - t.v[0];
    const double s = twice_area != 0 ? (du * dv2 - du2 * dv) / twice_area : 0,
                 r = twice_area != 0 ? (du1 * dv - du * dv1) / twice_area : 0;
    const double w = t.w[0] + s * (t.w[1] - t.w[0]) + r * (t.w[2] - t.w[0]);
    out.push_back({static_cast<std::uint32_t>(a + static_cast<std::int64_t>(grid.u_count) * b),
                   upward[high] ? -1 : 1, std::clamp(w, low, top), triangle});
  }
}

void cross_triangle_lines(const PartMesh& mesh, const std::vector<Vec3>& points, const LineGrid& grid,
                          std::uint32_t triangle, std::vector<LineCrossing>& out) {
  const int u = (grid.axis + 1) % 3, v = (grid.axis + 2) % 3;
  Triangle2 t;
  for (int c = 0; c < 3; ++c) {
    const Vec3& point = points[mesh.corners[triangle][c]];
    t.u[c] = point[u];
    t.v[c] = point[v];
    t.w[c] = point[grid.axis];
  }
  if (between_lines(t.v, grid.v_begin, grid.v_step, grid.v_count) ||
      between_lines(t.u, grid.u_begin, grid.u_step, grid.u_count))
    return;
  const auto [low, high] = std::minmax({t.v[0], t.v[1], t.v[2]});
  // A row at exactly the lowest coordinate does not cross (a coordinate on a line is above it); one at the
  // highest does not count as below it either.
  const int end = lines_below(high, grid.v_begin, grid.v_step, grid.v_count);
  for (int b = lines_below(low, grid.v_begin, grid.v_step, grid.v_count); b <= end && b < grid.v_count; ++b)
    cross_row(t, grid.v_begin + b * grid.v_step, b, grid, triangle, out);
}

// A line has few crossings: they are counted into their lines, and each line is sorted by itself.
std::vector<LineCrossing> sorted_by_line(const std::vector<std::vector<LineCrossing>>& found,
                                         std::size_t lines) {
  std::vector<std::uint32_t> next(lines + 1, 0);  // where the next crossing of a line goes
  for (const auto& part : found)
    for (const LineCrossing& crossing : part) ++next[crossing.line + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<LineCrossing> crossings(next.back());
  for (const auto& part : found)
    for (const LineCrossing& crossing : part) crossings[next[crossing.line]++] = crossing;
  parallel_for_each(lines, [&](std::size_t line) {  // next[line] is where the line ends now
    const auto begin = static_cast<std::ptrdiff_t>(line == 0 ? 0 : next[line - 1]);
    std::sort(crossings.begin() + begin, crossings.begin() + static_cast<std::ptrdiff_t>(next[line]),
              [](const LineCrossing& a, const LineCrossing& b) {
                return a.at != b.at ? a.at < b.at : a.triangle < b.triangle;
              });
  });
  return crossings;
}

}  // namespace

std::vector<LineCrossing> cross_lines(const PartMesh& mesh, const std::vector<Vec3>& points,
                                      const LineGrid& grid, std::span<const std::uint32_t> triangles) {
  const std::size_t n = triangles.empty() ? mesh.corners.size() : triangles.size();
  constexpr std::size_t kGrain = 8192;
  std::vector<std::vector<LineCrossing>> found((n + kGrain - 1) / kGrain);
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      cross_triangle_lines(mesh, points, grid,
                           triangles.empty() ? static_cast<std::uint32_t>(t) : triangles[t],
                           found[begin / kGrain]);
  });
  return sorted_by_line(found,
                        static_cast<std::size_t>(grid.u_count) * static_cast<std::size_t>(grid.v_count));
}

}  // namespace flexel::voxelize
