// Elements on the outside of one part look for the nearest point of a cell of another: candidates by a grid
// of cell centres, the point by Newton on the trilinear map of the cell as it is now.
#include "simulate/events/fuse.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "base/error.h"
#include "base/stop.h"
#include "base/units.h"
#include "simulate/matter/interpolation_weights.h"
#include "simulate/models/cells.h"
#include "simulate/models/rest_shape.h"
#include "simulate/models/set_rest_shape.h"

namespace flexel::simulate {
namespace {

std::array<double, 8> trilinear(const Vec3& at) {
  std::array<double, 8> weights;
  for (std::size_t a = 0; a < 8; ++a) {
    weights[a] = 1;
    for (Eigen::Index j = 0; j < 3; ++j) weights[a] *= a >> j & 1 ? at[j] : 1 - at[j];
  }
  return weights;
}

Vec3 point_of(const CellVectors& x, const Vec3& at) {
  const std::array<double, 8> weights = trilinear(at);
  Vec3 point = Vec3::Zero();
  for (std::size_t a = 0; a < 8; ++a) point += weights[a] * x[a];
  return point;
}

Mat3 edges_of(const CellVectors& x, const Vec3& at) {
  Mat3 edges = Mat3::Zero();
  for (Eigen::Index j = 0; j < 3; ++j) {
    Vec3 low = at, high = at;
    low[j] = 0;
    high[j] = 1;
    edges.col(j) = point_of(x, high) - point_of(x, low);
  }
  return edges;
}

// Coordinates of `point` in a deformed cell, outside [0, 1] where it lies outside; nothing where Newton does
// not get there.
std::optional<Vec3> coordinates(const CellVectors& x, const Vec3& point) {
  Vec3 at = Vec3::Constant(0.5);
  for (int i = 0; i < 20; ++i) {
    const Mat3 edges = edges_of(x, at);
    if (!(edges.determinant() > 0)) return std::nullopt;
    const Vec3 change = edges.inverse() * (point - point_of(x, at));
    at += change;
    if (!(at.cwiseAbs().maxCoeff() < 3)) return std::nullopt;
    if (change.norm() < 1e-12) return at;
  }
  return std::nullopt;
}

using Bucket = std::array<std::int64_t, 3>;
struct BucketHash {
  std::size_t operator()(const Bucket& at) const {
    return static_cast<std::size_t>(at[0] * 73856093 ^ at[1] * 19349663 ^ at[2] * 83492791);
  }
};

// Cells by their centres.
class CellGrid {
 public:
  CellGrid(const Body& body, const std::vector<Vec3>& now, const std::vector<std::uint8_t>& cells,
           double width)
      : width_(width) {
    for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
      if (!cells[c] || body.broken[c]) continue;
      Vec3 centre = Vec3::Zero();
      for (const std::uint32_t e : body.cell_elements[c]) centre += now[e] / 8;
      buckets_[bucket(centre)].push_back(c);
    }
  }
  template <class Visit>
  void near(const Vec3& point, const Visit& visit) const {
    const Bucket home = bucket(point);
    for (std::int64_t k = -1; k <= 1; ++k)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t i = -1; i <= 1; ++i)
          if (const auto found = buckets_.find({home[0] + i, home[1] + j, home[2] + k});
              found != buckets_.end())
            for (const std::uint32_t c : found->second) visit(c);
  }

 private:
  [[nodiscard]] Bucket bucket(const Vec3& at) const {
    return {std::llround(std::floor(at.x() / width_)), std::llround(std::floor(at.y() / width_)),
            std::llround(std::floor(at.z() / width_))};
  }
  double width_;
  std::unordered_map<Bucket, std::vector<std::uint32_t>, BucketHash> buckets_;
};

// E h of a part [N/m].
double stiffness_of(const Problem& problem, std::uint32_t part) {
  return problem.materials[part].young * problem.body.parts[part].lattice.spacing.mean();
}

// Elements at the centres of voxels: a connection for every two of different parts that are near, its length what it is
// now, k = E l with the mean of both E, edits' factors among them (Jansson and Vergeest, section 3.2 and equation 22).
std::size_t connect_elements(EventContext& context, const Chosen& chosen, const std::vector<Vec3>& now,
                             double within) {
  const Body& body = context.body;
  std::vector<std::pair<Bucket, std::uint32_t>> sorted;  // by cubes of the distance
  const auto bucket = [&](const Vec3& at) {
    return Bucket{std::llround(std::floor(at.x() / within)), std::llround(std::floor(at.y() / within)),
                  std::llround(std::floor(at.z() / within))};
  };
  for (const Part& part : body.parts)
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      if (part.placement == Placement::centre && chosen.elements[e]) sorted.emplace_back(bucket(now[e]), e);
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  const std::vector<std::uint32_t> part = element_parts(body);
  for (const auto& [home, a] : sorted)
    for (std::int64_t n = 0; n < 27; ++n) {
      const Bucket at{home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1};
      for (auto other = std::lower_bound(sorted.begin(), sorted.end(), std::pair{at, 0u});
           other != sorted.end() && other->first == at; ++other)
        if (const std::uint32_t b = other->second;
            a < b && part[a] != part[b] && (now[b] - now[a]).norm() <= within)
          pairs.emplace_back(a, b);
    }
  std::sort(pairs.begin(), pairs.end());
  const std::vector<double> factors = element_factors(body, "stiffness_change");
  const auto young_of = [&](std::uint32_t e) {
    return context.problem.materials[part[e]].young * (factors.empty() ? 1 : factors[e]);
  };
  for (const auto& [a, b] : pairs) {
    const double length = (now[b] - now[a]).norm();
    const double young = 0.5 * (young_of(a) + young_of(b));
    if (length > 0) context.fused.push_back({{a, b}, {1, -1}, young * length, length});
  }
  return pairs.size();
}

// What was fused before is not fused again.
void drop_repeated(std::vector<FusedPoint>& fused, std::size_t before) {
  std::set<std::vector<std::uint32_t>> known;
  for (std::size_t i = 0; i < before; ++i) known.insert(fused[i].elements);
  fused.erase(std::remove_if(fused.begin() + static_cast<std::ptrdiff_t>(before), fused.end(),
                             [&](const FusedPoint& point) { return known.contains(point.elements); }),
              fused.end());
}

using ElementAndPart = std::pair<std::uint32_t, std::uint32_t>;

// Elements that are fused to a cell, and the part of that: once more, to a cell beside it, would be twice as stiff.
std::set<ElementAndPart> fused_to_cells(const std::vector<FusedPoint>& fused,
                                        const std::vector<std::uint32_t>& part_of) {
  std::set<ElementAndPart> known;
  for (const FusedPoint& point : fused)
    if (point.elements.size() > 2) known.insert({point.elements[0], part_of[point.elements[1]]});
  return known;
}

std::size_t fuse_parts(EventContext& context, const Chosen& chosen, const std::vector<Vec3>& now,
                       double within) {
  const Body& body = context.body;
  double width = within;
  for (const Part& part : body.parts) width = std::max(width, part.lattice.spacing.maxCoeff());
  width = 2 * width;
  const CellGrid grid(body, now, chosen.cells, width);
  const std::vector<std::uint32_t> part_of = element_parts(body), part_of_cell = cell_parts(body);
  std::vector<int> cells_at(body.element_count(), 0);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    if (!body.broken[c])
      for (const std::uint32_t e : body.cell_elements[c]) ++cells_at[e];
  const std::size_t before = context.fused.size();
  const std::set<ElementAndPart> known = fused_to_cells(context.fused, part_of);
  const ChangeAround stiffer(body, "stiffness_change");
  std::size_t found = 0;
  for (std::uint32_t e = 0; e < body.element_count(); ++e) {
    if (e % 256 == 0) check_stop();
    const bool is_centre = body.parts[part_of[e]].placement == Placement::centre;
    // inner ones touch nothing
    if (!chosen.elements[e] || (!is_centre && cells_at[e] == 0) || cells_at[e] == 8) continue;
    double nearest = within;
    std::optional<FusedPoint> best;
    grid.near(now[e], [&](std::uint32_t c) {
      if (part_of_cell[c] == part_of[e]) return;
      CellVectors x;
      for (std::size_t a = 0; a < 8; ++a) x[a] = now[body.cell_elements[c][a]];
      const std::optional<Vec3> at = coordinates(x, now[e]);
      if (!at) return;
      const double gap = (now[e] - point_of(x, at->cwiseMax(0).cwiseMin(1))).norm();
      if (!(gap <= nearest) || (best && gap == nearest)) return;
      nearest = gap;
      const std::array<double, 8> weights = trilinear(*at);
      best = FusedPoint{{e},
                        {1},
                        std::min(stiffer.of(e) * stiffness_of(context.problem, part_of[e]),
                                 stiffer.at({body.cell_elements[c], weights, 8}) *
                                     stiffness_of(context.problem, part_of_cell[c]))};
      for (std::size_t a = 0; a < 8; ++a) {
        best->elements.push_back(body.cell_elements[c][a]);
        best->weights.push_back(-weights[a]);
      }
    });
    if (!best) continue;
    ++found;
    if (!known.contains({e, part_of[best->elements[1]]})) context.fused.push_back(std::move(*best));
  }
  found += connect_elements(context, chosen, now, within);
  drop_repeated(context.fused, before);
  return found;
}

// Whether a broken cell has its shape back: every edge within `within` of its length at rest, not inside out.
bool is_whole(const Body& body, std::uint32_t cell, const std::vector<Vec3>& now, double within) {
  const auto& corners = body.cell_elements[cell];
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t b = a | std::size_t{1} << axis;
      if (b == a) continue;
      const double rest = (body.rest[corners[b]] - body.rest[corners[a]]).norm();
      if (!(std::abs((now[corners[b]] - now[corners[a]]).norm() - rest) <= std::min(within, 0.5 * rest)))
        return false;
    }
  CellVectors x;
  for (std::size_t a = 0; a < 8; ++a) x[a] = now[corners[a]];
  return edges_of(x, Vec3::Constant(0.5)).determinant() *
             edges_of(
                 {body.rest[corners[0]], body.rest[corners[1]], body.rest[corners[2]], body.rest[corners[3]],
                  body.rest[corners[4]], body.rest[corners[5]], body.rest[corners[6]], body.rest[corners[7]]},
                 Vec3::Constant(0.5))
                 .determinant() >
         0;
}

std::size_t heal(EventContext& context, const Chosen& chosen, const std::vector<Vec3>& now, double within) {
  Body& body = context.body;
  std::vector<std::uint8_t> healed(body.cell_count(), 0);
  std::size_t count = 0;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (body.broken[c] && chosen.cells[c] && is_whole(body, c, now, within)) {
      body.broken[c] = 0;
      healed[c] = 1;
      ++count;
    }
  if (count == 0) return 0;
  if (const auto found = body.cell_columns.find("broken_springs"); found != body.cell_columns.end())
    for (std::size_t c = 0; c < healed.size(); ++c)
      if (healed[c]) found->second.values[c] = 0;
  const std::vector<Vec3> settled = settled_displacement(body);
  renormalise(body, context.problem, context.state.displacement, healed,
              std::vector<std::uint8_t>(body.element_count(), 0));
  if (settled.empty()) body.element_columns.erase("settled");  // fixes are not led by what was healed
  derive_connections(body);
  return count;
}

}  // namespace

Fuse Fuse::parse(TableReader& reader) {
  Fuse made;
  made.origin_ = reader.place();
  made.within_ = reader.to_quantity(reader.require("within", "\"0.5 mm\""), Dimension::length, "within");
  if (!(made.within_ > 0)) reader.fail("\"within\" needs to be above 0");
  made.region_ = parse_region(reader);
  return made;
}

std::string Fuse::apply(EventContext& context) const {
  const Chosen chosen = choose(region_, context.body, context.state);
  std::vector<Vec3> now(context.body.element_count());
  for (std::size_t e = 0; e < now.size(); ++e) now[e] = context.body.rest[e] + context.state.displacement[e];
  const std::size_t points = fuse_parts(context, chosen, now, within_);
  const std::size_t cells = heal(context, chosen, now, within_);
  if (points + cells == 0)
    throw EmptySelectionError(
        origin_,
        fmt::format("fuse: in {} nothing of one part is within {} of another (at centre placement from "
                    "element to element), and no broken cell is nearly whole",
                    describe(region_), human_length(within_)));
  return fmt::format("{} points of parts fused, {} broken cells whole again", points, cells);
}

}  // namespace flexel::simulate
