#include "pieces.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>

#include "cgal_solid.h"
#include "formats/part/topology.h"

namespace flexel::mapping::test {
namespace {

// Every edge has two sides, which run through it in opposite directions; every vertex has one fan.
void expect_manifold(const Piece& piece) {
  std::map<Edge, int> uses;
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> fans;
  for (const auto& corner : piece.polygons)
    for (std::size_t k = 0; k < corner.size(); ++k) {
      const std::uint32_t before = corner[(k + corner.size() - 1) % corner.size()],
                          after = corner[(k + 1) % corner.size()];
      ++uses[{corner[k], after}];
      fans[corner[k]][after] = before;
    }
  for (const auto& [edge, count] : uses) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(uses.count({edge.second, edge.first}), 1u);
  }
  for (const auto& [vertex, next] : fans) {
    std::size_t steps = 0;
    std::uint32_t at = next.begin()->first;
    do {
      at = next.at(at);
      ++steps;
    } while (at != next.begin()->first && steps <= next.size());
    ASSERT_EQ(steps, next.size());
  }
}

// A ball of quads and triangles around `centre`.
void add_ball(Body& body, const Vec3& centre, double radius, int rings, bool inwards = false) {
  std::vector<Vec3> vertices{centre + Vec3(0, 0, radius)};
  std::vector<std::vector<std::uint32_t>> polygons;
  const int around = 2 * rings;
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double a = M_PI * i / rings, b = 2 * M_PI * (j + 0.3) / around;
      vertices.push_back(centre + radius * Vec3(sin(a) * cos(b), sin(a) * sin(b), cos(a)));
    }
  vertices.push_back(centre - Vec3(0, 0, radius));
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(1 + (i - 1) * around + j % around); };
  const auto last = static_cast<std::uint32_t>(vertices.size() - 1);
  for (int j = 0; j < around; ++j) {
    polygons.push_back({0, at(1, j), at(1, j + 1)});
    for (int i = 1; i + 1 < rings; ++i)
      polygons.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    polygons.push_back({at(rings - 1, j), last, at(rings - 1, j + 1)});
  }
  if (inwards)
    for (auto& polygon : polygons) std::reverse(polygon.begin(), polygon.end());
  add_surface(body, vertices, polygons);
}

}  // namespace

std::vector<Piece> pieces_of(const Surface& surface) {
  std::vector<Piece> pieces(surface.parts.size());
  const Triangles triangles = triangulate(surface);
  for (std::size_t t = 0; t < triangles.corners.size(); ++t)
    pieces[surface.polygon_part(triangles.polygon[t])].triangles.push_back(triangles.corners[t]);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    pieces[surface.polygon_part(p)].polygons.emplace_back(surface.polygon(p).begin(),
                                                          surface.polygon(p).end());
  return pieces;
}

int euler(const Piece& piece) {
  std::set<std::uint32_t> vertices;
  std::set<Edge> edges;
  for (const auto& corner : piece.polygons)
    for (std::size_t k = 0; k < corner.size(); ++k) {
      vertices.insert(corner[k]);
      edges.insert(std::minmax(corner[k], corner[(k + 1) % corner.size()]));
    }
  return static_cast<int>(vertices.size()) - static_cast<int>(edges.size()) +
         static_cast<int>(piece.polygons.size());
}

double volume_of(const Surface& surface) {
  return signed_volume(surface.vertices, triangulate(surface).corners);
}

void break_cells(Body& body, const Solid& broken) {
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t e : body.cell_elements[c]) middle += body.rest[e] / 8;
    body.broken[c] = broken(middle);
  }
  derive_connections(body);
}

MappedPart map_broken(Body& body, CrackMode mode, bool drop_debris) {
  Progress progress("test", Progress::Mode::quiet);
  CrackOptions options;
  options.mode = mode;
  options.drop_debris = drop_debris;
  return map_part(body, {}, options, progress);
}

void expect_whole(const Body& body, const MappedPart& mapped) {
  ASSERT_TRUE(mapped.cracked);
  const Surface& surface = mapped.cracked->surface;
  check(surface, "pieces");
  std::vector<Vec3> moved = surface.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += mapped.result.displacement[v];
  double sum = 0;
  for (const Piece& piece : pieces_of(surface)) {
    expect_manifold(piece);
    EXPECT_EQ(what_cgal_minds(moved, piece.triangles), "");
    const double volume = signed_volume(surface.vertices, piece.triangles);
    EXPECT_GT(volume, 0);
    sum += volume;
  }
  const double whole = volume_of(body.surface);
  EXPECT_NEAR(sum, whole, 1e-12 * whole);
  if (mapped.report.crack.pieces.empty()) return;  // cracks that end inside only
  double reported = 0;
  for (const CrackPiece& piece : mapped.report.crack.pieces) reported += piece.volume_before;
  EXPECT_NEAR(reported, whole, 1e-12 * whole);
}

Body ball(Placement placement, const Mat3& axes, double hole) {
  Lattice lattice;
  lattice.axes = axes;
  lattice.spacing = Vec3(0.1, 0.11, 0.09);
  lattice.origin = Vec3(0.013, -0.02, 0.031);
  // Every voxel that may hold matter, as the voxeliser does.
  const double margin = placement == Placement::corner ? 0.09 : 0.02;
  Body body = make_body(
      lattice, {-7, -7, -7}, {7, 7, 7},
      [&](const Vec3& x) { return x.norm() < 0.5 + margin && x.norm() > hole - margin; }, placement);
  add_ball(body, Vec3::Zero(), 0.5, 14);
  if (hole > 0) add_ball(body, Vec3::Zero(), hole, 9, true);
  return body;
}

}  // namespace flexel::mapping::test
