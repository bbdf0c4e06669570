// Connections of centre-placed parts: which elements they join, how stiff and how long they are.
#include "simulate/models/connections.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "tests/simulate/centre_body.h"

namespace flexel::simulate {
namespace {

constexpr double kConnectionYoung = 3e6, kConnectionSpacing = 0.25;

testing::CentreOptions turned_voxels() {
  testing::CentreOptions options;
  options.voxels = {3, 4, 2};
  options.spacing = kConnectionSpacing;
  options.axes =
      (Eigen::AngleAxisd(0.3, Vec3::UnitZ()) * Eigen::AngleAxisd(0.7, Vec3::UnitX())).toRotationMatrix();
  return options;
}

Material gum() {
  return {"gum", kConnectionYoung, 0.25, 1000, "test"};
}

TEST(Connections, JoinEveryPairOfNeighboursOnce) {
  const Body body = testing::centre_body(turned_voxels());
  const Problem problem{body, {gum()}, {}, {Model::paper}};
  const Connections connections = make_connections(problem);
  std::set<std::pair<std::uint32_t, std::uint32_t>> expected;
  for (std::uint32_t a = 0; a < body.element_count(); ++a)
    for (std::uint32_t b = a + 1; b < body.element_count(); ++b)
      if ((body.rest[a] - body.rest[b]).norm() < 1.8 * kConnectionSpacing) expected.insert({a, b});
  std::set<std::pair<std::uint32_t, std::uint32_t>> found;
  for (std::size_t c = 0; c < connections.size(); ++c) {
    if (c > 0) {
      EXPECT_LT(std::pair(connections.a[c - 1], connections.b[c - 1]),
                std::pair(connections.a[c], connections.b[c]));
    }
    EXPECT_LT(connections.a[c], connections.b[c]);
    found.insert({connections.a[c], connections.b[c]});
  }
  EXPECT_EQ(found, expected);
}

TEST(Connections, KindsHoldTheRestVectorAndTheHookeConstants) {
  const Body body = testing::centre_body(turned_voxels());
  const double eh = kConnectionYoung * kConnectionSpacing;
  const double paper[] = {0, eh, std::sqrt(2.0) * eh, std::sqrt(3.0) * eh};
  const double ganovelli[] = {0, eh, eh / 6, eh / 12};
  for (const HookeConstant hooke : {HookeConstant::paper, HookeConstant::ganovelli}) {
    const Problem problem{body, {gum()}, {}, {Model::paper}, {hooke}};
    const Connections connections = make_connections(problem);
    const PartConnections& part = connections.parts[0];
    EXPECT_EQ(part.begin, 0u);
    EXPECT_EQ(part.end, connections.size());
    EXPECT_EQ(part.kinds[0].stiffness, 0);
    for (std::size_t c = 0; c < connections.size(); ++c) {
      const ConnectionKind& kind = part.kinds[connections.kind[c]];
      const Vec3 rest = body.rest[connections.b[c]] - body.rest[connections.a[c]];
      EXPECT_LT((kind.rest - rest).norm(), 1e-14);
      EXPECT_NEAR(kind.length, rest.norm(), 1e-14);
      const auto axes = std::lround(std::pow(rest.norm() / kConnectionSpacing, 2));
      EXPECT_NEAR(kind.stiffness, (hooke == HookeConstant::paper ? paper : ganovelli)[axes], 1e-9 * eh);
    }
  }
}

// The six Kuhn tetrahedra about each of a cube's four diagonals, by brute force.
TEST(Connections, GanovelliIsTheSumOverTheTetrahedraOfACube) {
  // Stiffness that one cube contributes to the pair of its corners a and b, in units of E h.
  double sum[4] = {0, 0, 0, 0};
  int pairs[4] = {0, 0, 0, 0};
  const auto axes_of = [](unsigned difference) { return __builtin_popcount(difference); };
  for (unsigned a = 0; a < 8; ++a)
    for (unsigned b = a + 1; b < 8; ++b) ++pairs[axes_of(a ^ b)];
  const unsigned orders[6][3] = {{1, 2, 4}, {1, 4, 2}, {2, 1, 4}, {2, 4, 1}, {4, 1, 2}, {4, 2, 1}};
  for (const unsigned start : {0u, 1u, 2u, 4u})  // one end of each diagonal
    for (const auto& order : orders) {
      const unsigned path[4] = {start, start ^ order[0], start ^ order[0] ^ order[1], start ^ 7u};
      for (int p = 0; p < 4; ++p)
        for (int q = p + 1; q < 4; ++q) {
          const int axes = axes_of(path[p] ^ path[q]);
          sum[axes] += (1.0 / 6) / axes / 4;  // V / l^2, averaged over the diagonals
        }
    }
  // A face connection belongs to four cubes, an edge one to two, a corner one to one.
  const double cubes[4] = {0, 4, 2, 1};
  const Body body = testing::centre_body(turned_voxels());
  const ConnectionKinds kinds = connection_kinds(body.parts[0].lattice, gum(), HookeConstant::ganovelli);
  for (std::size_t kind = 1; kind < kinds.size(); ++kind) {
    const auto axes = std::lround(std::pow(kinds[kind].length / kConnectionSpacing, 2));
    EXPECT_NEAR(kinds[kind].stiffness,
                cubes[axes] * sum[axes] / pairs[axes] * kConnectionYoung * kConnectionSpacing,
                1e-9 * kConnectionYoung * kConnectionSpacing);
  }
}

TEST(Connections, LeaveOutStrayElementsAndMissingBits) {
  Body body = testing::centre_body(turned_voxels());
  Problem problem{body, {gum()}, {}, {Model::paper}};
  const std::size_t all = make_connections(problem).size();
  problem.stray_element.assign(body.element_count(), 0);
  problem.stray_element[0] = 1;
  EXPECT_EQ(make_connections(problem).size(), all - 7);  // a corner of the box has seven neighbours
  problem.stray_element[0] = 0;
  problem.stray_element.back() = 1;
  EXPECT_EQ(make_connections(problem).size(), all - 7);
  problem.stray_element.clear();
  body.connections[0] &= ~1u;
  EXPECT_EQ(make_connections(problem).size(), all - 1);
}

}  // namespace
}  // namespace flexel::simulate
