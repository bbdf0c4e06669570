#include "formats/part/topology.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "base/parallel.h"

namespace flexel {
namespace {

using Corners = std::vector<std::array<std::uint32_t, 3>>;

struct Mesh {
  std::vector<Vec3> vertices;
  Corners corners;
};

// A box of n x n quads a side, two triangles each; vertices shared.
Mesh box_mesh(int n) {
  Mesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> index;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [it, added] = index.emplace(at, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (added) mesh.vertices.emplace_back(at[0], at[1], at[2]);
    return it->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side <= n; side += n)
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto at = [&](int u, int v) {
            std::array<int, 3> p{};
            p[axis] = side, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
            return vertex(p);
          };
          std::array<std::uint32_t, 4> q{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
          if (side == 0) std::swap(q[1], q[3]);
          mesh.corners.push_back({q[0], q[1], q[2]});
          mesh.corners.push_back({q[0], q[2], q[3]});
        }
  return mesh;
}

TEST(Weld, AgreesWithAMapOnRandomPositionsForAnyThreadCount) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> pick(-20, 20);
  std::vector<Vec3> vertices(60000);
  for (Vec3& v : vertices) v = Vec3(pick(random), pick(random), pick(random)) * 0.1;
  for (std::size_t i = 0; i < vertices.size(); i += 3) vertices[i] = -vertices[i];  // -0 appears
  std::map<std::array<double, 3>, std::uint32_t> first;
  std::vector<std::uint32_t> expected;
  for (const Vec3& v : vertices)
    expected.push_back(
        first.emplace(std::array{v.x(), v.y(), v.z()}, static_cast<std::uint32_t>(expected.size()))
            .first->second);
  for (const int threads : {1, 2, 4}) {
    const ThreadLimit limit(threads);
    EXPECT_EQ(weld(vertices), expected);
  }
}

TEST(Weld, NegativeZeroEqualsZeroAndNearlyEqualIsNotEqual) {
  const std::vector<Vec3> vertices{{0.0, 1, 2}, {-0.0, 1, 2}, {1e-300, 1, 2}};
  EXPECT_EQ(weld(vertices), (std::vector<std::uint32_t>{0, 0, 2}));
}

TEST(Topology, ClosedBoxHasEveryNeighbourAndItsVolume) {
  const Mesh mesh = box_mesh(5);
  const Topology result = topology(mesh.corners, weld(mesh.vertices));
  EXPECT_TRUE(result.closed());
  EXPECT_TRUE(result.oriented());
  EXPECT_EQ(result.shell_count, 1u);
  EXPECT_NEAR(signed_volume(mesh.vertices, mesh.corners), 125, 1e-11);
  for (std::size_t t = 0; t < mesh.corners.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const auto& across = mesh.corners[result.neighbour[t][i]];
      EXPECT_EQ(std::count(across.begin(), across.end(), mesh.corners[t][i]), 1);
      EXPECT_EQ(std::count(across.begin(), across.end(), mesh.corners[t][(i + 1) % 3]), 1);
    }
}

TEST(Topology, RemovingATriangleOpensThreeEdgesAndFlippingOneMisorientsThree) {
  Mesh mesh = box_mesh(4);
  std::swap(mesh.corners[10][0], mesh.corners[10][1]);
  const auto welded = weld(mesh.vertices);
  EXPECT_EQ(topology(mesh.corners, welded).misoriented_edges, 3u);
  mesh.corners.erase(mesh.corners.begin() + 10);
  const Topology open = topology(mesh.corners, welded);
  EXPECT_EQ(open.open_edges, 3u);
  EXPECT_EQ(open.misoriented_edges, 0u);
}

TEST(Topology, BoxesThatTouchInAnEdgeAreOneShellWithANonManifoldEdge) {
  Mesh mesh = box_mesh(1);
  const Mesh other = box_mesh(1);
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Vec3& v : other.vertices) mesh.vertices.push_back(v + Vec3(1, 1, 0));
  for (auto c : other.corners) mesh.corners.push_back({c[0] + base, c[1] + base, c[2] + base});
  const Topology result = topology(mesh.corners, weld(mesh.vertices));
  EXPECT_EQ(result.non_manifold_edges, 1u);
  EXPECT_EQ(result.open_edges, 0u);
  EXPECT_EQ(result.shell_count, 1u);
}

TEST(Topology, ADegenerateTriangleTakesPartInNothing) {
  Mesh mesh = box_mesh(2);
  mesh.corners.insert(mesh.corners.begin() + 4, {0, 1, 1});
  const Topology result = topology(mesh.corners, weld(mesh.vertices));
  EXPECT_EQ(result.degenerate_triangles, 1u);
  EXPECT_TRUE(result.closed());
  EXPECT_EQ(result.shell_count, 1u);
  EXPECT_EQ(result.shell[4], kNoTriangle);
}

TEST(DihedralRegions, ABoxHasSixWhateverItsOrientation) {
  Mesh mesh = box_mesh(6);
  std::mt19937 random(3);
  for (auto& c : mesh.corners)
    if (random() % 2) std::swap(c[0], c[1]);
  const auto regions =
      dihedral_regions(mesh.vertices, mesh.corners, topology(mesh.corners, weld(mesh.vertices)), 30);
  EXPECT_EQ(std::set(regions.begin(), regions.end()).size(), 6u);
  for (std::size_t t = 0; t < regions.size(); ++t) EXPECT_EQ(regions[t], t / 72);
}

// A needle between two flat triangles has a meaningless normal; it must not cut the face in two, nor join
// faces across an edge.
TEST(DihedralRegions, ANeedleGoesWithTheTriangleAcrossItsLongestEdge) {
  Mesh mesh = box_mesh(1);
  // Triangle 0 is (a, b, c); a new vertex in the middle of its edge (a, b), which the triangle across does
  // not know: a needle of no height fills the gap, turned any way.
  const auto [a, b, c] = mesh.corners[0];
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2 + Vec3(1e-12, -1e-12, 1e-12));
  mesh.corners[0] = {a, middle, c};
  mesh.corners.push_back({middle, b, c});
  mesh.corners.push_back({a, b, middle});
  const Topology result = topology(mesh.corners, weld(mesh.vertices));
  ASSERT_TRUE(result.closed());
  const auto regions = dihedral_regions(mesh.vertices, mesh.corners, result, 30);
  EXPECT_EQ(std::set(regions.begin(), regions.end()).size(), 6u);
}

TEST(SignedVolume, KeepsItsDigitsFarFromTheOrigin) {
  Mesh mesh = box_mesh(3);
  for (Vec3& v : mesh.vertices) v += Vec3(1e6, -2e6, 3e6);
  EXPECT_NEAR(signed_volume(mesh.vertices, mesh.corners), 27, 1e-9);
}

}  // namespace
}  // namespace flexel
