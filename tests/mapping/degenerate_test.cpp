// Bodies at the edge of what is a body: an answer or one clear line, never a number that is none.
#include <gtest/gtest.h>

#include "base/error.h"
#include "mapping/methods/bind.h"
#include "mapping/methods/space_map.h"
#include "mapping/report/report.h"
#include "motions.h"

namespace flexel::mapping {
namespace {

using test::map_quietly;

void expect_numbers(const Body& body, const char* what) {
  for (const MapMethod method : test::kEveryMethod) {
    MapOptions options{method};
    options.check_voronoi = true;
    options.check_intersection = true;
    const MapResult result = map_quietly(body, options);
    for (const Vec3& u : result.displacement) ASSERT_TRUE(u.allFinite()) << what << ", " << name_of(method);
    const MapReport found = report(body, result);
    EXPECT_EQ(found.not_finite, 0u) << what;
    EXPECT_TRUE(std::isfinite(found.largest_strain)) << what << ", " << name_of(method);
    EXPECT_TRUE(std::isfinite(found.rest_residual)) << what;
    EXPECT_TRUE(std::isfinite(found.quality.largest_normal_jump_added)) << what;
    EXPECT_FALSE(report_lines(found).front().empty());
  }
  const SpaceMap space(body);
  SpaceMap::Probe probe(space);
  for (const Vec3& x : body.surface.vertices) ASSERT_TRUE(probe.at(x, 0).position.allFinite()) << what;
}

const std::vector<std::pair<const char*, test::Field>>& fields() {
  static const std::vector<std::pair<const char*, test::Field>> list = {
      {"nothing", [](const Vec3& x) -> Vec3 { return x; }},
      {"turned", test::turn},
      {"all elements in one place", [](const Vec3&) -> Vec3 { return Vec3(1, 2, 3); }},
      {"in a line", [](const Vec3& x) -> Vec3 { return Vec3(x.x() + x.y(), 0, 0); }},
      {"in a plane", [](const Vec3& x) -> Vec3 { return Vec3(x.x(), x.y(), 0); }},
      {"inside out", [](const Vec3& x) -> Vec3 { return -x; }},
      {"huge", [](const Vec3& x) -> Vec3 { return 1e9 * x; }},
      {"tiny", [](const Vec3& x) -> Vec3 { return 1e-12 * x; }},
  };
  return list;
}

TEST(Degenerate, OneElementARowASheetAndABlockGiveNumbers) {
  for (const Placement placement : {Placement::corner, Placement::centre})
    for (const Index3& size : {Index3{1, 1, 1}, {5, 1, 1}, {5, 4, 1}, {3, 3, 3}}) {
      Body body = test::block(size[0], size[1], size[2], 0.1, placement, 4);
      for (const auto& [what, field] : fields()) {
        test::deform(body, field);
        expect_numbers(body, what);
      }
    }
}

TEST(Degenerate, TwoElementsApartGiveNumbers) {
  Body body = test::make_body(
      {}, {0, 0, 0}, {6, 1, 1}, [](const Vec3& p) { return p.x() < 1 || p.x() > 5; }, Placement::centre);
  test::add_box_surface(body, Vec3(0.1, 0.1, 0.1), Vec3(5.9, 0.9, 0.9), 6);
  for (const auto& [what, field] : fields()) {
    test::deform(body, field);
    expect_numbers(body, what);
  }
}

TEST(Degenerate, EveryCellBrokenGivesNumbers) {
  Body body = test::block(3, 3, 2, 0.1, Placement::corner, 5);
  std::fill(body.broken.begin(), body.broken.end(), std::uint8_t{1});
  derive_connections(body);
  for (const auto& [what, field] : fields()) {
    test::deform(body, field);
    expect_numbers(body, what);
  }
}

TEST(Degenerate, AnInvertedCellIsSaidByEveryMethod) {
  Body body = test::block(5, 5, 5, 0.1, Placement::corner, 15);
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e] == Index3{5, 5, 5}) body.position[e] -= Vec3::Constant(0.35);
  for (const MapMethod method : test::kEveryMethod)
    EXPECT_GT(report(body, map_quietly(body, {method})).inverted, 0u);
}

// A part in metres and the same in millimetres, or a thousand times as large.
TEST(Degenerate, TheUnitDoesNotMatter) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = test::round_bar(6, placement);
    test::deform(body, test::bend);
    std::vector<MapResult> ones;
    for (const MapMethod method : test::kEveryMethod) ones.push_back(map_quietly(body, {method}));
    for (const double scale : {1e-3, 25.4, 1e3}) {
      Body other = body;
      other.parts[0].lattice.origin *= scale;
      other.parts[0].lattice.spacing *= scale;
      for (auto* points : {&other.rest, &other.position, &other.surface.vertices})
        for (Vec3& x : *points) x *= scale;
      for (std::size_t m = 0; m < ones.size(); ++m) {
        const MapMethod method = test::kEveryMethod[m];
        const MapResult &one = ones[m], two = map_quietly(other, {method});
        double largest = 0;
        for (std::size_t v = 0; v < one.displacement.size(); ++v)
          largest = std::max(largest, (two.displacement[v] / scale - one.displacement[v]).norm());
        EXPECT_LT(largest, 1e-9 * 8) << scale << ", " << name_of(method);
      }
    }
  }
}

// A block whose surface lies on the faces of its voxels, half of its vertices half-way between elements.
TEST(Degenerate, TheOrderOfThePolygonsDoesNotMatter) {
  Lattice lattice;
  lattice.spacing = Vec3::Constant(0.1);
  Body body = test::make_body(
      lattice, {0, 0, 0}, {6, 4, 4}, [](const Vec3&) { return true; }, Placement::corner);
  test::add_box_surface(body, Vec3::Zero(), Vec3(0.6, 0.4, 0.4), 8);
  Body backwards = body;
  Surface& surface = backwards.surface;
  surface.polygon_offsets = {0};
  surface.polygon_vertices.clear();
  backwards.surface_cell_offsets = {0};
  backwards.surface_cells.clear();
  for (std::size_t p = body.surface.polygon_count(); p-- > 0;) {
    for (const std::uint32_t v : body.surface.polygon(p)) surface.polygon_vertices.push_back(v);
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    for (std::uint32_t s = body.surface_cell_offsets[p]; s < body.surface_cell_offsets[p + 1]; ++s)
      backwards.surface_cells.push_back(body.surface_cells[s]);
    backwards.surface_cell_offsets.push_back(static_cast<std::uint32_t>(backwards.surface_cells.size()));
  }
  const auto field = [](const Vec3& x) -> Vec3 {
    return x + Vec3(x.y() * x.z(), x.x() * x.x(), -x.x() * x.y());
  };
  test::deform(body, field);
  test::deform(backwards, field);
  for (const MapMethod method : test::kEveryMethod)
    EXPECT_EQ(map_quietly(body, {method}).displacement, map_quietly(backwards, {method}).displacement)
        << name_of(method);
}

// The same block, and the mirror image of it and of its motion.
TEST(Degenerate, TheMirroredPartIsMappedToTheMirrorImage) {
  const auto field = [](const Vec3& x) -> Vec3 {
    return x + Vec3(x.y() * x.z(), x.x() * x.x(), -x.x() * x.y());
  };
  const auto mirrored = [](const Vec3& x) -> Vec3 { return {-x.x(), x.y(), x.z()}; };
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Lattice lattice;
    lattice.spacing = Vec3::Constant(0.1);
    const auto make = [&](const Vec3& origin) {
      lattice.origin = origin;
      return test::make_body(
          lattice, {0, 0, 0}, {6, 4, 4}, [](const Vec3&) { return true; }, placement);
    };
    Body body = make(Vec3::Zero()), mirror = make(Vec3(-0.6, 0, 0));
    test::add_box_surface(body, Vec3::Zero(), Vec3(0.6, 0.4, 0.4), 8);
    test::add_box_surface(body, Vec3(0.05, 0.05, 0.05), Vec3(0.55, 0.35, 0.35), 5);
    mirror.surface = body.surface;
    for (Vec3& x : mirror.surface.vertices) x = mirrored(x);
    test::derive_surface_cells(mirror);
    test::deform(body, field);
    test::deform(mirror, [&](const Vec3& x) { return mirrored(field(mirrored(x))); });
    for (const MapMethod method : test::kEveryMethod) {
      const MapResult one = map_quietly(body, {method}), other = map_quietly(mirror, {method});
      double largest = 0;
      for (std::size_t v = 0; v < one.displacement.size(); ++v) {
        // On the part's own plane of symmetry one frame lies on one side of it: in corner placement the first
        // axis of Gram-Schmidt points there, in centre placement the origin lies there.
        const bool symmetric = std::abs(body.surface.vertices[v].x() - 0.3) < 1e-9;
        const bool one_frame =
            method == &kGramSchmidt || (method == &kAffine && placement == Placement::centre);
        if (symmetric && one_frame) continue;
        largest = std::max(largest, (one.displacement[v] - mirrored(other.displacement[v])).norm());
      }
      EXPECT_LT(largest, 1e-8) << name_of(method) << (placement == Placement::corner ? " corner" : " centre");
    }
  }
}

TEST(FarVertices, AreFollowedTurnedOrRefused) {
  Body body = test::block(4, 4, 4, 0.1, Placement::corner, 2);
  const auto far = static_cast<std::uint32_t>(body.surface.vertices.size());
  test::add_surface(body, {Vec3(5, 0.2, 0.2), Vec3(5, 0.3, 0.2), Vec3(5, 0.2, 0.3)}, {{0, 1, 2}});
  const Mat3 turn = test::rotation(0.4, Vec3(0, 0, 1));
  test::deform(body, [&](const Vec3& x) -> Vec3 { return 1.5 * (turn * x); });
  MapOptions options;
  const MapResult followed = map_quietly(body, options);
  EXPECT_NEAR((body.surface.vertices[far] + followed.displacement[far]).norm(),
              1.5 * body.surface.vertices[far].norm(), 1e-9);
  options.far = FarVertices::rigid;
  const MapResult rigid = map_quietly(body, options);
  EXPECT_EQ(rigid.far, 3u);
  const std::uint32_t origin = rigid.frame_of(far).elements[0];
  const Vec3 arm = body.surface.vertices[far] - body.rest[origin];
  EXPECT_LT(
      (body.surface.vertices[far] + rigid.displacement[far] - body.position[origin] - turn * arm).norm(),
      1e-9);
  EXPECT_EQ(rigid.displacement[0], followed.displacement[0]);
  options.far = FarVertices::refuse;
  EXPECT_THROW(map_quietly(body, options), InputError);
  options.far_distance = 100;
  EXPECT_EQ(map_quietly(body, options).displacement, followed.displacement);
}

}  // namespace
}  // namespace flexel::mapping
