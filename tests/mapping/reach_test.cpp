// Which elements a vertex may use: against a search by brute force, and at slits.
#include "mapping/anchors/connected_neighbourhood.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "mapping/anchors/blend_weights.h"
#include "mapping/methods/apply.h"
#include "mapping/methods/bind.h"
#include "motions.h"

namespace flexel::mapping {
namespace {

// Connections from `from` to every element; a large number where there is no way.
std::vector<int> steps_from(const Adjacency& connections, std::uint32_t from) {
  std::vector<int> steps(connections.offsets.size() - 1, 1000);
  std::vector<std::uint32_t> queue{from};
  steps[from] = 0;
  for (std::size_t i = 0; i < queue.size(); ++i)
    for (const std::uint32_t next : connections.of(queue[i]))
      if (steps[next] == 1000) {
        steps[next] = steps[queue[i]] + 1;
        queue.push_back(next);
      }
  return steps;
}

TEST(Reach, IsWhatAFewConnectionsJoin) {
  std::mt19937 random(7);
  Body body = test::block(9, 8, 7, 0.1, Placement::corner);
  for (std::uint8_t& broken : body.broken) broken = random() % 3 == 0;
  const Adjacency connections = element_adjacency(body);
  ReachFinder finder(connections);
  for (std::size_t c = 0; c < body.cell_count(); c += 17)
    for (const int steps : {1, 2, 3}) {
      const auto& anchors = body.cell_elements[c];
      const Reach& reach = finder.find(anchors, steps);
      std::vector<int> from(body.element_count(), 0);
      for (std::size_t i = 0; i < reach.elements.size(); ++i) from[reach.elements[i]] = reach.from[i];
      for (std::size_t a = 0; a < 8; ++a) {
        EXPECT_EQ(reach.elements[a], anchors[a]);
        const std::vector<int> away = steps_from(connections, anchors[a]);
        for (std::size_t e = 0; e < away.size(); ++e) EXPECT_EQ(from[e] >> a & 1, away[e] <= steps);
      }
    }
}

// A block slit along x = 0.6 from the top: the leaves move apart, each as a whole.
Body slit_block() {
  Body body = test::make_body(
      {Vec3::Zero(), Mat3::Identity(), Vec3::Constant(0.1)}, {0, 0, 0}, {12, 4, 10},
      [](const Vec3&) { return true; }, Placement::corner);
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    const Index3& at = body.lattice_index[body.cell_elements[c][0]];
    body.broken[c] = at[0] == 6 && at[2] >= 3;
  }
  derive_connections(body);
  test::add_box_surface(body, Vec3::Constant(0.003), Vec3(1.197, 0.397, 0.997), 30);
  return body;
}

TEST(Reach, LeavesOfASlitDoNotFeelEachOther) {
  Body body = slit_block();
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] >= 7) body.position[e] += Vec3(0.05, 0, 0);
  for (const MapMethod method : test::kEveryMethod) {
    const std::vector<Vec3> displacement = apply(bind(body, method), body, body.position);
    for (std::size_t v = 0; v < displacement.size(); ++v) {
      const Vec3& x = body.surface.vertices[v];
      if (x.z() < 0.3 + 0.1 * (kSmoothSteps + 1)) continue;  // near the root the leaves are joined
      const double moved = displacement[v].x();
      EXPECT_TRUE(std::abs(moved) < 1e-12 || std::abs(moved - 0.05) < 1e-12)
          << name_of(method) << " " << moved << " at " << x.transpose();
    }
  }
}

TEST(Reach, NothingJumpsAtTheRootOfASlit) {
  Body body = slit_block();
  body.surface = {};
  // A fine line of vertices down one leaf, past the root, beside the slit.
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> triangles;
  constexpr std::uint32_t kPoints = 4000;
  for (std::uint32_t i = 0; i < kPoints; ++i) vertices.emplace_back(0.58, 0.21, 0.95 - 0.9 * i / kPoints);
  for (std::uint32_t i = 0; i + 2 < kPoints; ++i) triangles.push_back({i, i + 1, i + 2});
  test::add_surface(body, vertices, triangles);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] >= 7)
      body.position[e] += Vec3(0.5, 0, 0) * std::max(body.rest[e].z() - 0.3, 0.0);
  const std::vector<Vec3> displacement = apply(bind(body, &kBlended), body, body.position);
  for (std::uint32_t i = 0; i + 1 < kPoints; ++i)
    EXPECT_LT((displacement[i + 1] - displacement[i]).norm(), 3 * 0.9 / kPoints) << vertices[i].z();
}

}  // namespace
}  // namespace flexel::mapping
