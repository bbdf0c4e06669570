// Facets of the finer part are cut by those of the other, projected along their normals. Which facets are near each other
// is found by a sweep along the longest side of where the parts' boxes meet.
#include "simulate/quadratic/cells/bonded_cells.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "formats/lattice/locate.h"

namespace flexel::simulate {
namespace {

constexpr double kOfDiagonal = 1e-6, kOfSpacing = 1e-2;
constexpr double kFacing = -0.7;   // cosine between the normals
constexpr double kSliver = 1e-12;  // of the finer voxel's face: smaller pieces hold nothing

struct Facet {
  std::array<Vec3, 3> corners;
  Vec3 normal = Vec3::Zero();  // outward
  std::uint32_t polygon = 0;
  Box box;
};

bool overlap(const Box& a, const Box& b, double margin) {
  return (a.min.array() <= b.max.array() + margin).all() && (b.min.array() <= a.max.array() + margin).all();
}

// What of a convex polygon has side(corner) >= 0, `side` being linear.
template <class Side>
Outline cut(const Outline& outline, const Side& side) {
  Outline kept;
  for (std::size_t v = 0; v < outline.size(); ++v) {
    const Vec3 &a = outline[v], &b = outline[(v + 1) % outline.size()];
    const double da = side(a), db = side(b);
    if (da >= 0) kept.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + (b - a) * (da / (da - db)));
  }
  return kept;
}

double area_of(const Outline& outline) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t v = 1; v + 1 < outline.size(); ++v)
    sum += 0.5 * (outline[v] - outline[0]).cross(outline[v + 1] - outline[0]);
  return sum.norm();
}

// What of `own` faces `other` no further than `limit` away.
Outline shared(const Facet& own, const Facet& other, double limit) {
  const double facing = own.normal.dot(other.normal);
  if (facing > kFacing) return {};
  Outline piece(own.corners.begin(), own.corners.end());
  for (std::size_t e = 0; e < 3 && !piece.empty(); ++e) {
    const Vec3 &from = other.corners[e], along = other.corners[(e + 1) % 3] - from;
    const Vec3 inwards =
        along.cross(own.normal).normalized();  // the other's corners go round against `normal`
    piece = cut(piece, [&](const Vec3& at) { return inwards.dot(at - from); });
  }
  for (const double side : {1.0, -1.0})
    if (!piece.empty())
      piece = cut(piece, [&](const Vec3& at) {
        return limit - side * (at - other.corners[0]).dot(other.normal) / facing;
      });
  return piece;
}

class Search {
 public:
  Search(const Problem& problem, const QuadraticNodes& nodes, const std::array<std::uint32_t, 2>& parts,
         double gap)
      : body_(problem.body), nodes_(nodes), parts_(parts) {
    const auto spacing = [&](std::uint32_t part) { return body_.parts[part].lattice.spacing; };
    if (spacing(parts_[1]).mean() < spacing(parts_[0]).mean()) std::swap(parts_[0], parts_[1]);
    finest_ = spacing(parts_[0]).minCoeff();
    limit_ =
        std::max({gap, kOfDiagonal * bounding_box(body_.surface.vertices).diagonal(), kOfSpacing * finest_});
    const std::array<std::vector<Facet>, 2> all = facets();
    std::array<Box, 2> boxes;
    for (std::size_t side = 0; side < 2; ++side)
      for (const Facet& each : all[side])
        for (const Vec3& corner : each.corners) boxes[side].add(corner);
    Box common;
    common.min = boxes[0].min.cwiseMax(boxes[1].min);
    common.max = boxes[0].max.cwiseMin(boxes[1].max);
    (common.max - common.min).maxCoeff(&axis_);
    for (std::size_t side = 0; side < 2; ++side) {
      for (const Facet& each : all[side])
        if (overlap(each.box, boxes[1 - side], limit_)) facets_[side].push_back(each);
      std::stable_sort(facets_[side].begin(), facets_[side].end(),
                       [&](const Facet& a, const Facet& b) { return a.box.min[axis_] < b.box.min[axis_]; });
    }
  }

  CommonSurface operator()() {
    double widest = 0;
    for (const Facet& other : facets_[1]) widest = std::max(widest, other.box.size()[axis_]);
    for (const Facet& own : facets_[0]) {
      auto other =
          std::lower_bound(facets_[1].begin(), facets_[1].end(), own.box.min[axis_] - limit_ - widest,
                           [&](const Facet& each, double from) { return each.box.min[axis_] < from; });
      for (; other != facets_[1].end() && other->box.min[axis_] <= own.box.max[axis_] + limit_; ++other)
        if (overlap(own.box, other->box, limit_)) add(own, *other);
    }
    return gathered();
  }

 private:
  [[nodiscard]] std::array<std::vector<Facet>, 2> facets() const {
    std::array<std::vector<Facet>, 2> found;
    const Triangles triangles = triangulate(body_.surface);
    for (std::size_t t = 0; t < triangles.polygon.size(); ++t) {
      const std::uint32_t part = body_.surface.polygon_part(triangles.polygon[t]);
      if (part != parts_[0] && part != parts_[1]) continue;
      Facet facet;
      facet.polygon = triangles.polygon[t];
      for (std::size_t v = 0; v < 3; ++v) {
        facet.corners[v] = body_.surface.vertices[triangles.corners[t][v]];
        facet.box.add(facet.corners[v]);
      }
      facet.normal = (facet.corners[1] - facet.corners[0]).cross(facet.corners[2] - facet.corners[0]);
      if (!(facet.normal.norm() > 0)) continue;
      facet.normal.normalize();
      found[part == parts_[0] ? 0 : 1].push_back(facet);
    }
    return found;
  }

  // The cell of `side` that resists under a point of a polygon.
  std::optional<std::uint32_t> cell_under(std::size_t side, std::uint32_t polygon, const Vec3& at) {
    const auto locate = locators_[side].try_emplace(polygon, body_, polygon).first;
    const std::optional<CellPoint> found = locate->second(at);
    if (!found) return std::nullopt;
    const auto cell = std::lower_bound(nodes_.cells.begin(), nodes_.cells.end(), found->cell);
    if (cell == nodes_.cells.end() || *cell != found->cell) return std::nullopt;
    return static_cast<std::uint32_t>(cell - nodes_.cells.begin());
  }

  void add(const Facet& own, const Facet& other) {
    const Outline piece = shared(own, other, limit_);
    if (piece.size() < 3) return;
    const Lattice &first = body_.parts[parts_[0]].lattice, &second = body_.parts[parts_[1]].lattice;
    const auto moved = [](const Outline& outline, const auto& to) {
      Outline there;
      for (const Vec3& corner : outline) there.push_back(to(corner));
      return there;
    };
    const auto lattice_of = [](const Lattice& lattice) {
      return [&lattice](const Vec3& at) { return lattice.to_lattice(at); };
    };
    const auto world_of = [](const Lattice& lattice) {
      return [&lattice](const Vec3& at) { return lattice.to_world(at); };
    };
    for_each_voxel(moved(piece, lattice_of(first)), 0, [&](const Outline& in_first) {
      for_each_voxel(moved(moved(in_first, world_of(first)), lattice_of(second)), 0,
                     [&](const Outline& in_second) {
                       add_piece(own, other, moved(in_second, world_of(second)), is_small(in_second));
                     });
    });
  }

  void add_piece(const Facet& own, const Facet& other, const Outline& piece, bool small) {
    if (!(area_of(piece) > kSliver * finest_ * finest_)) return;
    const Vec3 middle = middle_of(piece);
    const Vec3 across = (other.corners[0] - middle).dot(other.normal) * other.normal;
    const std::array<std::optional<std::uint32_t>, 2> cell = {cell_under(0, own.polygon, middle),
                                                              cell_under(1, other.polygon, middle + across)};
    if (!cell[0] || !cell[1]) return;
    polygons_.insert({own.polygon, other.polygon});
    for_each_gauss_point(piece, small, [&](const Vec3& position, const Vec3& area_vector) {
      for (std::size_t side = 0; side < 2; ++side)
        points_[side].push_back(
            {*cell[side],
             cell_coordinates(body_, body_.parts[parts_[side]], nodes_.cells[*cell[side]], position),
             position, side == 0 ? area_vector : Vec3(-area_vector)});
      area_ += area_vector.norm();
    });
  }

  CommonSurface gathered() {
    CommonSurface found{{}, {polygons_.begin(), polygons_.end()}, area_};
    for (auto& points : points_) points = in_firm_cells(body_, nodes_, std::move(points));
    std::map<std::array<std::uint32_t, 2>, BondedCells> by_cells;
    for (std::size_t p = 0; p < points_[0].size(); ++p) {
      const std::array<std::uint32_t, 2> cells = {points_[0][p].cell, points_[1][p].cell};
      BondedCells& there = by_cells[cells];
      there.cell = cells;
      for (std::size_t side = 0; side < 2; ++side) there.points[side].push_back(points_[side][p]);
    }
    for (auto& [cells, pair] : by_cells) found.pairs.push_back(std::move(pair));
    return found;
  }

  const Body& body_;
  const QuadraticNodes& nodes_;
  std::array<std::uint32_t, 2> parts_;        // the finer one first
  double finest_ = 0, limit_ = 0, area_ = 0;  // m, m, m^2
  Eigen::Index axis_ = 0;                     // of the sweep
  std::array<std::vector<Facet>, 2> facets_;
  std::array<std::map<std::uint32_t, SurfaceLocator>, 2> locators_;
  std::array<std::vector<FacePoint>, 2> points_;
  std::set<std::uint32_t> polygons_;
};

}  // namespace

CommonSurface common_surface(const Problem& problem, const QuadraticNodes& nodes,
                             const std::array<std::uint32_t, 2>& parts, double gap) {
  return Search(problem, nodes, parts, gap)();
}

}  // namespace flexel::simulate
