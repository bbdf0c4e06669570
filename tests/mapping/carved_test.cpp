// Parts that were carved: their surface is closed around what went, and moves with what is left.
#include "mapping/crack/crack_carved.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "cgal_solid.h"
#include "formats/part/topology.h"
#include "pieces.h"

namespace flexel::mapping {
namespace {

using namespace test;

constexpr double kSpacing = 0.1;

// A block of 8 x 5 x 2 voxels without those that `gone` chooses by their index, under the surface of the
// whole.
Body carved_block(Placement placement, const std::function<bool(const Index3&)>& gone) {
  Lattice lattice;
  lattice.axes = rotation(0.3, Vec3(1, 2, -1));
  lattice.origin = Vec3(0.2, -0.1, 0.4);
  lattice.spacing = Vec3::Constant(kSpacing);
  const Index3 size{8, 5, 2};
  const auto index_of = [&](const Vec3& x) -> Index3 {
    const Vec3 u = lattice.to_lattice(x);
    return {static_cast<std::int32_t>(u.x()), static_cast<std::int32_t>(u.y()),
            static_cast<std::int32_t>(u.z())};
  };
  Body body = make_body(
      lattice, {0, 0, 0}, size, [&](const Vec3& x) { return !gone(index_of(x)); }, placement);
  add_box_surface(body, Vec3::Zero(), kSpacing * Vec3(size[0], size[1], size[2]), 4);
  for (Vec3& x : body.surface.vertices) x = lattice.to_world(x / kSpacing);
  derive_surface_cells(body);
  for (std::int32_t k = 0; k < size[2]; ++k)
    for (std::int32_t j = 0; j < size[1]; ++j)
      for (std::int32_t i = 0; i < size[0]; ++i)
        if (gone({i, j, k})) body.notes[kCarvedNote] += fmt::format("0 {} {} {}\n", i, j, k);
  return body;
}

// A hole through the block, a pocket from above.
bool in_hole(const Index3& i) {
  return i[0] >= 2 && i[0] < 4 && i[1] >= 1 && i[1] < 4;
}
bool in_pocket(const Index3& i) {
  return i[0] >= 5 && i[0] < 7 && i[1] >= 2 && i[2] == 1;
}

class Carved : public testing::TestWithParam<Placement> {};

TEST_P(Carved, IsClosedAroundWhatWentAndMovesWithTheRest) {
  for (const auto& [gone, euler_number] : {std::pair{&in_hole, 0}, {&in_pocket, 2}}) {
    Body body = carved_block(GetParam(), gone);
    const Mat3 turn = rotation(0.7, Vec3(1, -2, 0.5));
    const auto motion = [&](const Vec3& x) -> Vec3 { return turn * x + Vec3(1, 2, 3); };
    deform(body, motion);
    const double whole = volume_of(body.surface);
    const MappedPart mapped = map_broken(body, CrackMode::cap);
    ASSERT_TRUE(mapped.cracked);
    const Surface& surface = mapped.cracked->surface;
    check(surface, "carved");
    ASSERT_EQ(surface.parts.size(), 1u);
    EXPECT_EQ(surface.parts[0].name, "part");
    EXPECT_TRUE(mapped.report.crack.pieces.empty());
    std::vector<Vec3> moved = surface.vertices;
    for (std::size_t v = 0; v < moved.size(); ++v) {
      moved[v] += mapped.result.displacement[v];
      EXPECT_LT((moved[v] - motion(surface.vertices[v])).norm(), 1e-9);
    }
    const Piece piece = pieces_of(surface).at(0);
    EXPECT_EQ(euler(piece), euler_number);
    EXPECT_EQ(what_cgal_minds(moved, piece.triangles), "");
    // Walls stand a ten-thousandth of a spacing beside the voxels' faces.
    const double went =
        kSpacing * kSpacing * kSpacing *
        static_cast<double>(std::count(body.notes[kCarvedNote].begin(), body.notes[kCarvedNote].end(), '\n'));
    EXPECT_NEAR(whole - signed_volume(surface.vertices, piece.triangles), went, 1e-3 * went);
  }
}

TEST_P(Carved, ComesAsPiecesWhereItFellApart) {
  Body body = carved_block(GetParam(), [](const Index3& i) { return i[0] == 3; });
  deform(body, [](const Vec3& x) -> Vec3 { return x; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  ASSERT_TRUE(mapped.cracked);
  ASSERT_EQ(mapped.report.crack.pieces.size(), 2u);
  double sum = 0;
  for (const Piece& piece : pieces_of(mapped.cracked->surface)) {
    EXPECT_EQ(euler(piece), 2);
    EXPECT_EQ(what_cgal_minds(mapped.cracked->surface.vertices, piece.triangles), "");
    sum += signed_volume(mapped.cracked->surface.vertices, piece.triangles);
  }
  EXPECT_NEAR(sum, 7.0 / 8 * volume_of(body.surface), 1e-3 * sum);
}

TEST_P(Carved, StaysAsItIsWhereThatIsAskedFor) {
  Body body = carved_block(GetParam(), in_hole);
  deform(body, [](const Vec3& x) -> Vec3 { return x; });
  EXPECT_FALSE(map_broken(body, CrackMode::keep).cracked);
  body.notes[kCarvedNote] = "0 1 2\nnonsense";
  EXPECT_THROW((void)map_broken(body, CrackMode::cap), InputError);
}

INSTANTIATE_TEST_SUITE_P(Placements, Carved, testing::Values(Placement::corner, Placement::centre),
                         [](const auto& with) {
                           return with.param == Placement::corner ? "corner" : "centre";
                         });

}  // namespace
}  // namespace flexel::mapping
