#include "formats/lattice/body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "formats/lattice/body_moments.h"
#include "formats/lattice/cell_moments.h"
#include "formats/lattice/merge.h"
#include "tests/formats/bodies.h"

namespace flexel {
namespace {

using testing::HasSubstr;

// The connections by definition: all pairs, no shortcut.
std::vector<std::set<std::uint32_t>> connected(const Body& body) {
  std::vector<std::set<std::uint32_t>> result(body.element_count());
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    for (const std::uint32_t a : body.cell_elements[c])
      for (const std::uint32_t b : body.cell_elements[c])
        if (a != b && body.broken[c] == 0) result[a].insert(b);
  for (const Part& part : body.parts) {
    if (part.placement != Placement::centre) continue;
    for (std::uint32_t a = part.element_begin; a < part.element_end; ++a)
      for (std::uint32_t b = part.element_begin; b < part.element_end; ++b)
        for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
          const Index3 &x = body.lattice_index[a], &y = body.lattice_index[b], &d = half_neighbourhood[bit];
          if ((body.connections[a] >> bit & 1) != 0 && y == Index3{x[0] + d[0], x[1] + d[1], x[2] + d[2]}) {
            result[a].insert(b);
            result[b].insert(a);
          }
        }
  }
  return result;
}

TEST(BodyGraph, AdjacencyIsWhatTheDefinitionSays) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Body body = test::random_body(seed);
    const Adjacency adjacency = element_adjacency(body);
    const auto expected = connected(body);
    ASSERT_EQ(adjacency.offsets.size(), body.element_count() + 1);
    for (std::uint32_t e = 0; e < body.element_count(); ++e) {
      const auto row = adjacency.of(e);
      EXPECT_EQ(std::vector<std::uint32_t>(row.begin(), row.end()),
                std::vector<std::uint32_t>(expected[e].begin(), expected[e].end()))
          << "element " << e;
    }
  }
}

TEST(BodyGraph, DerivedBitsAreTheConnectionsOfTheCells) {
  const Body body = test::random_body(11);
  const auto expected = connected(body);
  std::size_t pairs = 0, bits = 0;
  for (const auto& row : expected) pairs += row.size();
  for (std::uint32_t a = 0; a < body.element_count(); ++a) {
    bits += static_cast<std::size_t>(__builtin_popcount(body.connections[a]));
    for (const std::uint32_t b : expected[a]) {
      const Index3 &x = body.lattice_index[a], &y = body.lattice_index[b];
      const Index3 d = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
      const auto bit =
          std::find(half_neighbourhood.begin(), half_neighbourhood.end(), d) - half_neighbourhood.begin();
      const bool own = bit < std::ptrdiff_t{13};  // else it is b's
      EXPECT_TRUE(!own || (body.connections[a] >> bit & 1) != 0);
    }
  }
  EXPECT_EQ(2 * bits, pairs) << "no bit without a connection";
}

TEST(BodyGraph, BreakingACellCutsOnlyWhatNoOtherCellHolds) {
  std::mt19937_64 random(1);
  Body body;
  test::add_corner_part(body, Part{}, {{0, 0, 0}, {0, 0, 1}}, random);
  body.broken = {1, 0};
  derive_connections(body);
  const Adjacency adjacency = element_adjacency(body);
  std::size_t alone = 0;
  for (std::uint32_t e = 0; e < body.element_count(); ++e) alone += adjacency.of(e).empty() ? 1 : 0;
  EXPECT_EQ(alone, 4u) << "the far face of the broken cell";
  body.broken = {1, 1};
  derive_connections(body);
  EXPECT_EQ(std::count(body.connections.begin(), body.connections.end(), 0u), 12);
  EXPECT_TRUE(element_adjacency(body).neighbours.empty());
}

TEST(BodyGraph, HalfNeighbourhoodAndItsOppositesAreThe26) {
  std::set<Index3> all;
  for (const Index3& d : half_neighbourhood) {
    all.insert(d);
    all.insert({-d[0], -d[1], -d[2]});
  }
  EXPECT_EQ(all.size(), 26u);
  EXPECT_EQ(all.count({0, 0, 0}), 0u);
}

TEST(BodyParts, FollowTheRanges) {
  const Body body = test::random_body(2);
  const auto elements = element_parts(body), cells = cell_parts(body);
  ASSERT_EQ(elements.size(), body.element_count());
  ASSERT_EQ(cells.size(), body.cell_count());
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    for (const std::uint32_t e : body.cell_elements[c]) EXPECT_EQ(elements[e], cells[c]);
}

std::string check_failure(const Body& body) {
  try {
    check(body, "x.vtu");
  } catch (const InputError& error) {
    EXPECT_EQ(error.where(), "x.vtu");
    return error.what();
  }
  return "";
}

TEST(BodyCheck, GoodBodiesPass) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) EXPECT_EQ(check_failure(test::random_body(seed)), "");
}

TEST(BodyCheck, EachFieldThatIsWrongIsNamed) {
  struct Case {
    std::string field;
    std::function<void(Body&)> damage;
  };
  const std::uint32_t none = 0xffffffffu;
  const std::vector<Case> cases = {
      {"parts is empty", [](Body& b) { b.parts.clear(); }},
      {"lattice_index has", [](Body& b) { b.lattice_index.pop_back(); }},
      {"piece has", [](Body& b) { b.piece.push_back(0); }},
      {"position has", [](Body& b) { b.position.pop_back(); }},
      {"connections has", [](Body& b) { b.connections.clear(); }},
      {"fill has", [](Body& b) { b.fill.pop_back(); }},
      {"broken has", [](Body& b) { b.broken.pop_back(); }},
      {"parts[1].element_begin", [](Body& b) { ++b.parts[1].element_begin; }},
      {"parts[0].element_begin", [](Body& b) { b.parts[0].element_begin = 1; }},
      {"parts: their elements", [](Body& b) { --b.parts[2].element_end; }},
      {"parts: their cells", [](Body& b) { --b.parts[2].cell_end; }},
      {"parts[0] has cells", [](Body& b) { b.parts[0].placement = Placement::centre; }},
      {"parts[0].lattice.origin", [](Body& b) { b.parts[0].lattice.origin.x() = std::nan(""); }},
      {"parts[1].lattice.spacing", [](Body& b) { b.parts[1].lattice.spacing.z() = 0; }},
      {"parts[1].lattice.spacing", [](Body& b) { b.parts[1].lattice.spacing.z() = INFINITY; }},
      {"parts[2].lattice.axes", [](Body& b) { b.parts[2].lattice.axes *= 1.001; }},
      {"parts[2].lattice.axes", [](Body& b) { b.parts[2].lattice.axes.col(0) *= -1; }},
      {"parts[2].lattice.axes", [](Body& b) { b.parts[2].lattice.axes(1, 1) = std::nan(""); }},
      {"parts[0].surface_volume", [](Body& b) { b.parts[0].surface_volume = INFINITY; }},
      {"rest[7]", [](Body& b) { b.rest[7].y() = INFINITY; }},
      {"position[0]", [](Body& b) { b.position[0].z() = std::nan(""); }},
      {"fill[3]", [](Body& b) { b.fill[3] = 0; }},
      {"fill[3]", [](Body& b) { b.fill[3] = std::nan(""); }},
      {"fill[3]", [](Body& b) { b.fill[3] = 1.0000001; }},
      {"broken[0]", [](Body& b) { b.broken[0] = 2; }},
      {"connections[4]", [](Body& b) { b.connections[4] = 1u << 13; }},
      {"lattice_index[9]", [](Body& b) { b.lattice_index[9] = b.lattice_index[8]; }},
      {"lattice_index[0]", [](Body& b) { b.lattice_index[0][0] = INT32_MIN; }},
      {"cell_elements[0] names", [=](Body& b) { b.cell_elements[0][5] = none; }},
      {"cell_elements[0] names", [](Body& b) { b.cell_elements[0][5] = b.parts[2].element_begin; }},
      {"cell_elements[1] is not a voxel",
       [](Body& b) { std::swap(b.cell_elements[1][0], b.cell_elements[1][1]); }},
      {"is before the cell before", [](Body& b) { std::swap(b.cell_elements[0], b.cell_elements[1]); }},
      {"\"velocity\"", [](Body& b) { b.element_columns["velocity"].values.pop_back(); }},
      {"\"velocity\"", [](Body& b) { b.element_columns["velocity"].components = 0; }},
      {"von_mises[2]", [](Body& b) { b.cell_columns["von_mises"].values[2] = std::nan(""); }},
      {"surface_cell_offsets", [](Body& b) { b.surface_cell_offsets.pop_back(); }},
      {"surface_cell_offsets", [](Body& b) { b.surface_cell_offsets[2] = none; }},
      {"surface_cell_offsets[0]", [](Body& b) { b.surface_cell_offsets[0] = 1; }},
      {"surface_cells", [](Body& b) { b.surface_cells.pop_back(); }},
      {"surface_cells", [=](Body& b) { b.surface_cells[0] = none; }},
      {"surface_cells", [](Body& b) { b.surface_cells[1] = b.surface_cells[0]; }},
      {"surface_cells", [](Body& b) { b.surface_cell_offsets.clear(); }},
      {"moments has", [](Body& b) { b.moments.pop_back(); }},
      {"moments has", [](Body& b) { b.moment_cells.clear(); }},
      {"moment_cells[1]", [](Body& b) { b.moment_cells[1] = b.moment_cells[0]; }},
      {"moment_cells[1]", [=](Body& b) { b.moment_cells[1] = none; }},
      {"moments[7] is not finite", [](Body& b) { b.moments[7] = std::nan(""); }},
      {"moments of moment_cells[2] do not add up", [](Body& b) { b.moments[2 * kMoments] += 1e-5; }},
      {"parts[1].name", [](Body& b) { b.parts[1].name = "other"; }},
  };
  for (const Case& c : cases) {
    Body body = test::random_body(4);
    c.damage(body);
    EXPECT_THAT(check_failure(body), HasSubstr(c.field));
  }
}

// A cell without moments is whole, or the body has not all of them.
void complete_moments(Body& body) {
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (!std::binary_search(body.moment_cells.begin(), body.moment_cells.end(), c)) body.fill[c] = 1;
}

TEST(BodyMoments, OfMergedBodiesFollowTheirCells) {
  Body first = test::random_body(2), second = test::random_body(3);
  EXPECT_FALSE(has_all_moments(first));
  complete_moments(first);
  complete_moments(second);
  EXPECT_TRUE(has_all_moments(first));
  Body both = first;
  append(both, second);
  check(both, "both");
  EXPECT_TRUE(has_all_moments(both));
  ASSERT_EQ(both.moment_cells.size(), first.moment_cells.size() + second.moment_cells.size());
  EXPECT_EQ(both.moment_cells.back(), first.cell_count() + second.moment_cells.back());
  EXPECT_EQ(both.moments.back(), second.moments.back());
  for (const bool of_first : {true, false}) {  // one of them was made without
    Body one = first, other = second;
    (of_first ? one : other).moment_cells.clear();
    (of_first ? one : other).moments.clear();
    for (double& fill : (of_first ? one : other).fill) fill = std::min(fill, 0.5);
    append(one, other);
    check(one, "one");
    EXPECT_FALSE(has_all_moments(one));
    EXPECT_EQ(one.moment_cells.size(), (of_first ? second : first).moment_cells.size());
  }
}

TEST(BodyMoments, StayWithCellsThatAreRenumbered) {
  Body body = test::random_body(5);
  const Body before = body;
  constexpr std::uint32_t kGone = 0xffffffffu;
  std::vector<std::uint32_t> number;
  std::uint32_t next = 0;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) number.push_back(c % 3 == 1 ? kGone : next++);
  renumber_moments(body, number, kGone);
  std::size_t kept = 0;
  for (std::size_t n = 0; n < before.moment_cells.size(); ++n) {
    if (number[before.moment_cells[n]] == kGone) continue;
    ASSERT_LT(kept, body.moment_cells.size());
    EXPECT_EQ(body.moment_cells[kept], number[before.moment_cells[n]]);
    EXPECT_TRUE(std::equal(before.moments.begin() + kMoments * n, before.moments.begin() + kMoments * (n + 1),
                           body.moments.begin() + kMoments * kept));
    ++kept;
  }
  EXPECT_EQ(kept, body.moment_cells.size());
  EXPECT_EQ(body.moments.size(), kMoments * kept);
}

TEST(CellMoments, OfAWholeCellIntegratePolynomials) {
  const CellMoments whole = whole_moments();
  for (int a = 0; a <= 4; ++a)
    for (int b = 0; b <= 4; ++b) {
      double sum = 0;
      for (std::size_t k = 0; k < kMoments; ++k)
        sum += whole[k] * std::pow(kGaussPoints[k % 5], a) * std::pow(kGaussPoints[k / 25], b);
      EXPECT_NEAR(sum, 1. / (a + 1) / (b + 1), 1e-15);
    }
}

}  // namespace
}  // namespace flexel
