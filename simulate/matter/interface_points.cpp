// Only polygons near the box of another part are looked at. The coarser part's surface is cut into pieces
// too; their centroids, in a grid of half a spacing, tell which of its polygons can be near a point of the
// finer one; the distance is then taken from the polygons' triangles themselves.
#include "simulate/matter/interface_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <unordered_map>

#include "base/math/distance.h"
#include "base/parallel.h"
#include "simulate/matter/surface_points.h"

namespace flexel::simulate {
namespace {

constexpr double kOfDiagonal = 1e-6, kOfSpacing = 1e-2;
constexpr double kFacing = -0.7;  // cosine between the normals

bool overlap(const Box& a, const Box& b, double margin) {
  return (a.min.array() <= b.max.array() + margin).all() && (b.min.array() <= a.max.array() + margin).all();
}

Box polygon_box(const Surface& surface, std::size_t polygon) {
  Box box;
  for (const std::uint32_t vertex : surface.polygon(polygon)) box.add(surface.vertices[vertex]);
  return box;
}

bool box_holds(const Box& box, const Vec3& point, double margin) {
  return (point.array() >= box.min.array() - margin).all() &&
         (point.array() <= box.max.array() + margin).all();
}

// A point of a surface (surface_points()); what carries it is found again where it touches.
struct Sample {
  Vec3 position, area_vector;
  std::uint32_t polygon;
};

// A polygon of the coarser part, with the normal of its first sample point.
struct Facing {
  std::uint32_t polygon = 0;
  Vec3 normal = Vec3::Zero();
  Box box;
};

// Polygons by the cubes of a grid in which they have sample points.
class Grid {
 public:
  explicit Grid(double width) : width_(width) {}
  void add(const Vec3& point, std::uint32_t polygon) {
    std::vector<std::uint32_t>& polygons = cubes_[key(cube(point))];
    if (polygons.empty() || polygons.back() != polygon) polygons.push_back(polygon);
  }
  using Cube = std::array<std::int64_t, 3>;
  [[nodiscard]] Cube cube(const Vec3& point) const {
    Cube result;
    for (int axis = 0; axis < 3; ++axis)
      result[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::floor(point[axis] / width_));
    return result;
  }
  [[nodiscard]] Box box(const Cube& cube) const {
    Box result;
    result.min = width_ * Vec3(static_cast<double>(cube[0]), static_cast<double>(cube[1]),
                               static_cast<double>(cube[2]));
    result.max = result.min + Vec3::Constant(width_);
    return result;
  }
  // Those with a sample in a cube or one around it that are wanted, each once.
  template <class Wanted>
  void find(const Cube& middle, std::vector<std::uint32_t>& polygons, const Wanted& wanted) const {
    polygons.clear();
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto found =
          cubes_.find(key({middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1}));
      if (found != cubes_.end())
        std::copy_if(found->second.begin(), found->second.end(), std::back_inserter(polygons), wanted);
    }
    std::sort(polygons.begin(), polygons.end());
    polygons.erase(std::unique(polygons.begin(), polygons.end()), polygons.end());
  }

 private:
  static std::uint64_t key(const Cube& cube) {
    std::uint64_t hash = 0;
    for (const std::int64_t each : cube)
      hash = (hash ^ static_cast<std::uint64_t>(each)) * 0x9e3779b97f4a7c15u;
    return hash;
  }
  double width_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cubes_;
};

// What a grid finds around points, of which many that follow each other lie in one cube: the polygons
// within `limit` of the cube, by their boxes. In fine meshes they are a few of the hundreds around it.
class Nearby {
 public:
  Nearby(const Grid& grid, const std::vector<Facing>& facing, double limit)
      : grid_(grid), facing_(facing), limit_(limit) {}
  const std::vector<std::uint32_t>& operator()(const Vec3& point) {
    if (const Grid::Cube cube = grid_.cube(point); cube != cube_) {
      cube_ = cube;
      grid_.find(*cube_, found_,
                 [&](std::uint32_t n) { return overlap(facing_[n].box, grid_.box(cube), limit_); });
    }
    return found_;
  }

 private:
  const Grid& grid_;
  const std::vector<Facing>& facing_;
  double limit_;
  std::optional<Grid::Cube> cube_;
  std::vector<std::uint32_t> found_;
};

class TouchingSearch {
 public:
  using Use = std::function<void(const TouchingPoint&)>;
  TouchingSearch(const Problem& problem, const std::vector<TouchingGap>& wider);
  void operator()(const Use& use);

 private:
  [[nodiscard]] double tolerance(std::uint32_t part) const {
    return touching_distance(diagonal_, body_.parts[part].lattice.spacing.minCoeff());
  }
  [[nodiscard]] double wider_gap(std::uint32_t a, std::uint32_t b) const {
    double gap = 0;
    for (const TouchingGap& each : wider_)
      if (each.parts == std::array{std::min(a, b), std::max(a, b)}) gap = std::max(gap, each.gap);
    return gap;
  }
  [[nodiscard]] double margin(std::uint32_t a, std::uint32_t b) const {
    return std::max({tolerance(a), tolerance(b), wider_gap(a, b)});
  }
  void sample(std::uint32_t part);
  [[nodiscard]] bool is_near_another(std::uint32_t part, const Vec3& point) const;
  [[nodiscard]] const Facing* nearest(const Sample& point, double limit, const std::vector<Facing>& facing,
                                      const std::vector<std::uint32_t>& near) const;
  void touch(std::uint32_t finer, std::uint32_t coarser, const Use& use) const;
  [[nodiscard]] double distance(const Vec3& point, std::uint32_t polygon) const;

  const Problem& problem_;
  const Body& body_;
  const std::vector<TouchingGap>& wider_;
  double diagonal_ = 0;
  Triangles triangles_;
  std::vector<std::uint32_t> first_triangle_;  // (polygons + 1)
  std::vector<Box> box_;                       // (parts)
  std::vector<std::vector<Sample>> points_;    // (parts) near another part
};

TouchingSearch::TouchingSearch(const Problem& problem, const std::vector<TouchingGap>& wider)
    : problem_(problem),
      body_(problem.body),
      wider_(wider),
      diagonal_(bounding_box(problem.body.surface.vertices).diagonal()) {
  const Surface& surface = body_.surface;
  box_.resize(body_.parts.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (const std::uint32_t vertex : surface.polygon(p))
      box_[surface.polygon_part(p)].add(surface.vertices[vertex]);
  triangles_ = triangulate(surface);
  first_triangle_.assign(surface.polygon_count() + 1, 0);
  for (const std::uint32_t polygon : triangles_.polygon) ++first_triangle_[polygon + 1];
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) first_triangle_[p + 1] += first_triangle_[p];
  points_.resize(body_.parts.size());
  for (std::uint32_t part = 0; part < body_.parts.size(); ++part) sample(part);
}

void TouchingSearch::sample(std::uint32_t part) {
  std::vector<std::uint32_t> polygons;
  for (std::uint32_t p = 0; p < body_.surface.polygon_count(); ++p) {
    if (body_.surface.polygon_part(p) != part) continue;
    const Box box = polygon_box(body_.surface, p);
    for (std::uint32_t other = 0; other < body_.parts.size(); ++other)
      if (other != part && overlap(box, box_[other], margin(part, other))) {
        polygons.push_back(p);
        break;
      }
  }
  // Some polygons at a time, and of their points only what is near another part, without the 100 bytes of
  // their carriers: around the bolts of a frame there are hundreds of thousands, and few of them touch.
  constexpr std::size_t kAtATime = 16384;
  std::vector<Sample>& kept = points_[part];
  std::vector<std::uint32_t> triangles;
  for (std::size_t begin = 0; begin < polygons.size(); begin += kAtATime) {
    triangles.clear();
    for (std::size_t i = begin; i < std::min(begin + kAtATime, polygons.size()); ++i)
      for (std::uint32_t t = first_triangle_[polygons[i]]; t < first_triangle_[polygons[i] + 1]; ++t)
        triangles.push_back(t);
    for (const SurfacePoint& point : surface_points(problem_, triangles_, triangles))
      if (is_near_another(part, point.position))
        kept.push_back({point.position, point.area_vector, point.polygon});
  }
  kept.shrink_to_fit();
}

// As far as touch() looks: by its limit, and in the coarser part by two widths of its grid.
bool TouchingSearch::is_near_another(std::uint32_t part, const Vec3& point) const {
  const double spacing = body_.parts[part].lattice.spacing.minCoeff();
  for (std::uint32_t other = 0; other < body_.parts.size(); ++other)
    if (other != part && box_holds(box_[other], point, std::max(margin(part, other), spacing))) return true;
  return false;
}

double TouchingSearch::distance(const Vec3& point, std::uint32_t polygon) const {
  double least = 1e300;
  for (std::uint32_t t = first_triangle_[polygon]; t < first_triangle_[polygon + 1]; ++t) {
    const auto& corners = triangles_.corners[t];
    least = std::min(
        least, distance_to_triangle(point, body_.surface.vertices[corners[0]],
                                    body_.surface.vertices[corners[1]], body_.surface.vertices[corners[2]]));
  }
  return least;
}

// Of `near`, numbers in `facing`; null: none within the limit.
const Facing* TouchingSearch::nearest(const Sample& point, double limit, const std::vector<Facing>& facing,
                                      const std::vector<std::uint32_t>& near) const {
  const Vec3 own = point.area_vector.normalized();
  double least = limit;
  const Facing* nearest = nullptr;
  for (const std::uint32_t n : near) {
    const Facing& other = facing[n];
    if (own.dot(other.normal) > kFacing || !box_holds(other.box, point.position, limit)) continue;
    const double away = distance(point.position, other.polygon);
    if (away > least || (nearest && away == least && other.polygon >= nearest->polygon)) continue;
    least = away;
    nearest = &other;
  }
  return nearest;
}

void TouchingSearch::touch(std::uint32_t finer, std::uint32_t coarser, const Use& use) const {
  const double limit = std::max(tolerance(finer), wider_gap(finer, coarser));
  const double width = 0.5 * body_.parts[coarser].lattice.spacing.minCoeff();
  std::vector<Facing> facing;
  std::unordered_map<std::uint32_t, std::uint32_t> number;  // of a polygon in `facing`
  Grid grid(width);
  for (const Sample& point : points_[coarser]) {
    const auto [entry, added] = number.try_emplace(point.polygon, static_cast<std::uint32_t>(facing.size()));
    if (added)
      facing.push_back(
          {point.polygon, point.area_vector.normalized(), polygon_box(body_.surface, point.polygon)});
    // No point of the finer part looks further than into the next cube.
    if (box_holds(box_[finer], point.position, 2 * width)) grid.add(point.position, entry->second);
  }
  // A window at a time: in parallel, then told in their order.
  constexpr std::size_t kWindow = 16384, kGrain = 1024;
  std::vector<std::optional<TouchingPoint>> found;
  for (std::size_t begin = 0; begin < points_[finer].size(); begin += kWindow) {
    found.assign(std::min(kWindow, points_[finer].size() - begin), std::nullopt);
    parallel_chunks(found.size(), kGrain, [&](std::size_t first, std::size_t last) {
      Nearby nearby(grid, facing, limit);
      for (std::size_t i = first; i < last; ++i) {
        const Sample& point = points_[finer][begin + i];
        if (!box_holds(box_[coarser], point.position, limit)) continue;
        const Facing* other = nearest(point, limit, facing, nearby(point.position));
        if (!other) continue;
        const auto at = carrier_on_surface(problem_, other->polygon, point.position, other->normal);
        const auto own = carrier_on_surface(problem_, point.polygon, point.position, point.area_vector);
        if (!at || !own) continue;
        found[i] = {
            {finer, coarser},
            {with_gradient(problem_, *own, point.position), with_gradient(problem_, *at, point.position)},
            point.area_vector.norm(),
            point.area_vector.normalized()};
      }
    });
    for (const std::optional<TouchingPoint>& each : found)
      if (each) use(*each);
  }
}

void TouchingSearch::operator()(const Use& use) {
  const auto spacing = [&](std::uint32_t part) { return body_.parts[part].lattice.spacing.mean(); };
  for (std::uint32_t a = 0; a < body_.parts.size(); ++a)
    for (std::uint32_t b = a + 1; b < body_.parts.size(); ++b) {
      if (points_[a].empty() || points_[b].empty()) continue;
      if (!overlap(box_[a], box_[b], margin(a, b))) continue;
      spacing(a) <= spacing(b) ? touch(a, b, use) : touch(b, a, use);
    }
}

}  // namespace

double touching_distance(double diagonal, double spacing) {
  return std::max(kOfDiagonal * diagonal, kOfSpacing * spacing);
}

void for_each_touching_point(const Problem& problem, const std::vector<TouchingGap>& wider,
                             const std::function<void(const TouchingPoint&)>& use) {
  if (problem.body.parts.size() > 1) TouchingSearch(problem, wider)(use);
}

std::vector<TouchingPoint> touching_points(const Problem& problem, const std::vector<TouchingGap>& wider) {
  std::vector<TouchingPoint> found;
  for_each_touching_point(problem, wider, [&](const TouchingPoint& point) { found.push_back(point); });
  return found;
}

}  // namespace flexel::simulate
