// Surfaces of a few large triangles on bodies whose motion is known: what splitting them makes of it.
#include "mapping/refine/refine.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/parallel.h"
#include "formats/exchange/surface_file.h"
#include "formats/part/near_weld.h"
#include "formats/part/topology.h"
#include "mapping/map_refined.h"
#include "mapping/report/chord.h"
#include "motions.h"
#include "tests/sanitized.h"

namespace flexel::mapping {
namespace {

using test::silent;
using Mode = RefineOptions::Mode;

using test::coarse_bar, test::kBarLength, test::kBarSide;

constexpr double kAngle = 1;  // over the length of the bar

Vec3 rolled(const Vec3& p) {
  return test::along_circle(p, kAngle, kBarSide / 2);
}

Topology topology_of(const Surface& surface) {
  return topology(triangulate(surface).corners, weld(surface.vertices));
}

double volume(const Surface& surface, const std::vector<Vec3>& displacement) {
  std::vector<Vec3> moved = surface.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += displacement[v];
  return signed_volume(moved, triangulate(surface).corners);
}

std::vector<double> areas_of_faces(const Surface& surface) {
  std::vector<double> areas(surface.faces.size());
  const Triangles triangles = triangulate(surface);
  for (std::size_t t = 0; t < triangles.corners.size(); ++t) {
    const auto& [a, b, c] = triangles.corners[t];
    const std::vector<Vec3>& at = surface.vertices;
    areas[surface.polygon_face[triangles.polygon[t]]] += (at[b] - at[a]).cross(at[c] - at[a]).norm() / 2;
  }
  return areas;
}

MappedPart map_it(Body& body, const RefineOptions& refine, MapMethod method = &kBlended) {
  return map_refined(body, MapOptions{method}, {}, refine, nullptr, {}, silent());
}

class RefinedBar : public testing::TestWithParam<MapMethod> {};

TEST_P(RefinedBar, LiesOnTheArcAndKeepsItsVolume) {
  Body body = coarse_bar();
  test::deform(body, rolled);
  const MappedPart coarse = map_it(body, {Mode::off}, GetParam()), fine = map_it(body, {}, GetParam());
  const double exact = signed_volume(body.surface.vertices, triangulate(body.surface).corners);
  EXPECT_LT(volume(body.surface, coarse.result.displacement), 0.95 * exact);
  ASSERT_TRUE(fine.refined);
  EXPECT_NEAR(volume(*fine.refined, fine.result.displacement) / exact, 1, 0.003);
  EXPECT_TRUE(fine.report.valid());
  EXPECT_EQ(fine.report.chord->coarse_triangles, 0u);
  EXPECT_LE(fine.report.chord->share(), 1.01 * kRefinedShare);
  EXPECT_EQ(fine.report.split_from, 12u);
  // Midpoints of edges too, so triangles are flat only where the arc is.
  const Surface& surface = *fine.refined;
  const double tolerance = 0.02 * kBarSide;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = surface.polygon(p)[i], b = surface.polygon(p)[(i + 1) % 3];
      const Vec3 middle = 0.5 * (surface.vertices[a] + surface.vertices[b]);
      const Vec3 mapped = middle + 0.5 * (fine.result.displacement[a] + fine.result.displacement[b]);
      const Vec3 off = mapped - rolled(middle);
      // Across the arc; along it and across the bar it may slide on its own side.
      const Vec3 outwards = (mapped - Vec3(0, mapped.y(), kBarLength / kAngle + kBarSide / 2)).normalized();
      const bool on_side = std::abs(std::abs(middle.y() - kBarSide / 2) - kBarSide / 2) < 0.01 * kBarSide;
      if (!on_side) {
        EXPECT_LT(std::abs(off.dot(outwards)), tolerance) << middle.transpose();
      }
    }
}

TEST_P(RefinedBar, StaysClosedAndKeepsVerticesAndFaces) {
  Body body = coarse_bar();
  test::deform(body, rolled);
  const Surface before = body.surface;
  const MappedPart coarse = map_it(body, {Mode::off}, GetParam()), fine = map_it(body, {}, GetParam());
  ASSERT_TRUE(fine.refined);
  const Topology found = topology_of(*fine.refined);
  EXPECT_TRUE(found.closed() && found.oriented());
  EXPECT_EQ(found.shell_count, 1u);
  EXPECT_NEAR(volume(*fine.refined, std::vector<Vec3>(fine.refined->vertices.size(), Vec3::Zero())) /
                  (kBarLength * kBarSide * kBarSide),
              1, 0.01);
  ASSERT_GT(fine.refined->vertices.size(), before.vertices.size() + 50);
  for (std::size_t v = 0; v < before.vertices.size(); ++v) {
    EXPECT_EQ(fine.refined->vertices[v], before.vertices[v]);
    EXPECT_EQ(fine.result.displacement[v], coarse.result.displacement[v]);
  }
  const std::vector<double> areas = areas_of_faces(before), split = areas_of_faces(*fine.refined);
  for (std::size_t f = 0; f < areas.size(); ++f) EXPECT_NEAR(split[f], areas[f], 1e-12);
  EXPECT_TRUE(std::is_sorted(fine.refined->polygon_face.begin(), fine.refined->polygon_face.end()));
  // The body has its own again.
  EXPECT_EQ(body.surface.vertices, before.vertices);
  EXPECT_EQ(body.surface.polygon_vertices, before.polygon_vertices);
}

INSTANTIATE_TEST_SUITE_P(Methods, RefinedBar, testing::ValuesIn(test::kEveryMethod),
                         [](const auto& with) { return test::test_name(with.param); });

TEST(Refinement, LeavesWhatIsNotCoarseAlone) {
  for (const double angle : {0.0, 0.4}) {  // turned as a whole, which triangles follow
    Body body = coarse_bar();
    test::deform(body, [&](const Vec3& p) -> Vec3 { return test::rotation(angle, Vec3(1, 2, 3)) * p; });
    const MappedPart mapped = map_it(body, {});
    EXPECT_FALSE(mapped.refined);
    EXPECT_FALSE(mapped.report.split_from);
    EXPECT_EQ(mapped.result.displacement.size(), 8u);
  }
}

TEST(Refinement, SplitsOnlyWhereThePartBends) {
  Body body = coarse_bar();
  // Straight up to the middle, then along a circle.
  const double bends_from = kBarLength / 2;
  test::deform(body, [&](const Vec3& p) -> Vec3 {
    if (p.x() < bends_from) return p;
    return Vec3(bends_from, 0, 0) + rolled(p - Vec3(bends_from, 0, 0));
  });
  const MappedPart fine = map_it(body, {});
  ASSERT_TRUE(fine.refined);
  std::size_t straight = 0, bent = 0;
  for (const Vec3& v : fine.refined->vertices) {
    straight += v.x() > 0.01 && v.x() < 0.4 * kBarLength;
    bent += v.x() > 0.6 * kBarLength && v.x() < kBarLength - 0.01;
  }
  EXPECT_LT(3 * straight, bent);
}

// Twice the corners on every edge, as files with normals or texture coordinates have them.
TEST(Refinement, KeepsSeamsClosed) {
  Body body = coarse_bar();
  Surface& surface = body.surface;
  const std::vector<Vec3> corners = surface.vertices;
  surface.vertices.clear();
  for (std::uint32_t& v : surface.polygon_vertices) {
    surface.vertices.push_back(corners[v]);
    v = static_cast<std::uint32_t>(surface.vertices.size() - 1);
  }
  surface.vertex_columns["x"].values.clear();
  for (const Vec3& v : surface.vertices) surface.vertex_columns["x"].values.push_back(v.x());
  test::deform(body, rolled);
  const MappedPart fine = map_it(body, {});
  ASSERT_TRUE(fine.refined);
  const Topology found = topology_of(*fine.refined);
  EXPECT_TRUE(found.closed() && found.oriented());
  Topology apart = topology(triangulate(*fine.refined).corners, [&] {
    std::vector<std::uint32_t> own(fine.refined->vertices.size());
    for (std::uint32_t v = 0; v < own.size(); ++v) own[v] = v;
    return own;
  }());
  EXPECT_EQ(apart.shell_count, 6u) << "the sides stay apart";
  const std::vector<double>& column = fine.refined->vertex_columns.at("x").values;
  ASSERT_EQ(column.size(), fine.refined->vertices.size());
  for (std::size_t v = 0; v < column.size(); ++v)
    EXPECT_NEAR(column[v], fine.refined->vertices[v].x(), 1e-12);
  // Vertices at one place move alike.
  const std::vector<std::uint32_t> first = weld(fine.refined->vertices);
  for (std::size_t v = 0; v < first.size(); ++v)
    EXPECT_EQ(fine.result.displacement[v], fine.result.displacement[first[v]]);
}

// A needle of a closed mesh, narrower than seams come apart, lies between neighbours that fit it exactly.
TEST(Refinement, KeepsWhatFitsApart) {
  Body body = coarse_bar();
  Surface& surface = body.surface;
  const Triangles before = triangulate(surface);
  const std::uint32_t a = before.corners[0][0], b = before.corners[0][1], c = before.corners[0][2];
  const Vec3 beside = surface.vertices[a] + 1e-9 * (surface.vertices[b] - surface.vertices[a]);
  Triangles triangles = before;
  surface.vertices.push_back(beside);
  const auto extra = static_cast<std::uint32_t>(surface.vertices.size() - 1);
  triangles.corners[0] = {extra, b, c};
  triangles.corners.push_back({a, extra, c});
  triangles.polygon.push_back(triangles.polygon[0]);
  for (auto& corners : triangles.corners)  // and on the other side of a b
    for (std::size_t i = 0; i < 3; ++i)
      if (corners.at(i) == b && corners.at((i + 1) % 3) == a) {
        const std::uint32_t apex = corners.at((i + 2) % 3);
        corners = {b, extra, apex};
        triangles.corners.push_back({extra, a, apex});
        triangles.polygon.push_back(triangles.polygon[0]);
        break;
      }
  ASSERT_EQ(triangles.corners.size(), before.corners.size() + 2);
  const std::vector<std::uint32_t> welded = weld_parts(surface, triangles);
  EXPECT_NE(welded[extra], welded[a]);
  for (const std::uint8_t edges : unshared_edges(surface, triangles)) EXPECT_EQ(edges, 0);
  triangles.corners.pop_back();
  EXPECT_EQ(weld_parts(surface, triangles)[extra], a) << "beside a gap they are one";
}

TEST(RefinementToAnEdge, LeavesAFileThatCannotBeSplitWhole) {
  Body body = coarse_bar();
  body.surface.sources.resize(1);
  SurfaceSource& source = body.surface.sources[0];
  source.file = "bar.obj";
  source.format = "obj";
  source.bytes.assign(1, std::byte{'#'});
  const std::vector<SurfaceFormat> formats = {surface_format("obj", "out.obj", false)};
  RefineOptions refine;
  refine.mode = Mode::to_edge;
  refine.edge = 1;
  const MappedPart whole = map_refined(body, MapOptions{&kBlended}, {}, refine, nullptr, formats, silent());
  EXPECT_FALSE(whole.refined);
  EXPECT_NE(whole.split_line.find("were not split: bar.obj"), std::string::npos) << whole.split_line;
  EXPECT_EQ(whole.report.split_advice, SplitAdvice::none);
}

TEST(Refinement, IsTheSameForAnyNumberOfThreads) {
  Body body = coarse_bar();
  test::deform(body, rolled);
  std::optional<MappedPart> one, many;
  {
    const ThreadLimit limit(1);
    one = map_it(body, {});
  }
  {
    const ThreadLimit limit(4);
    many = map_it(body, {});
  }
  ASSERT_TRUE(one->refined && many->refined);
  EXPECT_EQ(one->refined->vertices, many->refined->vertices);
  EXPECT_EQ(one->refined->polygon_vertices, many->refined->polygon_vertices);
  EXPECT_EQ(one->result.displacement, many->result.displacement);
}

// A sheet of two cells that moves by fifty times its thickness: a share of the displacement alone would let one side pass
// through the other.
TEST(Refinement, KeepsTheSidesOfASheetApart) {
  Body body = test::block(100, 10, 2, 0.02, Placement::corner, 1);
  body.surface_cell_offsets.clear();
  body.surface_cells.clear();
  test::deform(body, [](const Vec3& p) -> Vec3 {
    const double radius = 1.0, r = radius - p.z();
    return {r * std::sin(p.x()), p.y(), radius - r * std::cos(p.x())};
  });
  const MappedPart fine = map_it(body, {});
  ASSERT_TRUE(fine.refined);
  EXPECT_LE(fine.report.chord->largest, 1.05 * kRefinedSpacings * 0.02);
  EXPECT_NEAR(volume(*fine.refined, fine.result.displacement) / (2 * 0.2 * 0.04), 1, 0.05);
}

// A rod as CAD exports it: needles from end to end. Bent, their pieces must not turn over.
TEST(Refinement, KeepsNeedlesOnTheirSide) {
  const double length = 2, radius = 0.12;
  Lattice lattice;
  lattice.origin = Vec3(0, -0.16, -0.16);
  lattice.spacing = Vec3::Constant(0.04);
  Body body = test::make_body(
      lattice, {0, 0, 0}, {50, 8, 8},
      [&](const Vec3& p) { return p.x() < length && std::hypot(p.y(), p.z()) < radius + 0.02; },
      Placement::corner);
  test::add_tube_surface(body, length, radius, 1, less_if_sanitized(100, 24, "24 needles"));
  body.surface_cell_offsets.clear();  // they have cells near their corners only
  body.surface_cells.clear();
  test::deform(body, [](const Vec3& p) -> Vec3 {
    const double bow = 4, r = bow - p.z();
    return {r * std::sin(p.x() / bow), p.y(), bow - r * std::cos(p.x() / bow)};
  });
  const MappedPart whole = map_it(body, {Mode::off}), fine = map_it(body, {});
  EXPECT_GT(whole.report.chord->coarse_triangles, 0u);
  ASSERT_TRUE(fine.refined);
  EXPECT_TRUE(fine.report.valid());
  const SurfaceQuality& quality = fine.report.quality;
  EXPECT_LT(1000 * (quality.flipped + quality.folded), quality.triangles)
      << quality.flipped << " turned over, " << quality.folded << " folded";
  const double exact = volume(body.surface, std::vector<Vec3>(body.surface.vertices.size(), Vec3::Zero()));
  EXPECT_NEAR(volume(*fine.refined, fine.result.displacement) / exact, 1, 0.01);  // six cells across it
}

TEST(Refinement, GivesPiecesTheCellsOfTheirPolygonThatAreNear) {
  Body body = test::block(40, 4, 4, 0.1, Placement::corner, 1);
  body.surface_cell_offsets.assign(1, 0);
  body.surface_cells.clear();
  for (std::size_t p = 0; p < body.surface.polygon_count(); ++p) {
    for (std::uint32_t c = 0; c < body.cell_count(); ++c) body.surface_cells.push_back(c);
    body.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body.surface_cells.size()));
  }
  const Refinement refinement = refine_to_edge(body.surface, 0.5);
  Body split = body;
  take_refined(split, refined(body.surface, refinement), refinement);
  ASSERT_EQ(split.surface_cell_offsets.size(), split.surface.polygon_count() + 1);
  for (std::size_t p = 0; p < split.surface.polygon_count(); ++p) {
    const std::span<const std::uint32_t> cells(
        split.surface_cells.data() + split.surface_cell_offsets[p],
        split.surface_cell_offsets[p + 1] - split.surface_cell_offsets[p]);
    EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end()));
    EXPECT_LT(cells.size(), body.cell_count() / 2);
    Box box;
    for (const std::uint32_t v : split.surface.polygon(p)) box.add(split.surface.vertices[v]);
    for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
      const Vec3 low = body.rest[body.cell_elements[c][0]], high = body.rest[body.cell_elements[c][7]];
      const bool touches = (low.array() <= box.max.array()).all() && (high.array() >= box.min.array()).all();
      if (touches) {
        EXPECT_TRUE(std::binary_search(cells.begin(), cells.end(), c));
      }
    }
  }
}

TEST(RefinementToAnEdge, SplitsUntilNoneIsLonger) {
  for (const double edge : {3.0, 0.7, 0.11}) {
    const Surface surface = coarse_bar().surface;
    const Surface split = refined(surface, refine_to_edge(surface, edge));
    double longest = 0;
    for (std::size_t p = 0; p < split.polygon_count(); ++p)
      for (std::size_t i = 0; i < 3; ++i)
        longest = std::max(
            longest,
            (split.vertices[split.polygon(p)[i]] - split.vertices[split.polygon(p)[(i + 1) % 3]]).norm());
    EXPECT_LE(longest, edge);
    EXPECT_GT(longest, edge / 3);
    EXPECT_TRUE(topology_of(split).closed() && topology_of(split).oriented());
  }
  const Surface surface = coarse_bar().surface;
  EXPECT_FALSE(refine_to_edge(surface, 10).changes());
  EXPECT_EQ(refined(surface, refine_to_edge(surface, 10)).polygon_vertices, surface.polygon_vertices);
  EXPECT_THROW(static_cast<void>(refine_to_edge(surface, 1e-4)), InputError);
}

// A triangle with two corners at one place has no edge to split, and a fin makes an edge of three.
TEST(RefinementToAnEdge, TakesTrianglesThatAreNone) {
  Surface surface;
  surface.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {0, -1, 0}};
  surface.polygon_vertices = {0, 1, 2, 0, 1, 3, 0, 1, 5, 0, 1, 4, 2, 2, 3};
  surface.polygon_offsets = {0, 3, 6, 9, 12, 15};
  surface.polygon_face.assign(5, 0);
  surface.faces.push_back({"", 0});
  surface.parts.push_back({"fin"});
  const Refinement refinement = refine_to_edge(surface, 0.3);
  const Surface split = refined(surface, refinement);
  const std::vector<std::uint32_t> first = first_pieces(refinement);
  EXPECT_EQ(first[4] - first[3], 1u);
  EXPECT_EQ(first[5] - first[4], 1u);
  EXPECT_GT(first[1] - first[0], 8u);
  EXPECT_EQ(topology_of(split).non_manifold_edges, 4u);  // the common edge in quarters
}

TEST(RefinementTwice, IsOneRefinement) {
  const Surface surface = coarse_bar().surface;
  const Refinement first = refine_to_edge(surface, 1), second = refine_to_edge(refined(surface, first), 0.3);
  const Surface twice = refined(refined(surface, first), second),
                once = refined(surface, composed(first, second));
  EXPECT_EQ(once.vertices, twice.vertices);
  EXPECT_EQ(once.polygon_vertices, twice.polygon_vertices);
  EXPECT_EQ(once.polygon_face, twice.polygon_face);
}

}  // namespace
}  // namespace flexel::mapping
