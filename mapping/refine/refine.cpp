// In rounds: all triangles that changed are looked at, in parallel; those that miss too much are bisected, one after the
// other in their order. A bisection halves what an even bend misses, so there are about as many rounds as binary digits
// in the ratio of the first miss to the last.
#include "mapping/refine/refine.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <unordered_map>

#include "base/error.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/part/local_bisection.h"
#include "formats/part/subdivide.h"
#include "mapping/report/chord.h"

namespace flexel::mapping {
namespace {

class WhereCoarse {
 public:
  WhereCoarse(const Body& body, double largest_displacement)
      : body_(body), map_(body), bisection_(body.surface) {
    const double noise = kChordNoise * bounding_box(body.surface.vertices).size().norm();
    for (const Part& part : body.parts) {
      const double spacing = part.lattice.spacing.minCoeff();
      long_edge_.push_back(kLongEdge * spacing);
      most_.push_back(
          std::max(noise, std::min(kRefinedShare * largest_displacement, kRefinedSpacings * spacing)));
    }
  }

  RefinedWhereCoarse run(const MapResult& result) {
    std::vector<std::uint32_t> numbers;
    for (const LongTriangle& each : long_triangles(body_, result)) numbers.push_back(each.number);
    while (!numbers.empty()) {
      check_stop();
      for (const std::uint32_t t : too_flat(numbers)) {
        if (bisection_.count() >= kMostTriangles) return {bisection_.refinement(body_.surface), false};
        bisection_.bisect(t);
      }
      numbers.clear();
      for (const std::uint32_t t : bisection_.take_changed())
        if (bisection_.longest_edge(t) > long_edge_[part(t)]) numbers.push_back(t);
    }
    return {bisection_.refinement(body_.surface), true};
  }

 private:
  [[nodiscard]] std::uint32_t part(std::uint32_t t) const {
    return body_.surface.polygon_part(bisection_.polygon(t));
  }

  [[nodiscard]] std::vector<std::uint32_t> too_flat(const std::vector<std::uint32_t>& numbers) const {
    std::vector<FlatTriangle> flat;
    for (const std::uint32_t t : numbers) {
      const auto& [a, b, c] = bisection_.corners(t);
      flat.push_back({{bisection_.vertex(a), bisection_.vertex(b), bisection_.vertex(c)},
                      part(t),
                      bisection_.polygon(t),
                      bisection_.unshared(t)});
    }
    const std::vector<MissedPoint> missed = look_at(flat, body_, map_);
    std::vector<std::uint32_t> found;
    SpaceMap::Probe probe(map_);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if ((missed[i].largest > most_[flat[i].part] || missed[i].facing < kRefinedFacing) &&
          is_near(probe, flat[i]))
        found.push_back(numbers[i]);
    return found;
  }

  // Whether the middle of its longest edge is in or near the lattice.
  static bool is_near(SpaceMap::Probe& probe, const FlatTriangle& triangle) {
    const std::array<Vec3, 3>& at = triangle.corners;
    std::size_t longest = 0;
    const auto edge = [&](std::size_t i) { return (at.at((i + 1) % 3) - at.at(i)).squaredNorm(); };
    for (std::size_t i = 1; i < 3; ++i)
      if (edge(i) > edge(longest)) longest = i;
    const Vec3 middle = 0.5 * (at.at(longest) + at.at((longest + 1) % 3));
    return probe.place(middle, triangle.part, triangle.polygon).in_radius;
  }

  const Body& body_;
  SpaceMap map_;
  LocalBisection bisection_;
  std::vector<double> long_edge_, most_;  // (parts) m
};

// The cells that a polygon bounds, by voxel.
class CellsUnder {
 public:
  CellsUnder(const Body& body, std::size_t polygon)
      : body_(body),
        lattice_(body.parts[body.surface.polygon_part(polygon)].lattice),
        cells_(body.surface_cells.data() + body.surface_cell_offsets[polygon],
               body.surface_cell_offsets[polygon + 1] - body.surface_cell_offsets[polygon]) {
    for (const std::uint32_t cell : cells_) at_[key(voxel(cell))].push_back(cell);
  }

  // Those within a spacing of the box around the corners, ascending; all where there are none.
  void add_near(const Surface& surface, std::span<const std::uint32_t> corners,
                std::vector<std::uint32_t>& to) const {
    Box box;
    for (const std::uint32_t v : corners) box.add(lattice_.to_lattice(surface.vertices[v]));
    const Eigen::Vector3i low = (box.min.array() - 1).floor().cast<int>(),
                          high = (box.max.array() + 1).floor().cast<int>();
    const std::size_t begin = to.size();
    if ((high - low).cast<double>().array().operator+(1).prod() < static_cast<double>(cells_.size())) {
      for (int k = low.z(); k <= high.z(); ++k)
        for (int j = low.y(); j <= high.y(); ++j)
          for (int i = low.x(); i <= high.x(); ++i)
            if (const auto found = at_.find(key({i, j, k})); found != at_.end())
              to.insert(to.end(), found->second.begin(), found->second.end());
    } else {
      for (const std::uint32_t cell : cells_) {
        const Eigen::Array3i at = voxel(cell).array();
        if ((at >= low.array()).all() && (at <= high.array()).all()) to.push_back(cell);
      }
    }
    if (to.size() == begin) to.insert(to.end(), cells_.begin(), cells_.end());
    std::sort(to.begin() + static_cast<std::ptrdiff_t>(begin), to.end());
  }

 private:
  [[nodiscard]] Eigen::Vector3i voxel(std::uint32_t cell) const {
    const Index3& index = body_.lattice_index[body_.cell_elements[cell][0]];
    return {index[0], index[1], index[2]};
  }
  static std::uint64_t key(const Eigen::Vector3i& at) {
    constexpr std::uint64_t kBits = 21, kMask = (std::uint64_t{1} << kBits) - 1;
    std::uint64_t result = 0;
    for (const int i : at) result = result << kBits | (static_cast<std::uint64_t>(i) & kMask);
    return result;
  }

  const Body& body_;
  const Lattice& lattice_;
  std::span<const std::uint32_t> cells_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> at_;
};

}  // namespace

RefinedWhereCoarse refine_where_coarse(const Body& body, const MapResult& result,
                                       double largest_displacement) {
  return WhereCoarse(body, largest_displacement).run(result);
}

Refinement refine_to_edge(const Surface& surface, double edge) {
  const auto too_many = [&] {
    throw InputError(
        fmt::format("--refine: edges of at most {} would take more than {} triangles: give a larger length",
                    human_length(edge), kMostTriangles));
  };
  LocalBisection bisection(surface);
  // A triangle without an edge above L has at most the area of the equilateral one: a bound from below.
  double area = 0;
  for (std::uint32_t t = 0; t < bisection.count(); ++t) {
    const auto& [a, b, c] = bisection.corners(t);
    const Vec3 from = bisection.vertex(a);
    area += (bisection.vertex(b) - from).cross(bisection.vertex(c) - from).norm() / 2;
  }
  if (area > std::sqrt(3.0) / 4 * edge * edge * static_cast<double>(kMostTriangles)) too_many();
  for (std::uint32_t t = 0; t < bisection.count(); ++t)
    while (bisection.longest_edge(t) > edge && bisection.bisect(t))
      if (bisection.count() > kMostTriangles) too_many();
  return bisection.refinement(surface);
}

void take_refined(Body& body, Surface surface, const Refinement& refinement) {
  if (!body.surface_cell_offsets.empty()) {
    const std::vector<std::uint32_t> first = first_pieces(refinement);
    std::vector<std::uint32_t> offsets{0}, cells;
    for (std::size_t p = 0; p + 1 < first.size(); ++p) {
      if (first[p + 1] - first[p] == 1) {
        cells.insert(cells.end(), body.surface_cells.begin() + body.surface_cell_offsets[p],
                     body.surface_cells.begin() + body.surface_cell_offsets[p + 1]);
        offsets.push_back(static_cast<std::uint32_t>(cells.size()));
        continue;
      }
      const CellsUnder under(body, p);
      for (std::uint32_t piece = first[p]; piece < first[p + 1]; ++piece) {
        under.add_near(surface, surface.polygon(piece), cells);
        offsets.push_back(static_cast<std::uint32_t>(cells.size()));
      }
    }
    body.surface_cell_offsets = std::move(offsets);
    body.surface_cells = std::move(cells);
  }
  body.surface = std::move(surface);
}

}  // namespace flexel::mapping
