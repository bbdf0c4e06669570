// Parts that broke: pieces are closed, add up to the whole, and go with their own elements.
#include "mapping/map_part.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <random>
#include <set>

#include "base/error.h"
#include "formats/part/topology.h"
#include "pieces.h"
#include "voxelize/voxelize.h"

namespace flexel::mapping {
namespace {

using namespace test;

TEST(Crack, APlaneOfBrokenCellsGivesTwoClosedPiecesThatMoveAsTheirElements) {
  for (const int n : {1, 7}) {
    Body body = block(9, 4, 3, 0.1, Placement::corner, n);
    break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
    const Mat3 turn = rotation(0.7, Vec3(1, -2, 0.5));
    const auto motion = [&](const Vec3& x) -> Vec3 {
      return x.x() > 0.45 ? Vec3(turn * x + Vec3(1, 0, 0)) : Vec3(x - Vec3(0, 2, 0));
    };
    deform(body, motion);
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
  Body body = block(9, 4, 3, 0.1, Placement::corner, 7);
  break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
  const MappedPart mapped = map_broken(body, CrackMode::keep);
  EXPECT_FALSE(mapped.cracked);
  EXPECT_EQ(mapped.report.crack.fragments, 2u);
  EXPECT_GT(mapped.report.crack.spanning_triangles, 0u);
  // A whole part stays as it is, whatever is asked.
  Body whole = block(5, 4, 3, 0.1, Placement::corner, 7);
  EXPECT_FALSE(map_broken(whole, CrackMode::cap).cracked);
}

TEST(Crack, OpenPartsTheSurfaceAndLeavesItOpenAtTheCrackOnly) {
  Body body = block(9, 4, 3, 0.1, Placement::corner, 7);
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

class RandomDamage : public testing::TestWithParam<int> {};

TEST_P(RandomDamage, IsClosedAndAddsUpInABlock) {
  std::mt19937 random(static_cast<unsigned>(GetParam()));
  std::uniform_real_distribution<double> uniform(0, 1);
  const double share = 0.35 + 0.6 * uniform(random);
  Body body = block(5, 4, 5, 0.1, Placement::corner, 1 + GetParam() % 5);
  break_cells(body, [&](const Vec3&) { return uniform(random) < share; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  if (!mapped.cracked) return;
  expect_whole(body, mapped);
}

TEST_P(RandomDamage, IsClosedAndAddsUpInATurnedBall) {
  std::mt19937 random(static_cast<unsigned>(100 + GetParam()));
  std::uniform_real_distribution<double> uniform(0, 1);
  const double share = 0.35 + 0.6 * uniform(random);
  const Mat3 axes = rotation(0.1 + GetParam(), Vec3(1, 2, 3));
  Body body = ball(Placement::corner, axes, GetParam() % 2 ? 0.2 : 0);
  break_cells(body, [&](const Vec3&) { return uniform(random) < share; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  if (!mapped.cracked) return;
  expect_whole(body, mapped);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomDamage, testing::Range(0, 8));

// An irregular crack across a hollow ball, in a turned lattice, in both placements.
TEST(Crack, AnIrregularCrackThroughAHollowBallGivesTwoPieces) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    const Mat3 axes = rotation(0.4, Vec3(1, 1, -1));
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
    const Mat3 turn = rotation(-0.5, Vec3(0, 1, 1));
    deform(body, [&](const Vec3& x) -> Vec3 { return side(x) ? Vec3(turn * x + Vec3(1, 1, 0)) : x; });
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
  Body body = block(5, 5, 5, 0.1, Placement::corner, 3);
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
  Body body = block(6, 6, 6, 0.1, Placement::corner, 5);
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

TEST(Crack, ABodyThatIsAllDebrisCanBeKeptButNotDropped) {
  Body body = block(3, 2, 2, 0.1, Placement::corner, 2);
  break_cells(body, [](const Vec3&) { return true; });
  const MappedPart kept = map_broken(body, CrackMode::cap);
  expect_whole(body, kept);
  EXPECT_EQ(kept.cracked->surface.parts.size(), body.element_count());
  EXPECT_THROW((void)map_broken(body, CrackMode::cap, true), InputError);
}

TEST(Crack, AnOpenSurfaceCannotBeCapped) {
  Body body = block(9, 4, 3, 0.1, Placement::corner, 7);
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
  // Nor one that is inside out, or two blocks in one another.
  Body turned = block(9, 4, 3, 0.1, Placement::corner, 7);
  break_cells(turned, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
  Body twice = turned;
  for (std::size_t p = 0; p < turned.surface.polygon_count(); ++p)
    std::reverse(turned.surface.polygon_vertices.begin() + turned.surface.polygon_offsets[p],
                 turned.surface.polygon_vertices.begin() + turned.surface.polygon_offsets[p + 1]);
  EXPECT_THROW((void)map_broken(turned, CrackMode::cap), InputError);
  add_box_surface(twice, Vec3(0.2, 0.1, 0.1), Vec3(0.7, 0.5, 0.2), 3);
  EXPECT_THROW((void)map_broken(twice, CrackMode::cap), InputError);
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
  add_surface(bare, vertices, polygons);
  voxelize::VoxelizeOptions options;
  options.size = 0.1;
  Progress progress("test", Progress::Mode::quiet);
  Body body = voxelize::voxelize(bare.surface, options, progress).body;
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
  const Components fragments = find_components(body, element_adjacency(body));
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

TEST(Crack, APartThatIsWholeStaysAndNamesStayApart) {
  Body body = block(9, 4, 3, 0.1, Placement::corner, 3);
  const Body other = block(3, 3, 3, 0.1, Placement::corner, 3);
  append_body(body, other);
  body.parts[1].name = body.surface.parts[1].name = "part-2";
  break_cells(body, [&](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  expect_whole(body, mapped);
  const Surface& surface = mapped.cracked->surface;
  ASSERT_EQ(surface.parts.size(), 3u);
  std::set<std::string> names;
  for (const SurfacePart& part : surface.parts) names.insert(part.name);
  EXPECT_EQ(names.size(), 3u);
  EXPECT_EQ(mapped.report.crack.fragments, 2u);
  EXPECT_EQ(pieces_of(surface)[2].polygons.size(), other.surface.polygon_count());
}

TEST(Crack, AttributesComeAlong) {
  Body body = block(9, 4, 3, 0.1, Placement::corner, 2);
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
}  // namespace flexel::mapping
