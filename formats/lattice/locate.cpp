// From a surface point to the cell under it. The cells that a polygon bounds are ascending and cells are
// sorted by (k, j, i), so the voxel that holds the point is found by bisection; next the voxels around it
// are tried, nearest first. A voxel beyond those is at least one spacing away, so only a point without a cell
// that close needs the scan over all cells of the polygon.
#include "formats/lattice/locate.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <tuple>
#include <utility>

namespace flexel {
namespace {

using Voxel = Eigen::Matrix<std::int64_t, 3, 1>;

const Index3& lowest_corner(const Body& body, std::uint32_t cell) {
  return body.lattice_index[body.cell_elements[cell][0]];
}

const Part& part_of_cell(const Body& body, std::uint32_t cell) {
  const auto after = std::upper_bound(body.parts.begin(), body.parts.end(), cell,
                                      [](std::uint32_t c, const Part& part) { return c < part.cell_end; });
  return *after;
}

// Squared distance [m^2] from a point, in lattice coordinates, to a voxel.
double squared_distance(const Vec3& at, const Voxel& voxel, const Vec3& spacing) {
  const Vec3 low = voxel.cast<double>();
  const Vec3 outside = (low - at).cwiseMax(at - low - Vec3::Ones()).cwiseMax(0.0);
  return outside.cwiseProduct(spacing).squaredNorm();
}

Voxel voxel_of(const Index3& index) {
  return {index[0], index[1], index[2]};
}

// The first of `cells` (ascending) at `voxel`, or nothing.
std::optional<std::uint32_t> cell_at(const Body& body, std::span<const std::uint32_t> cells,
                                     const Voxel& voxel) {
  const auto key = [](const Voxel& v) { return std::tuple(v[2], v[1], v[0]); };
  const auto found =
      std::lower_bound(cells.begin(), cells.end(), voxel, [&](std::uint32_t cell, const Voxel& wanted) {
        return key(voxel_of(lowest_corner(body, cell))) < key(wanted);
      });
  if (found == cells.end() || voxel_of(lowest_corner(body, *found)) != voxel) return std::nullopt;
  return *found;
}

// The nearest of `cells` among the voxels about `home`, no further than `most` [m] from `at`; of those at
// equal distance the first in the order (k, j, i).
std::optional<std::uint32_t> nearest_around(const Body& body, std::span<const std::uint32_t> cells,
                                            const Voxel& home, const Vec3& at, const Vec3& spacing,
                                            double most) {
  std::array<std::array<double, 3>, 3> term;  // of the squared distance: axis, voxel before, at, after
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double inside = at[a] - static_cast<double>(home[a]);
    term[axis] = {inside * spacing[a], 0, (1 - inside) * spacing[a]};
    for (double& each : term[axis]) each *= each;
  }
  std::array<double, 27> squared;
  for (std::size_t n = 0; n < 27; ++n) squared[n] = term[0][n % 3] + term[1][n / 3 % 3] + term[2][n / 9];
  for (;;) {
    const auto nearest = std::min_element(squared.begin(), squared.end());
    if (*nearest > most * most) return std::nullopt;
    const auto n = nearest - squared.begin();
    if (const auto cell = cell_at(body, cells, home + Voxel(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)))
      return *cell;
    *nearest = std::numeric_limits<double>::infinity();
  }
}

// Trilinear weights in `cell` of a point in lattice coordinates.
CellPoint weights_in(const Body& body, std::uint32_t cell, const Vec3& at) {
  const Vec3 inside = at - voxel_of(lowest_corner(body, cell)).cast<double>();
  CellPoint result;
  result.cell = cell;
  for (int a = 0; a < 8; ++a) {
    const double x = (a & 1) != 0 ? inside.x() : 1 - inside.x();
    const double y = (a & 2) != 0 ? inside.y() : 1 - inside.y();
    const double z = (a & 4) != 0 ? inside.z() : 1 - inside.z();
    result.weights[a] = x * y * z;
  }
  return result;
}

}  // namespace

CellPoint cell_point(const Body& body, std::uint32_t cell, const Vec3& point) {
  return weights_in(body, cell, part_of_cell(body, cell).lattice.to_lattice(point));
}

bool is_near(const Body& body, const CellPoint& at) {
  Vec3 inside = Vec3::Zero();  // coordinates in the cell
  for (std::size_t a = 0; a < 8; ++a)
    for (int axis = 0; axis < 3; ++axis)
      if (a >> axis & 1u) inside[axis] += at.weights[a];
  const Vec3& spacing = part_of_cell(body, at.cell).lattice.spacing;
  const Vec3 outside = (inside - Vec3::Ones()).cwiseMax(-inside).cwiseMax(0.0);
  return outside.cwiseProduct(spacing).norm() <= spacing.minCoeff();
}

SurfaceLocator::SurfaceLocator(const Body& body, std::size_t polygon) : body_(body) {
  if (polygon + 1 >= body.surface_cell_offsets.size()) return;
  const std::uint32_t begin = body.surface_cell_offsets[polygon],
                      end = body.surface_cell_offsets[polygon + 1];
  cells_ = std::span(body.surface_cells.data() + begin, end - begin);
  if (!cells_.empty()) lattice_ = &part_of_cell(body, cells_.front()).lattice;
}

// Usually the point lies in one of the first voxels tried, or on its face, and the next point in the same
// voxel.
std::uint32_t SurfaceLocator::nearest_cell(const Vec3& at) {
  const Voxel home = at.array().floor().matrix().cast<std::int64_t>();
  std::array<int, 3> first{};  // 0, or -1 on a face
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    first[axis] = at[a] == static_cast<double>(home[a]) ? -1 : 0;
  }
  if (last_ && home == last_home_ && first == last_first_) return *last_;
  for (int k = first[2]; k <= 0; ++k)
    for (int j = first[1]; j <= 0; ++j)
      for (int i = first[0]; i <= 0; ++i)
        if (const auto cell = cell_at(body_, cells_, home + Voxel(i, j, k))) {
          last_ = cell;
          last_home_ = home;
          last_first_ = first;
          return *cell;
        }
  const Vec3& spacing = lattice_->spacing;
  if (const auto cell = nearest_around(body_, cells_, home, at, spacing, spacing.minCoeff())) return *cell;
  return *std::min_element(cells_.begin(), cells_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return squared_distance(at, voxel_of(lowest_corner(body_, a)), spacing) <
           squared_distance(at, voxel_of(lowest_corner(body_, b)), spacing);
  });
}

std::optional<CellPoint> SurfaceLocator::operator()(const Vec3& point) {
  if (cells_.empty()) return std::nullopt;
  const Vec3 at = lattice_->to_lattice(point);
  return weights_in(body_, nearest_cell(at), at);
}

std::optional<CellPoint> locate_on_surface(const Body& body, std::size_t polygon, const Vec3& point) {
  return SurfaceLocator(body, polygon)(point);
}

namespace {

constexpr double kSameDistance = 1e-6;  // spacings: distances that differ by rounding

bool is_left_out(std::span<const std::uint8_t> left_out, std::uint32_t owner) {
  return owner < left_out.size() && left_out[owner] != 0;
}

std::pair<std::uint32_t, std::uint32_t> owners_of(const Part& part) {
  return part.placement == Placement::corner ? std::pair(part.cell_begin, part.cell_end)
                                             : std::pair(part.element_begin, part.element_end);
}

std::tuple<std::int64_t, std::int64_t, std::int64_t> order_of(const Index3& index) {
  return {index[2], index[1], index[0]};
}

double same_in(const Part& part) {
  return kSameDistance * part.lattice.spacing.maxCoeff();
}

}  // namespace

PointHomes::PointHomes(const Body& body, std::span<const std::uint8_t> left_out_cells,
                       std::span<const std::uint8_t> left_out_elements, std::size_t points)
    : body_(body),
      left_out_cells_(left_out_cells),
      left_out_elements_(left_out_elements),
      polygons_(body.surface, points),
      at_surface_(body.cell_count()) {
  for (const std::uint32_t cell : body.surface_cells) at_surface_[cell] = 1;
  for (const Part& part : body.parts) {
    const auto [begin, end] = owners_of(part);
    bool ascend = true;
    for (std::uint32_t i = begin + 1; i < end && ascend; ++i)
      ascend = order_of(voxel(part, i - 1)) <= order_of(voxel(part, i));
    sorted_.push_back(ascend);
  }
}

const Index3& PointHomes::voxel(const Part& part, std::uint32_t owner) const {
  return part.placement == Placement::corner ? lowest_corner(body_, owner) : body_.lattice_index[owner];
}

// Owners within rounding of the nearest are kept.
void PointHomes::consider(const Part& part, std::uint32_t owner, const Vec3& point, Nearest& nearest) const {
  const bool cell = part.placement == Placement::corner;
  if (is_left_out(cell ? left_out_cells_ : left_out_elements_, owner)) return;
  const double distance = std::sqrt(
      squared_distance(part.lattice.to_lattice(point), voxel_of(voxel(part, owner)), part.lattice.spacing));
  if (distance > nearest.distance + same_in(part)) return;
  if (distance < nearest.distance - same_in(part)) nearest.owners.clear();
  nearest.distance = std::min(nearest.distance, distance);
  nearest.owners.push_back(owner);
}

PointHomes::Nearest PointHomes::all_voxels(const Part& part, const Vec3& point) const {
  Nearest nearest{std::numeric_limits<double>::infinity(), {}};
  const auto [begin, end] = owners_of(part);
  for (std::uint32_t i = begin; i < end; ++i) consider(part, i, point, nearest);
  return nearest;
}

// Those of the 27 about the point; a voxel beyond them is further than a spacing away.
PointHomes::Nearest PointHomes::near_voxels(const Part& part, const Vec3& point) const {
  const Nearest none{std::numeric_limits<double>::infinity(), {}};
  if (sorted_[static_cast<std::size_t>(&part - body_.parts.data())] == 0) {
    Nearest nearest = all_voxels(part, point);
    return nearest.distance <= part.lattice.spacing.minCoeff() ? nearest : none;
  }
  Nearest nearest{part.lattice.spacing.minCoeff(), {}};
  const auto [begin, end] = owners_of(part);
  const Vec3 at = part.lattice.to_lattice(point).array().floor();
  if (!(at.cwiseAbs().maxCoeff() < 1e9)) return none;
  for (int n = 0; n < 27; ++n) {
    const Index3 wanted = {static_cast<std::int32_t>(at[0]) + n % 3 - 1,
                           static_cast<std::int32_t>(at[1]) + n / 3 % 3 - 1,
                           static_cast<std::int32_t>(at[2]) + n / 9 - 1};
    std::uint32_t low = begin, high = end;  // the first at that voxel
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if (order_of(voxel(part, middle)) < order_of(wanted))
        low = middle + 1;
      else
        high = middle;
    }
    for (; low < end && voxel(part, low) == wanted; ++low) consider(part, low, point, nearest);
  }
  if (nearest.owners.empty()) return none;
  std::sort(nearest.owners.begin(), nearest.owners.end());
  return nearest;
}

bool PointHomes::has_matter(std::uint32_t polygon) const {
  const std::uint32_t part = body_.surface.polygon_part(polygon);
  if (body_.parts[part].placement == Placement::centre || body_.surface_cell_offsets.empty()) return true;
  return body_.surface_cell_offsets[polygon] < body_.surface_cell_offsets[polygon + 1];
}

// The part whose voxels are nearest; of several the one whose surface is. A part of which too little is here for a voxel
// has the point where its surface is nearer than theirs, and the point on its inner side and on their outer side.
std::uint32_t PointHomes::part_of(const std::vector<Nearest>& nearest, const Vec3& point) const {
  const auto least = std::min_element(nearest.begin(), nearest.end(), [](const Nearest& a, const Nearest& b) {
    return a.distance < b.distance;
  });
  const auto first = static_cast<std::uint32_t>(least - nearest.begin());
  if (body_.parts.size() == 1) return first;
  const double same = same_in(body_.parts[first]);
  const auto as_near = [&](std::uint32_t part) { return nearest[part].distance <= least->distance + same; };
  const auto polygon = polygons_.find(point, same, [&](std::uint32_t each) {
    return as_near(body_.surface.polygon_part(each)) && has_matter(each);
  });
  if (!polygon) return first;
  const std::uint32_t found = body_.surface.polygon_part(polygon->polygon);
  if (!polygon->outside) return found;
  const auto other = polygons_.find(point, same, [&](std::uint32_t each) { return has_matter(each); });
  const std::uint32_t sliver = body_.surface.polygon_part(other->polygon);
  const bool near = nearest[sliver].distance <= body_.parts[sliver].lattice.spacing.maxCoeff();
  return near && !other->outside && other->distance < polygon->distance - same ? sliver : found;
}

// Of these cells (ascending), those that the polygon bounds.
std::vector<std::uint32_t> PointHomes::bounded(std::uint32_t polygon,
                                               const std::vector<std::uint32_t>& cells) const {
  std::vector<std::uint32_t> both;
  if (body_.surface_cell_offsets.empty()) return both;
  const auto begin = body_.surface_cells.begin();
  std::set_intersection(cells.begin(), cells.end(), begin + body_.surface_cell_offsets[polygon],
                        begin + body_.surface_cell_offsets[polygon + 1], std::back_inserter(both));
  return both;
}

// The cell of a polygon that stands in where the point's voxels have none for the matter under it: within two voxels.
std::optional<std::uint32_t> PointHomes::stand_in(const Part& part, const Nearest& nearest,
                                                  const NearPolygon& under) const {
  constexpr int kReach = 2;
  if (under.outside || !bounded(under.polygon, nearest.owners).empty()) return std::nullopt;
  const Voxel home = voxel_of(voxel(part, nearest.owners.front()));
  const double beyond = squared_distance(part.lattice.to_lattice(under.at), home, part.lattice.spacing);
  if (!(beyond <= same_in(part) * same_in(part))) return std::nullopt;
  const auto cell = locate_on_surface(body_, under.polygon, under.at);
  if (!cell || is_left_out(left_out_cells_, cell->cell)) return std::nullopt;
  const Voxel apart = voxel_of(lowest_corner(body_, cell->cell)) - home;
  return apart.cwiseAbs().maxCoeff() <= kReach ? std::optional(cell->cell) : std::nullopt;
}

std::uint32_t PointHomes::cell_of(const Part& part, const Nearest& nearest, const Vec3& point) const {
  const std::vector<std::uint32_t>& cells = nearest.owners;
  const auto part_number = static_cast<std::uint32_t>(&part - body_.parts.data());
  const auto under = polygons_.find(point, same_in(part), [&](std::uint32_t each) {
    return body_.surface.polygon_part(each) == part_number && has_matter(each);
  });
  if (under)
    if (const auto cell = stand_in(part, nearest, *under)) return *cell;
  // Of cells inside, as around a point on the lattice's planes, no polygon would be found among all.
  if (cells.size() == 1 ||
      std::none_of(cells.begin(), cells.end(), [&](std::uint32_t cell) { return at_surface_[cell] != 0; }))
    return cells.front();
  // Two pieces of one voxel that a polygon bounds are not told apart by it.
  const auto distinct = [&](std::uint32_t polygon) -> std::optional<std::uint32_t> {
    std::optional<std::uint32_t> last;
    for (const std::uint32_t cell : bounded(polygon, cells)) {
      if (last && voxel(part, *last) == voxel(part, cell)) return std::nullopt;
      last = cell;
    }
    return last;
  };
  const auto bounding =
      polygons_.find(point, same_in(part), [&](std::uint32_t each) { return distinct(each).has_value(); });
  return bounding ? *distinct(bounding->polygon) : cells.front();
}

PointHome PointHomes::choose(const std::vector<Nearest>& nearest, const Vec3& point) const {
  PointHome home;
  home.part = part_of(nearest, point);
  const Part& part = body_.parts[home.part];
  home.distance = nearest[home.part].distance;
  if (part.placement == Placement::corner && !nearest[home.part].owners.empty())
    home.cell = cell_of(part, nearest[home.part], point);
  return home;
}

PointHome PointHomes::find(const Vec3& point) const {
  if (const auto home = find_near(point)) return *home;
  std::vector<Nearest> nearest;
  for (const Part& part : body_.parts) nearest.push_back(all_voxels(part, point));
  return choose(nearest, point);
}

std::optional<PointHome> PointHomes::find_near(const Vec3& point) const {
  std::vector<Nearest> nearest;
  bool any = false;
  for (const Part& part : body_.parts) {
    nearest.push_back(near_voxels(part, point));
    any = any || !nearest.back().owners.empty();
  }
  return any ? std::optional(choose(nearest, point)) : std::nullopt;
}

Vec3 interpolate(const CellPoint& at, const Body& body, const std::vector<Vec3>& element_values) {
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a < 8; ++a) sum += at.weights[a] * element_values[body.cell_elements[at.cell][a]];
  return sum;
}

}  // namespace flexel
