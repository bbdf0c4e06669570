// Broken surfaces: what is healed, what is judged by samples, what is refused.
#include "voxelize/heal/heal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/sanitized.h"
#include "tests/voxelize/damage.h"
#include "voxelize/classify/inside_consensus.h"
#include "voxelize/classify/winding.h"
#include "voxelize/heal/heal_cgal.h"
#include "voxelize/heal/heal_mesh.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;
using testing::Test;

VoxelizeResult run_healed(const Mesh& mesh, double size, Heal heal) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = size;
  options.align = Align::none;
  options.heal = {heal};
  VoxelizeResult result = voxelize(surface(mesh), options, progress);
  check(result.body, "test");
  return result;
}

PartMesh part(const Mesh& mesh) {
  return std::move(exact_part_meshes(surface(mesh))[0]);
}

std::string refusal(const Mesh& mesh, double size, Heal heal = Heal::automatic) {
  try {
    run_healed(mesh, size, heal);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Heal, ACleanMeshIsLeftAlone) {
  const Mesh mesh = merged(torus(1, .3, 24, 12), inverted(torus(1, .1, 24, 12)));
  const HealedPart healed = heal(part(mesh), {Heal::automatic}, "part");
  EXPECT_TRUE(healing_lines(healed.done).empty());
  EXPECT_TRUE(healed.original.corners.empty());
  EXPECT_EQ(healed.mesh.corners, part(mesh).corners);
}

// But for the polygons' orientation (outward_test.cpp).
void expect_own_surface(const VoxelizeResult& result, const Mesh& mesh) {
  const Surface before = surface(mesh), &after = result.body.surface;
  EXPECT_EQ(after.vertices, before.vertices);
  EXPECT_EQ(after.polygon_offsets, before.polygon_offsets);
  for (std::size_t p = 0; p < before.polygon_count(); ++p)
    EXPECT_TRUE(std::is_permutation(before.polygon(p).begin(), before.polygon(p).end(),
                                    after.polygon(p).begin(), after.polygon(p).end()));
  EXPECT_EQ(result.body.surface_cell_offsets.size(), before.polygon_offsets.size());
}

TEST(Heal, TheSurfaceThatComesOutIsTheUsersOwn) {
  for (const int kind : {0, 1, 2, 3, 4, 5, 8}) {
    const Mesh broken = Damager(torus(1, .3, 48, 24), 5).damaged(kind, 0);
    expect_own_surface(run(broken, .1), broken);
  }
}

// One triangle missing has one way to be filled: the volume is the clean one's to rounding, and no triangle
// is turned for it.
TEST(Heal, MissingTrianglesAreFilledExactly) {
  const Mesh ball = icosphere(3, 1);
  Mesh mesh = ball;
  mesh.triangles.erase(mesh.triangles.begin() + 700);
  mesh.triangles.erase(mesh.triangles.begin() + 100);
  const VoxelizeResult result = run(mesh, .1);
  const Healing& done = result.parts[0].healing;
  EXPECT_EQ(done.open_edges, 6u);
  EXPECT_EQ(done.holes, 2u);
  EXPECT_EQ(done.hole_triangles, 2u);
  EXPECT_EQ(done.flipped_facets, 0u);
  EXPECT_TRUE(result.parts[0].closed);
  EXPECT_NEAR(total_volume(result) / volume(ball), 1, 1e-9);
  EXPECT_THAT(healing_lines(done),
              testing::ElementsAre(testing::StartsWith("2 holes filled with 2 triangles")));
}

TEST(Heal, HolesThatTouchInAVertexComeApart) {
  const Mesh ball = icosphere(2, 1);
  Mesh mesh = ball;
  const auto [a, b, c] = ball.triangles[10];
  std::size_t second = 0;  // shares one vertex with triangle 10
  for (std::size_t t = 0; t < ball.triangles.size() && second == 0; ++t) {
    int shared = 0;
    for (const std::uint32_t v : ball.triangles[t]) shared += v == a || v == b || v == c;
    if (shared == 1) second = t;
  }
  ASSERT_GT(second, 0u);
  mesh.triangles.erase(mesh.triangles.begin() +
                       static_cast<std::ptrdiff_t>(std::max<std::size_t>(10, second)));
  mesh.triangles.erase(mesh.triangles.begin() +
                       static_cast<std::ptrdiff_t>(std::min<std::size_t>(10, second)));
  const VoxelizeResult result = run(mesh, .1);
  EXPECT_EQ(result.parts[0].healing.holes, 2u);
  EXPECT_NEAR(total_volume(result) / volume(ball), 1, 1e-9);
}

TEST(Heal, CracksOfFloatNoiseAreWelded) {
  const Mesh ball = icosphere(3, 1);
  const Mesh cracked = Damager(ball, 3).damaged(4, 0);
  const Healing done = run(cracked, .1).parts[0].healing;
  EXPECT_EQ(done.welded_edges, 3 * ball.triangles.size());
  EXPECT_EQ(done.left_open, 0u);
}

TEST(Heal, RepeatedFacetsAndFinsAreLeftOut) {
  const Mesh ball = icosphere(3, 1);
  for (const int kind : {2, 5}) {
    const Mesh broken = Damager(ball, 11).damaged(kind, 0);
    const VoxelizeResult result = run(broken, .1);
    const Healing& done = result.parts[0].healing;
    EXPECT_EQ(done.fins + done.duplicate_facets, broken.triangles.size() - ball.triangles.size());
    EXPECT_NEAR(total_volume(result) / volume(ball), 1, 1e-9) << kDamages[kind];
  }
}

// A wall inside matter that is there twice, once each way, encloses nothing: both go.
TEST(Heal, ADoubleMembraneInsideMatterGoes) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.triangles.push_back({0, 3, 4});
  mesh.triangles.push_back({0, 4, 3});
  PartMesh mended = part(mesh);
  EXPECT_EQ(drop_duplicates(mended), 2u);
  EXPECT_EQ(mended.corners.size(), 12u);
}

TEST(Heal, WindingNumbersAreWholeAndMatchBruteForce) {
  std::mt19937 random(23);
  const Mesh mesh = transformed(torus(1, .3, 60, 30), random_rotation(random));
  const PartMesh torus_part = part(mesh);
  const WindingNumber winding(torus_part, torus_part.world);
  std::uniform_real_distribution<double> coordinate(-1.4, 1.4);
  for (int n = 0; n < 300; ++n) {
    const Vec3 at(coordinate(random), coordinate(random), coordinate(random));
    double exact = 0;
    for (const Corners& c : torus_part.corners) {
      const Vec3 p = torus_part.world[c[0]] - at, q = torus_part.world[c[1]] - at,
                 r = torus_part.world[c[2]] - at;
      exact += 2 * std::atan2(p.dot(q.cross(r)), p.norm() * q.norm() * r.norm() + p.dot(q) * r.norm() +
                                                     q.dot(r) * p.norm() + r.dot(p) * q.norm());
    }
    EXPECT_NEAR(winding.at(at), exact / (4 * std::numbers::pi), .05);
  }
}

TEST(Heal, SoupIsJudgedWithinOnePercent) {
  const Mesh mesh = torus(1, .3, 96, 48);
  for (const double degree : {0., .5}) {
    const VoxelizeResult result = run(Damager(mesh, 3).damaged(3, degree), .08);
    EXPECT_FALSE(result.parts[0].closed);
    EXPECT_NEAR(total_volume(result) / volume(mesh), 1, .01);
    EXPECT_EQ(component_count(result.body), 1u);
  }
}

TEST(Heal, ASheetIsRefusedByName) {
  Mesh sheet = box({0, 0, 0}, {1, 1, 1});
  sheet.triangles.resize(2);
  EXPECT_THAT(refusal(sheet, .1), testing::HasSubstr("is a sheet with 4 open edges"));
  EXPECT_THAT(refusal(sheet, .1, Heal::wrap), testing::HasSubstr("a sheet"));
}

TEST(Heal, ALargeHoleIsRefusedWithItsPlace) {
  Mesh open_box = box({0, 0, 0}, {1, 1, 1});
  open_box.triangles.erase(open_box.triangles.begin(), open_box.triangles.begin() + 2);
  const std::string message = refusal(open_box, .1);
  EXPECT_THAT(message, testing::HasSubstr("4 open edges, the largest hole 1.41 m wide"));
  EXPECT_THAT(message, testing::HasSubstr("--heal \"wrap:1.56 m\""));  // tried
  EXPECT_THAT(refusal(open_box, .1, Heal::wrap), testing::HasSubstr("an opening 1.41 m wide"));
  Mesh bitten = icosphere(4, 1);
  std::erase_if(bitten.triangles, [&](const auto& t) { return bitten.vertices[t[0]].z() > .7; });
  EXPECT_THAT(refusal(bitten, .1), testing::HasSubstr("the largest hole"));
}

// Walls inside matter have no outside: three triangles meet at their rims, and no edge is open.
TEST(Heal, EdgesOfManyTrianglesAreNotCalledOpen) {
  Mesh cells = box({0, 0, 0}, {1, 1, 1});
  cells.triangles.push_back({1, 2, 6});
  cells.triangles.push_back({1, 6, 5});
  const HealedPart healed = heal(part(cells), {Heal::automatic}, "part");
  const std::string message = undecided({{"part", "part.stl", &healed}}, 1).what();
  EXPECT_THAT(message, testing::HasSubstr("4 edges where more than two triangles meet"));
  EXPECT_THAT(message, testing::Not(testing::HasSubstr("open edge")));
  EXPECT_THAT(message, testing::EndsWith("take a wrap of it: --heal wrap"));
  EXPECT_GT(total_volume(run_healed(cells, less_if_sanitized(.2, .4, "cells twice as large"), Heal::wrap)),
            1);  // as advised
}

// All that is wrong, in one go.
TEST(Heal, OpenPartsAreRefusedTogether) {
  Mesh open_box = box({0, 0, 0}, {1, 1, 1});
  open_box.triangles.erase(open_box.triangles.begin(), open_box.triangles.begin() + 2);
  Surface parts = surface(open_box);
  for (int n = 1; n < 7; ++n)
    append(parts, surface(transformed(n == 3 ? box({0, 0, 0}, {1, 1, 1}) : open_box, Mat3::Identity(),
                                      {2. * n, 0, 0})));
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = .2;
  try {
    static_cast<void>(voxelize(parts, options, progress));
    FAIL() << "not refused";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("in 6 of 7 parts: \"part\" (4 open edges"));
    EXPECT_THAT(error.what(), testing::HasSubstr("\"part-5\""));
    EXPECT_THAT(error.what(), testing::HasSubstr(" and 2 more; close them"));
    EXPECT_THAT(error.what(), testing::HasSubstr("--heal wrap closes 0 of the 6 tried"));
  }
}

// A ring of which a piece was torn out: two small holes, and an eighth of the volume missing between them.
TEST(Heal, AJaggedEndIsNotTakenForTheWholePart) {
  Mesh torn = torus(1, .1, 192, 24);
  std::erase_if(torn.triangles, [&](const auto& t) {
    const Vec3 at = (torn.vertices[t[0]] + torn.vertices[t[1]] + torn.vertices[t[2]]) / 3;
    const double angle = std::atan2(at.y(), at.x());
    const double shift = at.z() > 0 ? .3 : 0;
    return angle > shift && angle < .8 + shift;
  });
  EXPECT_THAT(refusal(torn, .05), testing::HasSubstr("the largest hole"));
  // Cut off in planes it is what any part that lost two flat faces looks like.
  Mesh cut = torus(1, .1, 192, 24);
  std::erase_if(cut.triangles, [&](const auto& t) {
    const auto inside = [&](std::uint32_t v) {
      const double angle = std::atan2(cut.vertices[v].y(), cut.vertices[v].x());
      return angle > -1e-9 && angle < .8;
    };
    return inside(t[0]) && inside(t[1]) && inside(t[2]);
  });
  EXPECT_EQ(run_healed(cut, .05, Heal::automatic).parts[0].healing.holes, 2u);
}

TEST(Heal, WrapSurroundsWhatIsThere) {
  const Mesh whole = icosphere(less_if_sanitized(3, 2, "a sphere of fewer triangles"), 1);
  Mesh mesh = whole;
  mesh.triangles.erase(mesh.triangles.begin() + 5);
  const VoxelizeResult result = run_healed(mesh, sanitized() ? .2 : .1, Heal::wrap);
  const Healing& done = result.parts[0].healing;
  EXPECT_TRUE(done.wrapped);
  expect_own_surface(result, mesh);
  // Every polygon finds the cells under it, though the lattice was made of the wrap.
  const auto& ends = result.body.surface_cell_offsets;
  for (std::size_t p = 0; p + 1 < ends.size(); ++p) EXPECT_GT(ends[p + 1], ends[p]) << p;
  const double ratio = total_volume(result) / volume(whole);
  EXPECT_GT(ratio, 1);                          // the wrap lies outside
  EXPECT_LT(ratio, sanitized() ? 1.04 : 1.02);  // by a thirtieth of alpha
}

TEST(Heal, NoneTakesTheSurfaceAsItIs) {
  EXPECT_THAT(refusal(inverted(icosphere(2, 1)), .2, Heal::none), testing::HasSubstr("inside out"));
  const Mesh ball = icosphere(2, 1);
  EXPECT_NEAR(total_volume(run_healed(ball, .2, Heal::none)) / volume(ball), 1, 1e-9);
}

// A short form of bench_heal: no result is more than 5 % wrong, and what the acceptance test names is within
// 1 %.
TEST(Heal, DamageIsHealedOrRefused) {
  const Mesh meshes[] = {torus(1, .3, 96, 48), merged(icosphere(3, 1), inverted(icosphere(2, .6)))};
  const auto degrees = less_if_sanitized<std::vector<double>>({0, .6}, {.6}, "one degree of two");
  for (int trial = 0; trial < 2 * kDamageCount; ++trial) {
    const Mesh& mesh = meshes[trial % 2];
    const int kind = trial / 2;
    if (kind % 2 != trial % 2) continue;  // each to one mesh
    for (const double degree : degrees) {
      const Mesh broken = Damager(mesh, static_cast<unsigned>(trial)).damaged(kind, degree);
      try {
        const double ratio = total_volume(run(broken, .15)) / volume(mesh);
        EXPECT_NEAR(ratio, 1, degree == 0 && kind <= 3 ? .01 : .05) << kDamages[kind] << ' ' << degree;
      } catch (const InputError&) {
      }
    }
  }
}

}  // namespace
}  // namespace flexel::voxelize
