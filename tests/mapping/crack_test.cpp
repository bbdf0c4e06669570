// Parts that broke: pieces are closed, add up to the whole, and go with their own elements.
#include "mapping/crack.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <random>
#include <set>

#include "bodies.h"
#include "cgal_solid.h"
#include "formats/error.h"
#include "formats/topology.h"
#include "voxelize/voxelize.h"

namespace flexel {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// One part of a surface, by index.
struct Piece {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::vector<std::uint32_t>> polygons;
};

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

// Breaks the cells whose middle is in `broken`.
void break_cells(Body& body, const test::Solid& broken) {
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t e : body.cell_elements[c]) middle += body.rest[e] / 8;
    body.broken[c] = broken(middle);
  }
  derive_connections(body);
}

MappedPart map_broken(Body& body, CrackMode mode, bool drop_debris = false) {
  Progress progress("test", Progress::Mode::quiet);
  CrackOptions options;
  options.mode = mode;
  options.drop_debris = drop_debris;
  return map_part(body, {}, options, progress);
}

// Closed, manifold, positive, and together the whole.
void expect_whole(const Body& body, const MappedPart& mapped) {
  ASSERT_TRUE(mapped.cracked);
  const Surface& surface = mapped.cracked->surface;
  check(surface, "pieces");
  std::vector<Vec3> moved = surface.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += mapped.result.displacement[v];
  double sum = 0;
  for (const Piece& piece : pieces_of(surface)) {
    expect_manifold(piece);
    EXPECT_EQ(test::what_cgal_minds(moved, piece.triangles), "");
    const double volume = signed_volume(surface.vertices, piece.triangles);
    EXPECT_GT(volume, 0);
    sum += volume;
  }
  const double whole = volume_of(body.surface);
  EXPECT_NEAR(sum, whole, 1e-12 * whole);
  double reported = 0;
  for (const CrackPiece& piece : mapped.report.crack.pieces) reported += piece.volume_before;
  EXPECT_NEAR(reported, whole, 1e-12 * whole);
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
  test::add_surface(body, vertices, polygons);
}

Body ball(Placement placement, const Mat3& axes, double hole = 0) {
  Lattice lattice;
  lattice.axes = axes;
  lattice.spacing = Vec3(0.1, 0.11, 0.09);
  lattice.origin = Vec3(0.013, -0.02, 0.031);
  // Every voxel that may hold matter, as the voxeliser does.
  const double margin = placement == Placement::corner ? 0.09 : 0.02;
  Body body = test::make_body(
      lattice, {-7, -7, -7}, {7, 7, 7},
      [&](const Vec3& x) { return x.norm() < 0.5 + margin && x.norm() > hole - margin; }, placement);
  add_ball(body, Vec3::Zero(), 0.5, 14);
  if (hole > 0) add_ball(body, Vec3::Zero(), hole, 9, true);
  return body;
}

TEST(Crack, APlaneOfBrokenCellsGivesTwoClosedPiecesThatMoveAsTheirElements) {
  for (const int n : {1, 7}) {
    Body body = test::block(9, 4, 3, 0.1, Placement::corner, n);
    break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
    const Mat3 turn = test::rotation(0.7, Vec3(1, -2, 0.5));
    const auto motion = [&](const Vec3& x) -> Vec3 {
      return x.x() > 0.45 ? Vec3(turn * x + Vec3(1, 0, 0)) : Vec3(x - Vec3(0, 2, 0));
    };
    test::deform(body, motion);
    const Surface before = body.surface;
    const MappedPart mapped = map_broken(body, CrackMode::cap);
    EXPECT_EQ(body.surface.vertices, before.vertices);
    EXPECT_EQ(body.surface.polygon_vertices, before.polygon_vertices);
    expect_whole(body, mapped);
    const Surface& surface = mapped.cracked->surface;
    ASSERT_EQ(surface.parts.size(), 2u);
    EXPECT_EQ(surface.parts[0].name, "part-1");
    for (const Piece& piece : pieces_of(surface)) EXPECT_EQ(euler(piece), 2);
    ASSERT_TRUE(std::equal(before.vertices.begin(), before.vertices.end(), surface.vertices.begin()));
    // The cut lies in the middle of the broken cells.
    for (std::size_t v = before.vertices.size(); v < surface.vertices.size(); ++v)
      EXPECT_NEAR(surface.vertices[v].x(), 0.45, 2e-5);
    for (std::size_t p = 0; p < surface.polygon_count(); ++p)
      for (const std::uint32_t v : surface.polygon(p)) {
        const bool right = mapped.report.crack.pieces[surface.polygon_part(p)].elements == 5 * 5 * 4 &&
                           surface.polygon_part(p) == 1;
        const Vec3 x = surface.vertices[v], moved = x + mapped.result.displacement[v];
        const Vec3 expected = right ? Vec3(turn * x + Vec3(1, 0, 0)) : Vec3(x - Vec3(0, 2, 0));
        EXPECT_LT((moved - expected).norm(), 1e-12);
      }
    EXPECT_EQ(mapped.report.crack.spanning_triangles, 0u);
    for (const CrackPiece& piece : mapped.report.crack.pieces)
      EXPECT_NEAR(piece.volume_after, piece.volume_before, 1e-12);
  }
}

TEST(Crack, KeepCountsTheTrianglesThatSpanAndChangesNothing) {
  Body body = test::block(9, 4, 3, 0.1, Placement::corner, 7);
  break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
  const MappedPart mapped = map_broken(body, CrackMode::keep);
  EXPECT_FALSE(mapped.cracked);
  EXPECT_EQ(mapped.report.crack.fragments, 2u);
  EXPECT_GT(mapped.report.crack.spanning_triangles, 0u);
  // A whole part stays as it is, whatever is asked.
  Body whole = test::block(5, 4, 3, 0.1, Placement::corner, 7);
  EXPECT_FALSE(map_broken(whole, CrackMode::cap).cracked);
}

TEST(Crack, OpenPartsTheSurfaceAndLeavesItOpenAtTheCrackOnly) {
  Body body = test::block(9, 4, 3, 0.1, Placement::corner, 7);
  break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
  const MappedPart mapped = map_broken(body, CrackMode::open);
  ASSERT_TRUE(mapped.cracked);
  const Surface& surface = mapped.cracked->surface;
  check(surface, "pieces");
  ASSERT_EQ(surface.parts.size(), 2u);
  double area = 0, whole = 0;
  const auto add = [](const Surface& s, double& sum) {
    for (const auto& t : triangulate(s).corners)
      sum += 0.5 * (s.vertices[t[1]] - s.vertices[t[0]]).cross(s.vertices[t[2]] - s.vertices[t[0]]).norm();
  };
  add(surface, area);
  add(body.surface, whole);
  EXPECT_NEAR(area, whole, 1e-12);
  for (const Piece& piece : pieces_of(surface)) {
    EXPECT_EQ(euler(piece), 1);  // a disc
    std::map<Edge, int> sum;
    for (const auto& corner : piece.polygons)
      for (std::size_t k = 0; k < corner.size(); ++k) {
        const Edge edge{corner[k], corner[(k + 1) % corner.size()]};
        sum[std::minmax(edge.first, edge.second)] += edge.first < edge.second ? 1 : -1;
      }
    for (const auto& [edge, count] : sum)
      if (count != 0) {
        EXPECT_NEAR(surface.vertices[edge.first].x(), 0.45, 2e-5);
        EXPECT_NEAR(surface.vertices[edge.second].x(), 0.45, 2e-5);
      }
  }
}

TEST(Crack, ACrackThatEndsInsideOpensNothing) {
  Body body = test::block(9, 4, 3, 0.1, Placement::corner, 7);
  break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5 && x.y() < 0.3; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  EXPECT_FALSE(mapped.cracked);
  EXPECT_EQ(mapped.report.crack.fragments, 0u);
}

class RandomDamage : public testing::TestWithParam<int> {};

TEST_P(RandomDamage, IsClosedAndAddsUpInABlock) {
  std::mt19937 random(static_cast<unsigned>(GetParam()));
  std::uniform_real_distribution<double> uniform(0, 1);
  const double share = 0.35 + 0.6 * uniform(random);
  Body body = test::block(5, 4, 5, 0.1, Placement::corner, 1 + GetParam() % 5);
  break_cells(body, [&](const Vec3&) { return uniform(random) < share; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  if (mapped.report.crack.fragments == 0) return;
  expect_whole(body, mapped);
}

TEST_P(RandomDamage, IsClosedAndAddsUpInATurnedBall) {
  std::mt19937 random(static_cast<unsigned>(100 + GetParam()));
  std::uniform_real_distribution<double> uniform(0, 1);
  const double share = 0.35 + 0.6 * uniform(random);
  const Mat3 axes = test::rotation(0.1 + GetParam(), Vec3(1, 2, 3));
  Body body = ball(Placement::corner, axes, GetParam() % 2 ? 0.2 : 0);
  break_cells(body, [&](const Vec3&) { return uniform(random) < share; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  if (mapped.report.crack.fragments == 0) return;
  expect_whole(body, mapped);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomDamage, testing::Range(0, 8));

// An irregular crack across a hollow ball, in a turned lattice, in both placements.
TEST(Crack, AnIrregularCrackThroughAHollowBallGivesTwoPieces) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    const Mat3 axes = test::rotation(0.4, Vec3(1, 1, -1));
    Body body = ball(placement, axes, 0.22);
    const auto side = [&](const Vec3& x) {
      const Vec3 u = axes.transpose() * x;
      return u.x() + 0.06 * std::sin(20 * u.y()) + 0.05 * std::cos(17 * u.z()) > 0.02;
    };
    if (placement == Placement::corner) {
      for (std::size_t c = 0; c < body.cell_count(); ++c) {
        int high = 0;
        for (const std::uint32_t e : body.cell_elements[c]) high += side(body.rest[e]);
        body.broken[c] = high != 0 && high != 8;
      }
      derive_connections(body);
    } else {
      std::map<Index3, std::uint32_t> at;
      for (std::uint32_t e = 0; e < body.element_count(); ++e) at[body.lattice_index[e]] = e;
      for (std::uint32_t e = 0; e < body.element_count(); ++e)
        for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
          Index3 other = body.lattice_index[e];
          for (int a = 0; a < 3; ++a) other[a] += half_neighbourhood[bit][a];
          if (at.count(other) && side(body.rest[e]) != side(body.rest[at[other]]))
            body.connections[e] &= ~(1u << bit);
        }
    }
    const Mat3 turn = test::rotation(-0.5, Vec3(0, 1, 1));
    test::deform(body, [&](const Vec3& x) -> Vec3 { return side(x) ? Vec3(turn * x + Vec3(1, 1, 0)) : x; });
    const MappedPart mapped = map_broken(body, CrackMode::cap);
    expect_whole(body, mapped);
    std::size_t large = 0;
    for (const CrackPiece& piece : mapped.report.crack.pieces) large += piece.elements > 50;
    EXPECT_EQ(large, 2u);
    const std::vector<Piece> pieces = pieces_of(mapped.cracked->surface);
    EXPECT_EQ(euler(pieces[0]), 2);  // half a shell
    EXPECT_EQ(euler(pieces[1]), 2);
    for (const CrackPiece& piece : mapped.report.crack.pieces)
      EXPECT_NEAR(piece.volume_after, piece.volume_before, 1e-11);
  }
}

// A piece that touches itself along an edge comes out drawn apart there, and is manifold.
TEST(Crack, APieceThatTouchesItselfIsManifoldAndDrawnApart) {
  Body body = test::block(5, 5, 5, 0.1, Placement::corner, 3);
  // Two columns of elements that meet along an edge stay with the bottom; what is around them goes.
  break_cells(body, [](const Vec3& x) {
    const bool column = (x.x() < 0.2 && x.y() < 0.2) || (x.x() > 0.3 && x.y() > 0.3);
    return x.z() > 0.2 && !column;
  });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  expect_whole(body, mapped);
  std::set<std::array<double, 3>> rest, moved;
  std::size_t count = 0;
  const Surface& surface = mapped.cracked->surface;
  std::set<std::uint32_t> used;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (surface.polygon_part(p) == 0)
      for (const std::uint32_t v : surface.polygon(p)) used.insert(v);
  for (const std::uint32_t v : used) {
    const Vec3 x = surface.vertices[v], y = x + mapped.result.displacement[v];
    rest.insert({x.x(), x.y(), x.z()});
    moved.insert({y.x(), y.y(), y.z()});
    ++count;
  }
  EXPECT_EQ(moved.size(), count);
}

TEST(Crack, DebrisIsToldAndMayBeLeftOut) {
  Body body = test::block(6, 6, 6, 0.1, Placement::corner, 5);
  break_cells(body, [](const Vec3& x) { return (x - Vec3(0.3, 0.3, 0.3)).cwiseAbs().maxCoeff() < 0.15; });
  const MappedPart kept = map_broken(body, CrackMode::cap);
  expect_whole(body, kept);
  const MappedPart dropped = map_broken(body, CrackMode::cap, true);
  const CrackReport& report = dropped.report.crack;
  ASSERT_GT(report.dropped(), 0u);
  EXPECT_EQ(dropped.cracked->surface.parts.size() + report.dropped(), kept.cracked->surface.parts.size());
  check(dropped.cracked->surface, "pieces");
  EXPECT_NEAR(volume_of(dropped.cracked->surface) + report.dropped_volume(), volume_of(body.surface), 1e-12);
  EXPECT_NEAR(report.dropped_volume(), 1e-3 * static_cast<double>(report.dropped()), 1e-15);
  std::set<std::uint32_t> used(dropped.cracked->surface.polygon_vertices.begin(),
                               dropped.cracked->surface.polygon_vertices.end());
  EXPECT_EQ(used.size(), dropped.cracked->surface.vertices.size());
}

TEST(Crack, AnOpenSurfaceCannotBeCapped) {
  Body body = test::block(9, 4, 3, 0.1, Placement::corner, 7);
  break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
  Surface& surface = body.surface;
  const std::size_t corners = surface.polygon(surface.polygon_count() - 1).size();
  surface.polygon_vertices.resize(surface.polygon_vertices.size() - corners);
  surface.polygon_offsets.pop_back();
  surface.polygon_face.pop_back();
  body.surface_cells.resize(body.surface_cell_offsets[surface.polygon_count()]);
  body.surface_cell_offsets.pop_back();
  try {
    (void)map_broken(body, CrackMode::cap);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("is open"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("--crack open"), std::string::npos);
  }
  EXPECT_TRUE(map_broken(body, CrackMode::open).cracked);
}

// Two leaves 0.3 spacings apart, joined at one end; the upper one breaks off. Boxes between them hold
// elements of both.
TEST(Crack, ALeafThatBreaksOffTakesNothingOfTheOther) {
  const std::vector<std::pair<double, double>> profile = {
      {0, 0}, {1.2, 0}, {1.2, 0.235}, {0.3, 0.235}, {0.3, 0.265}, {1.2, 0.265}, {1.2, 0.5}, {0, 0.5}};
  std::vector<Vec3> vertices;
  for (const double y : {0.0, 0.4})
    for (const auto& [x, z] : profile) vertices.emplace_back(x, y, z);
  std::vector<std::vector<std::uint32_t>> polygons(2);
  for (std::uint32_t k = 0; k < 8; ++k) {
    polygons[0].push_back(k);
    polygons[1].push_back(15 - k);
    polygons.push_back({k, k + 8, (k + 1) % 8 + 8, (k + 1) % 8});
  }
  Body bare;
  bare.parts.resize(1);
  bare.parts[0].name = "leaves";
  test::add_surface(bare, vertices, polygons);
  VoxelizeOptions options;
  options.size = 0.1;
  Progress progress("test", Progress::Mode::quiet);
  Body body = voxelize(bare.surface, options, progress).body;
  // Cells of the upper leaf: those well above the gap, and those that share elements with them.
  const auto range = [&](std::size_t c) {
    Box box;
    for (const std::uint32_t e : body.cell_elements[c]) box.add(body.rest[e]);
    return box;
  };
  std::set<std::uint32_t> upper;
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    if (range(c).min.z() > 0.25) upper.insert(body.cell_elements[c].begin(), body.cell_elements[c].end());
  double cut = 0;
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    const Box box = range(c);
    if (box.min.x() > 0.75 || box.max.x() <= 0.75) continue;
    for (const std::uint32_t e : body.cell_elements[c])
      if (upper.count(e)) body.broken[c] = 1;
    cut = 0.5 * (box.min.x() + box.max.x());
  }
  derive_connections(body);
  const Fragments fragments = find_fragments(body, element_adjacency(body));
  ASSERT_EQ(fragments.list.size(), 2u);
  std::set<Index3> first, second;
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    (fragments.of[e] == 0 ? first : second).insert(body.lattice_index[e]);
  std::size_t shared = 0;
  for (const Index3& index : second) shared += first.count(index);
  ASSERT_GT(shared, 10u);
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    if (fragments.of[e] == 1) body.position[e].z() += 0.5;
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  expect_whole(body, mapped);
  const Surface& surface = mapped.cracked->surface;
  ASSERT_EQ(surface.parts.size(), 2u);
  EXPECT_NEAR(mapped.report.crack.pieces[1].volume_before, (1.2 - cut) * 0.4 * 0.235, 1e-5);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (const std::uint32_t v : surface.polygon(p)) {
      const Vec3& x = surface.vertices[v];
      if (std::abs(x.x() - cut) > 1e-3) {
        EXPECT_EQ(surface.polygon_part(p) == 1, x.z() > 0.25 && x.x() > cut);
      }
      const Vec3 expected(0, 0, surface.polygon_part(p) == 1 ? 0.5 : 0);
      EXPECT_LT((mapped.result.displacement[v] - expected).norm(), 1e-12) << x.transpose();
    }
}

TEST(Crack, AttributesComeAlong) {
  Body body = test::block(9, 4, 3, 0.1, Placement::corner, 2);
  break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
  Column x, number;
  for (const Vec3& vertex : body.surface.vertices) x.values.push_back(vertex.x());
  for (std::size_t p = 0; p < body.surface.polygon_count(); ++p)
    number.values.push_back(static_cast<double>(p));
  body.surface.vertex_columns["x"] = x;
  body.surface.polygon_columns["number"] = number;
  const MappedPart mapped = map_broken(body, CrackMode::open);
  const Surface& surface = mapped.cracked->surface;
  check(surface, "pieces");
  for (std::size_t v = 0; v < surface.vertices.size(); ++v)
    EXPECT_NEAR(surface.vertex_columns.at("x").values[v], surface.vertices[v].x(), 1e-12);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    EXPECT_LT(surface.polygon_columns.at("number").values[p],
              static_cast<double>(body.surface.polygon_count()));
}

}  // namespace
}  // namespace flexel
