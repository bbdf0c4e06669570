// Lines along each axis, on a grid over the intersection of the two parts' boxes. Along a line the matter of
// a part is a list of intervals; two intervals overlap, touch or leave a gap.
#include "voxelize/neighbours.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "voxelize/mesh/line_crossings.h"

namespace flexel::voxelize {
namespace {

constexpr int kLinesAcross = 64;                         // across the common box, in each direction
constexpr double kSame = .99;                            // of either volume: two parts are one body twice
constexpr double kOfDiagonal = 1e-6, kOfSpacing = 1e-2;  // touching: that of simulate's search for bonds
constexpr double kNotableOverlap = .01;  // of the smaller volume: less, of parts that touch, is tessellation
constexpr double kFacing = -.7;          // cosine between normals that look at each other

struct Interval {
  double begin = 0, end = 0;
  std::uint32_t first = 0, last = 0;  // triangles
};

// Matter along each line of a grid: where winding numbers are above 0, or, on a surface that is not closed,
// between odd and even crossings where their number is even.
std::vector<std::vector<Interval>> intervals(const PartMesh& mesh, const LineGrid& grid) {
  std::vector<std::vector<Interval>> found(static_cast<std::size_t>(grid.u_count) *
                                           static_cast<std::size_t>(grid.v_count));
  const std::vector<LineCrossing> crossings = cross_lines(mesh, mesh.world, grid);
  for (std::size_t n = 0, end; n < crossings.size(); n = end) {
    for (end = n + 1; end < crossings.size() && crossings[end].line == crossings[n].line;) ++end;
    if (!mesh.balanced() && (end - n) % 2 != 0) continue;
    int inside = 0;
    for (std::size_t m = n; m < end; ++m) {
      const int before = inside;
      inside = mesh.balanced() ? inside + crossings[m].change : 1 - inside;
      std::vector<Interval>& line = found[crossings[n].line];
      if (before <= 0 && inside > 0)
        line.push_back({crossings[m].at, crossings[m].at, crossings[m].triangle, 0});
      else if (before > 0 && inside <= 0)
        line.back().end = crossings[m].at, line.back().last = crossings[m].triangle;
    }
  }
  return found;
}

double total_length(const std::vector<std::vector<Interval>>& lines) {
  double sum = 0;
  for (const auto& line : lines)
    for (const Interval& each : line) sum += each.end - each.begin;
  return sum;
}

// Two parts, compared.
class Comparison {
 public:
  Comparison(const PartMesh& a, const PartMesh& b, const Box& box, double tolerance)
      : mesh_{&a, &b}, box_(box), tolerance_(tolerance) {}

  void compare(int axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double u_step = box_.size()[u] / kLinesAcross, v_step = box_.size()[v] / kLinesAcross;
    if (std::min(u_step, v_step) * kLinesAcross <= tolerance_) return;  // they only touch along this axis
    const LineGrid grid{
        axis, box_.min[u] + u_step / 2, box_.min[v] + v_step / 2, u_step, v_step, kLinesAcross, kLinesAcross};
    const auto of_a = intervals(*mesh_[0], grid), of_b = intervals(*mesh_[1], grid);
    double overlap = 0;
    for (std::size_t line = 0; line < of_a.size(); ++line)
      for (const Interval& mine : of_a[line])
        for (const Interval& other : of_b[line]) overlap += meet(axis, mine, other);
    overlap_ += overlap * u_step * v_step / 3;
    for (int n = 0; n < 2; ++n) volume_[n] += total_length(n == 0 ? of_a : of_b) * u_step * v_step / 3;
  }

  [[nodiscard]] double overlap() const { return overlap_; }
  // All of each lies in the other: lines along every axis meet nothing else of either.
  [[nodiscard]] bool same() const { return overlap_ >= kSame * std::max(volume_[0], volume_[1]); }
  [[nodiscard]] bool touching() const { return touching_; }
  [[nodiscard]] double gap() const { return gap_; }

 private:
  // Length in both intervals, where it is more than rounding; else notes whether they touch, or their gap.
  double meet(int axis, const Interval& mine, const Interval& other) {
    const double both = std::min(mine.end, other.end) - std::max(mine.begin, other.begin);
    if (both > tolerance_) return both;
    const bool after = mine.begin > other.begin;
    const Vec3 leaving = unit_normal(*mesh_[after], (after ? other : mine).last),
               entering = unit_normal(*mesh_[!after], (after ? mine : other).first);
    if (leaving.dot(entering) > kFacing) return 0;
    const double gap = std::max(0., -both) * std::abs(leaving[axis]);
    touching_ |= gap <= tolerance_;
    gap_ = std::min(gap_, gap);
    return 0;
  }

  std::array<const PartMesh*, 2> mesh_;
  Box box_;
  double tolerance_, overlap_ = 0, gap_ = std::numeric_limits<double>::infinity();
  std::array<double, 2> volume_{};
  bool touching_ = false;
};

// What both boxes have in common; along an axis on which they miss each other by at most `reach`, the gap.
Box common_box(const Box& a, const Box& b, double reach) {
  Box box;
  const Vec3 low = a.min.cwiseMax(b.min), high = a.max.cwiseMin(b.max);
  if ((low.array() > high.array() + reach).any()) return box;
  box.add(low);
  box.add(high);
  return box;
}

}  // namespace

std::vector<PartPair> noteworthy_pairs(const std::vector<HealedPart>& parts,
                                       const std::vector<double>& spacing) {
  std::vector<Box> box;
  Box all;
  std::vector<double> volume;
  for (const HealedPart& part : parts) {
    volume.push_back(std::abs(enclosed_volume(part.mesh)));
    box.push_back(bounding_box(part.mesh.world));
    all.add(box.back().min);
    all.add(box.back().max);
  }
  std::vector<PartPair> pairs;
  for (std::uint32_t a = 0; a < parts.size(); ++a)
    for (std::uint32_t b = a + 1; b < parts.size(); ++b) {
      const double cell = std::max(spacing[a], spacing[b]);
      const Box common = common_box(box[a], box[b], cell);
      if (common.empty()) continue;
      const double tolerance = std::max(kOfDiagonal * all.diagonal(), kOfSpacing * cell);
      Comparison lines(parts[a].mesh, parts[b].mesh, common, tolerance);
      for (int axis = 0; axis < 3; ++axis) lines.compare(axis);
      const double smaller = std::min(volume[a], volume[b]);
      if (lines.overlap() > kNotableOverlap * smaller || (lines.overlap() > 0 && !lines.touching()))
        pairs.push_back({{a, b}, lines.same(), lines.overlap(), 0});
      else if (lines.overlap() == 0 && !lines.touching() && lines.gap() < cell)
        pairs.push_back({{a, b}, false, 0, lines.gap()});
    }
  return pairs;
}

void refuse_duplicates(const std::vector<PartPair>& pairs, const Surface& surface) {
  std::size_t count = 0;
  std::string names;
  for (const PartPair& pair : pairs) {
    if (!pair.same || ++count > 3) continue;
    names += fmt::format("{}\"{}\" and \"{}\"", names.empty() ? "" : ", ", surface.parts[pair.parts[0]].name,
                         surface.parts[pair.parts[1]].name);
  }
  if (count == 0) return;
  if (count > 3) names += fmt::format(" and {} pairs more", count - 3);
  throw InputError(
      fmt::format("parts {} are one body twice in one place{}, and would be twice as stiff and as heavy: "
                  "leave one of {} out "
                  "of the input",
                  names, count == 1 ? "" : ", pair by pair", count == 1 ? "them" : "each pair"));
}

}  // namespace flexel::voxelize
