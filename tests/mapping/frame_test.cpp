// What holds a vertex: four elements where there are four, fewer where the part is thin, never across a crack
// or to another part.
#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.h"
#include "bodies.h"
#include "mapping/anchors/search.h"
#include "mapping/methods/bind.h"
#include "mapping/report/report.h"
#include "motions.h"

namespace flexel::mapping {
namespace {

using test::map_quietly;

bool are_connected(const Adjacency& connections, std::uint32_t from, std::uint32_t to) {
  std::vector<std::uint32_t> known{from};
  for (std::size_t i = 0; i < known.size(); ++i)
    for (const std::uint32_t next : connections.of(known[i]))
      if (std::find(known.begin(), known.end(), next) == known.end()) known.push_back(next);
  return std::find(known.begin(), known.end(), to) != known.end();
}

class Thin : public testing::TestWithParam<MapMethod> {};

TEST_P(Thin, OneLayerGivesPlanesThatFollowRigidMotionAndKeepTheirThickness) {
  Body body = test::block(6, 5, 1, 0.1, Placement::centre);
  const Mat3 turn = test::rotation(2.5, Vec3(1, 1, 0.3));
  const auto rigid = [&](const Vec3& x) -> Vec3 { return turn * x + Vec3(1, 2, 3); };
  test::deform(body, rigid);
  MapResult result = map_quietly(body, GetParam());
  for (std::size_t v = 0; v < result.frame.size(); ++v) {
    EXPECT_EQ(result.frame_of(v).kind, FrameKind::plane);
    EXPECT_LT((body.surface.vertices[v] + result.displacement[v] - rigid(body.surface.vertices[v])).norm(),
              1e-12);
  }
  // Stretched in its plane, the layer stays as thick as it was.
  test::deform(body, [](const Vec3& x) -> Vec3 { return {1.5 * x.x(), x.y(), x.z()}; });
  result = map_quietly(body, GetParam());
  for (std::size_t v = 0; v < result.frame.size(); ++v) EXPECT_NEAR(result.displacement[v].z(), 0, 1e-15);
}

TEST_P(Thin, OneRowGivesLinesThatFollowItsDirection) {
  Body body = test::block(7, 1, 1, 0.1, Placement::centre);
  const Mat3 turn =
      test::rotation(0.8, Vec3(0, 1, 0));  // across the row: the smallest rotation that takes it there
  const Vec3 middle(0, 0.05, 0.05);
  const auto rigid = [&](const Vec3& x) -> Vec3 { return turn * (x - middle) + middle; };
  test::deform(body, rigid);
  const MapResult result = map_quietly(body, GetParam());
  for (std::size_t v = 0; v < result.frame.size(); ++v) {
    EXPECT_EQ(result.frame_of(v).kind, FrameKind::line);
    EXPECT_LT((body.surface.vertices[v] + result.displacement[v] - rigid(body.surface.vertices[v])).norm(),
              1e-12);
  }
  // Turned right round, which has no smallest rotation: finite, and as far apart as before.
  test::deform(body, [](const Vec3& x) -> Vec3 { return {-x.x(), x.y(), x.z()}; });
  const MapResult opposite = map_quietly(body, GetParam());
  for (std::size_t v = 0; v < opposite.frame.size(); ++v) {
    const std::uint32_t origin = opposite.frame_of(v).elements[0];
    EXPECT_NEAR((body.surface.vertices[v] + opposite.displacement[v] - body.position[origin]).norm(),
                (body.surface.vertices[v] - body.rest[origin]).norm(), 1e-12);
  }
}

TEST_P(Thin, OneElementCarriesItsVerticesAlong) {
  Body body = test::block(1, 1, 1, 0.1, Placement::centre);
  test::deform(body, [](const Vec3& x) -> Vec3 { return x + Vec3(1, -2, 3); });
  const MapResult result = map_quietly(body, GetParam());
  for (std::size_t v = 0; v < result.frame.size(); ++v) {
    EXPECT_EQ(result.frame_of(v).kind, FrameKind::rigid);
    EXPECT_LT((result.displacement[v] - Vec3(1, -2, 3)).norm(), 1e-15);
  }
  EXPECT_TRUE(report(body, result).valid());
}

INSTANTIATE_TEST_SUITE_P(Methods, Thin, testing::ValuesIn(test::kEveryMethod),
                         [](const auto& with) { return test::test_name(with.param); });

// A row along x that ends in a wall across it: the farther from the wall, the wider the search; beyond kRings
// the row's elements see too little of the wall.
TEST(Search, WidensAlongConnections) {
  const auto solid = [](const Vec3& p) { return p.x() > 3 || (p.y() < 1 && p.z() < 1); };
  Body body = test::make_body({}, {0, 0, 0}, {4, 4, 4}, solid, Placement::centre);
  test::add_surface(body, {Vec3(0.4, 0.4, 0.1), Vec3(1.4, 0.4, 0.1), Vec3(2.4, 0.4, 0.2)}, {{0, 1, 2}});
  const MapResult result = map_quietly(body);
  EXPECT_EQ(result.frame_of(0).kind, FrameKind::plane);
  EXPECT_EQ(result.frame_of(0).rings, kRings - 1);
  EXPECT_EQ(result.frame_of(1).kind, FrameKind::full);
  EXPECT_EQ(result.frame_of(1).rings, 1);
  EXPECT_EQ(result.frame_of(2).kind, FrameKind::full);
  EXPECT_EQ(result.frame_of(2).rings, 0);
  EXPECT_EQ(report(body, result).widened, 2u);
}

TEST(Search, QuadruplesAreWellConditionedAndClose) {
  Lattice lattice;
  lattice.axes = test::rotation(0.4, Vec3(0.3, 1, 0.2));
  lattice.spacing = Vec3(0.1, 0.11, 0.095);
  const Vec3 middle = lattice.to_world(Vec3(6, 6, 6));
  Body body = test::make_body(
      lattice, {0, 0, 0}, {12, 12, 12}, [&](const Vec3& p) { return (p - middle).norm() < 0.52; },
      Placement::centre);
  test::add_box_surface(body, middle - Vec3::Constant(0.3), middle + Vec3::Constant(0.3), 9);
  const MapResult result = map_quietly(body);
  for (std::size_t v = 0; v < result.frame.size(); ++v) {
    const auto& q = result.frame_of(v).elements;
    const auto edge = [&](int i) -> Vec3 { return body.rest[q[i]] - body.rest[q[0]]; };
    ASSERT_EQ(result.frame_of(v).kind, FrameKind::full);
    EXPECT_GE(std::abs(normalised_determinant(edge(1), edge(2), edge(3))), kWellConditioned);
    for (int i = 1; i < 4; ++i) EXPECT_LT(edge(i).norm(), 0.2);
  }
}

// A wall of broken cells: whatever is on one side must not feel the other.
TEST(Cracks, BrokenCellsCutFrames) {
  Body body = test::block(8, 4, 4, 0.1, Placement::corner, 24);
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    body.broken[c] = body.lattice_index[body.cell_elements[c][0]][0] == 4;
  derive_connections(body);
  const Adjacency connections = element_adjacency(body);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] >= 5) body.position[e] += Vec3(0.3, 0, 0);
  for (const MapMethod method : test::kEveryMethod) {
    const MapResult result = map_quietly(body, method);
    for (std::size_t v = 0; v < result.frame.size(); ++v) {
      EXPECT_EQ(result.frame_of(v).kind, FrameKind::full);
      for (const std::uint32_t element : result.frame_of(v).elements)
        EXPECT_TRUE(are_connected(connections, result.frame_of(v).elements[0], element));
      const double moved = result.displacement[v].x();
      EXPECT_TRUE(std::abs(moved) < 1e-12 || std::abs(moved - 0.3) < 1e-12) << moved;
    }
    EXPECT_TRUE(report(body, result).valid());
  }
}

TEST(Cracks, AnElementLeftAloneCarriesItsVertices) {
  Body body = test::block(2, 2, 2, 0.1, Placement::corner, 6);
  std::fill(body.broken.begin(), body.broken.end(), std::uint8_t{1});
  derive_connections(body);
  test::deform(body, [](const Vec3& x) -> Vec3 { return 3 * x; });
  const MapResult result = map_quietly(body);
  for (std::size_t v = 0; v < result.frame.size(); ++v) {
    EXPECT_EQ(result.frame_of(v).kind, FrameKind::rigid);
    EXPECT_LT((result.displacement[v] - 2 * body.rest[result.frame_of(v).elements[0]]).norm(), 1e-15);
  }
}

TEST(Parts, InTouchNeverShareFrames) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = test::block(4, 4, 4, 0.1, placement);
    Body other = test::block(4, 4, 4, 0.1, placement);
    const Vec3 shift(0.4, 0, 0);
    for (Vec3& x : other.rest) x += shift;
    for (Vec3& x : other.surface.vertices) x += shift;
    other.parts[0].lattice.origin += shift;
    other.position = other.rest;
    const std::size_t first = body.surface.vertices.size();
    test::append_body(body, other);
    for (std::size_t e = 0; e < body.element_count(); ++e)
      if (e >= body.parts[0].element_end) body.position[e] += Vec3(0.3, 0, 0);
    for (const MapMethod method : test::kEveryMethod) {
      const MapResult result = map_quietly(body, method);
      for (std::size_t v = 0; v < result.frame.size(); ++v) {
        for (const std::uint32_t element : result.frame_of(v).elements)
          EXPECT_EQ(element < body.parts[0].element_end, v < first);
        EXPECT_NEAR(result.displacement[v].x(), v < first ? 0 : 0.3, 1e-15);
      }
    }
  }
}

// Two leaves 0.3 h apart in one layer of voxels: cells of two pieces, each with its own elements.
TEST(Pieces, LeavesNearerThanASpacingKeepToTheirOwnElements) {
  Body body = test::block(6, 4, 1, 0.1, Placement::corner);
  body.surface = {};
  const auto n = static_cast<std::uint32_t>(body.element_count());
  const auto m = static_cast<std::uint32_t>(body.cell_count());
  // Interleave so that the order (k, j, i, piece) holds: element e becomes 2 e and 2 e + 1, cells likewise.
  Body split = body;
  split.lattice_index.clear(), split.rest.clear(), split.piece.clear(), split.cell_elements.clear();
  for (std::uint32_t e = 0; e < n; ++e)
    for (std::uint16_t piece = 0; piece < 2; ++piece) {
      split.lattice_index.push_back(body.lattice_index[e]);
      split.rest.push_back(body.rest[e]);
      split.piece.push_back(piece);
    }
  for (std::uint32_t c = 0; c < m; ++c)
    for (std::uint32_t piece = 0; piece < 2; ++piece) {
      std::array<std::uint32_t, 8> cell = body.cell_elements[c];
      for (std::uint32_t& element : cell) element = 2 * element + piece;
      split.cell_elements.push_back(cell);
    }
  split.position = split.rest;
  split.fill.assign(2 * m, 0.35);
  split.broken.assign(2 * m, 0);
  split.connections.assign(2 * n, 0);
  split.parts[0].element_end = 2 * n;
  split.parts[0].cell_end = 2 * m;
  derive_connections(split);
  // The inner faces of the two leaves, as one quad of large polygons each: z = 0.035 and 0.065.
  const auto leaf = [&](double z) {
    return std::vector<Vec3>{{0.01, 0.01, z}, {0.59, 0.01, z}, {0.59, 0.39, z}, {0.01, 0.39, z}};
  };
  std::vector<Vec3> vertices = leaf(0.035);
  for (const Vec3& x : leaf(0.065)) vertices.push_back(x);
  test::add_surface(split, vertices, {{0, 1, 2, 3}, {7, 6, 5, 4}});
  split.surface_cells.clear();
  split.surface_cell_offsets = {0, m, 2 * m};
  for (std::uint32_t piece = 0; piece < 2; ++piece)
    for (std::uint32_t c = 0; c < m; ++c) split.surface_cells.push_back(2 * c + piece);
  check(split, "test");
  for (std::size_t e = 0; e < split.element_count(); ++e)
    if (split.piece[e] == 1) split.position[e] += Vec3(0, 0, 0.2);
  for (const MapMethod method : test::kEveryMethod) {
    const MapResult result = map_quietly(split, method);
    for (std::size_t v = 0; v < 8; ++v) {
      EXPECT_EQ(result.frame_of(v).kind, FrameKind::full);
      EXPECT_NEAR(result.displacement[v].z(), v < 4 ? 0 : 0.2, 1e-15);
    }
  }
}

// A deformed block with quads along x and y that share no vertex numbers, as in an OBJ with texture seams.
// first: m, their lowest corner; side: m, of each.
Body block_under_loose_quads(const Vec3& first, double side) {
  Body body = test::block(6, 4, 4, 0.1, Placement::corner);
  body.surface = {};
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> quads;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 8; ++j) {
      const auto corner = static_cast<std::uint32_t>(vertices.size());
      for (const auto& [a, b] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
        vertices.emplace_back(first + side * Vec3(i + a, j + b, 0));
      quads.push_back({corner, corner + 1, corner + 2, corner + 3});
    }
  test::add_surface(body, vertices, quads);
  test::deform(body, [](const Vec3& x) -> Vec3 {
    return {x.x() + x.y() * x.y(), x.y() + x.z() * x.x(), x.z()};
  });
  return body;
}

TEST(Seams, VerticesAtOnePositionMoveAsOne) {  // across the lattice's planes
  const Body body = block_under_loose_quads(Vec3(0, 0, 0.4), 0.05);
  const std::vector<Vec3>& vertices = body.surface.vertices;
  for (const MapMethod method : test::kEveryMethod) {
    const MapResult result = map_quietly(body, method);
    std::size_t pairs = 0;
    for (std::size_t a = 0; a < vertices.size(); ++a)
      for (std::size_t b = 0; b < a; ++b)
        if (vertices[a] == vertices[b]) {
          ++pairs;
          EXPECT_EQ(result.displacement[a], result.displacement[b]);
        }
    EXPECT_GT(pairs, 200u);
  }
}

TEST(Seams, APolygonThatNamesTheWrongCellHoldsItsVerticesLikeThoseAtTheirPositions) {
  // Off the lattice's planes, so that nearly every vertex finds its voxel by itself; a few polygons name a
  // cell far away, and their vertices go by what the others at their positions find.
  const Body body = block_under_loose_quads(Vec3(0.013, 0.013, 0.337), 0.045);
  const std::vector<Vec3>& vertices = body.surface.vertices;
  Body wrong = body;
  wrong.surface_cells.clear();
  wrong.surface_cell_offsets = {0};
  const auto is_wrong = [](std::size_t quad) { return quad % 11 == 5; };
  for (std::size_t p = 0; p < body.surface.polygon_count(); ++p) {
    if (is_wrong(p))
      wrong.surface_cells.push_back(0);  // at z = 0, two cells below
    else
      wrong.surface_cells.insert(wrong.surface_cells.end(),
                                 body.surface_cells.begin() + body.surface_cell_offsets[p],
                                 body.surface_cells.begin() + body.surface_cell_offsets[p + 1]);
    wrong.surface_cell_offsets.push_back(static_cast<std::uint32_t>(wrong.surface_cells.size()));
  }
  check(wrong, "test");
  const auto has_double = [&](std::size_t v) {
    for (std::size_t other = 0; other < vertices.size(); ++other)
      if (!is_wrong(other / 4) && vertices[other] == vertices[v]) return true;
    return false;
  };
  const MapResult right = map_quietly(body, &kAffine), held = map_quietly(wrong, &kAffine);
  std::size_t in_doubt = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (!has_double(v)) continue;
    in_doubt += is_wrong(v / 4);
    EXPECT_EQ(held.displacement[v], right.displacement[v]) << v;
  }
  EXPECT_GT(in_doubt, 20u);
  EXPECT_LT(in_doubt, vertices.size() / 8);
}

TEST(Unreferenced, VerticesFollowTheNearestElementOfAnyPart) {
  Body body = test::block(3, 3, 3, 0.1, Placement::corner);
  test::append_body(body, test::block(2, 2, 2, 0.1, Placement::corner));
  body.surface.vertices.push_back(Vec3(40, -3, 2));
  test::deform(body, [](const Vec3& x) -> Vec3 { return x + Vec3(0, 0, 0.5); });
  const MapResult result = map_quietly(body);
  EXPECT_EQ(result.referenced.back(), 0);
  EXPECT_LT((result.displacement.back() - Vec3(0, 0, 0.5)).norm(), 1e-12);
  const MapReport found = report(body, result);
  EXPECT_EQ(found.unreferenced, 1u);
  EXPECT_LT(found.distance_outside, 1);
}

TEST(Refuses, ABodyWithoutASurfaceOrAPartWithoutElements) {
  Body body = test::block(2, 2, 2, 0.1, Placement::corner);
  Body bare = body;
  bare.surface = {};
  EXPECT_THROW(map_quietly(bare), InputError);
  body.parts.push_back(body.parts[0]);
  body.parts[1].element_begin = body.parts[1].element_end;
  EXPECT_THROW(map_quietly(body), InputError);
}

}  // namespace
}  // namespace flexel::mapping
