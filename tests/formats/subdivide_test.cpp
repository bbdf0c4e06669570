#include "formats/import/subdivide.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "formats/area_vector.h"
#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

double longest_edge(const Surface& surface) {
  double longest = 0;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (std::size_t i = 0; i < 3; ++i)
      longest = std::max(longest, (surface.vertices[surface.polygon(p)[i]] -
                                   surface.vertices[surface.polygon(p)[(i + 1) % 3]])
                                      .norm());
  return longest;
}

struct FaceSum {
  double area = 0;
  Vec3 vector = Vec3::Zero();
};

std::vector<FaceSum> face_sums(const Surface& surface) {
  std::vector<FaceSum> sums(surface.faces.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    sums[surface.polygon_face[p]].area += area_vector(surface.vertices, surface.polygon(p)).norm();
    sums[surface.polygon_face[p]].vector += area_vector(surface.vertices, surface.polygon(p));
  }
  return sums;
}

double smallest_angle(const Surface& surface) {
  double smallest = 4;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = [&](std::size_t k) { return surface.vertices[surface.polygon(p)[(i + k) % 3]]; };
      const Vec3 a = at(1) - at(0), b = at(2) - at(0);
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return smallest;
}

void expect_same_solid(const Surface& coarse, const Surface& fine) {
  const Shape before = shape(coarse), after = shape(fine);
  EXPECT_TRUE(after.topology.closed() && after.topology.oriented());
  EXPECT_EQ(after.topology.shell_count, before.topology.shell_count);
  EXPECT_NEAR(after.volume / before.volume, 1, 1e-12);
  EXPECT_TRUE(std::is_sorted(fine.polygon_face.begin(), fine.polygon_face.end()));
  ASSERT_EQ(fine.faces.size(), coarse.faces.size());
  const std::vector<FaceSum> expected = face_sums(coarse), found = face_sums(fine);
  for (std::size_t f = 0; f < expected.size(); ++f) {
    EXPECT_NEAR(found[f].area, expected[f].area, 1e-12 * expected[f].area) << f;
    EXPECT_NEAR((found[f].vector - expected[f].vector).norm(), 0, 1e-12 * expected[f].area) << f;
  }
}

// A box of 40 x 30 x 2 mm with a face per side.
Surface plate() {
  const Scratch scratch;
  return import_surface(scratch.write("plate.stl", binary_stl(box_facets({0, 0, 0}, {40, 30, 2}))));
}

TEST(Subdivide, KeepsTheSolidAndItsFacesAndBoundsTheEdges) {
  const Surface coarse = plate();
  for (const double limit : {0.06, 0.03, 7e-3, 1e-3}) {
    Surface fine = coarse;
    ASSERT_TRUE(subdivide(fine, 0, limit, 1'000'000));
    EXPECT_LE(longest_edge(fine), limit);
    EXPECT_GE(smallest_angle(fine), smallest_angle(coarse) / 2 * (1 - 1e-9));
    EXPECT_TRUE(std::equal(coarse.vertices.begin(), coarse.vertices.end(), fine.vertices.begin()));
    expect_same_solid(coarse, fine);
  }
}

TEST(Subdivide, LeavesAloneWhatIsFineAlready) {
  const Surface coarse = plate();
  Surface fine = coarse;
  ASSERT_TRUE(subdivide(fine, 0, 0.06, 1'000'000));
  EXPECT_EQ(fine.vertices, coarse.vertices);
  EXPECT_EQ(fine.polygon_vertices, coarse.polygon_vertices);
  EXPECT_EQ(fine.polygon_offsets, coarse.polygon_offsets);
}

TEST(Subdivide, StopsAtTheMostTrianglesWithAClosedMesh) {
  const Surface coarse = plate();
  Surface fine = coarse;
  EXPECT_FALSE(subdivide(fine, 0, 1e-6, 5000));
  EXPECT_GE(fine.polygon_count(), 5000u);
  EXPECT_LE(fine.polygon_count(), 5001u);
  expect_same_solid(coarse, fine);
}

TEST(Subdivide, PolygonsBeforeTheFirstStayAsTheyAre) {
  Surface two = plate();
  Surface other = plate();
  for (Vec3& vertex : other.vertices) vertex.z() += 0.01;  // apart, or welding would make them one
  append(two, std::move(other));
  const Surface before = two;
  ASSERT_TRUE(subdivide(two, 12, 5e-3, 1'000'000));
  EXPECT_TRUE(std::equal(before.polygon_vertices.begin(), before.polygon_vertices.begin() + 36,
                         two.polygon_vertices.begin()));
  EXPECT_GT(two.polygon_count(), 100u);
  expect_same_solid(before, two);
}

TEST(Subdivide, MeshesAreNotSplitOnImport) {
  const Scratch scratch;
  ImportOptions options;
  options.largest_edge = 1e-3;
  const std::string path = scratch.write("plate.stl", binary_stl(box_facets({0, 0, 0}, {40, 30, 2})));
  EXPECT_EQ(import_surface(path, options).polygon_count(), 12u);
}

#ifdef FLEXEL_STEP

TEST(SubdivideStep, PartsAreSplitToASixtyFourthOfTheirDiagonal) {
  SKIP_WITHOUT_PARTS();
  for (const char* file : {"4040_base_mount.step", "Moving_Jaw_SO101.step", "base_interface_AP203.STEP",
                           "featuretype.STEP", "lower_leg_structure_fork.STEP"}) {
    SCOPED_TRACE(file);
    ImportOptions whole;
    whole.largest_edge = std::numeric_limits<double>::infinity();
    const Surface coarse = import_surface(part_path(file), whole), fine = import_surface(part_path(file));
    const double diagonal = bounding_box(coarse.vertices).diagonal();
    EXPECT_GT(longest_edge(coarse), diagonal / 64);
    EXPECT_LE(longest_edge(fine), diagonal / 64 * (1 + 1e-12));
    EXPECT_LT(fine.polygon_count(), 400'000u);
    expect_same_solid(coarse, fine);
  }
}

// A lattice has one spacing for all parts: a nut needs no edges of a 64th of itself.
TEST(SubdivideStep, AnAssemblyIsSplitToASixtyFourthOfItsWhole) {
  SKIP_WITHOUT_PARTS();
  ImportOptions whole;
  whole.largest_edge = std::numeric_limits<double>::infinity();
  const std::string path = part_path("as1-oc-214.stp");
  const Surface coarse = import_surface(path, whole), fine = import_surface(path);
  EXPECT_EQ(fine.parts.size(), 18u);
  EXPECT_LE(longest_edge(fine), bounding_box(coarse.vertices).diagonal() / 64 * (1 + 1e-12));
  EXPECT_LT(fine.polygon_count(), 300'000u);  // 1,170,000 when each solid's own diagonal counted
  EXPECT_NEAR(shape(fine).volume / shape(coarse).volume, 1, 1e-12);
}

TEST(SubdivideStep, TheLargestEdgeIsTheUsersAndTooManyTrianglesAreAnError) {
  SKIP_WITHOUT_PARTS();
  const std::string path = part_path("red_cube_blue_cylinder.step");
  ImportOptions options;
  options.largest_edge = 5e-4;
  EXPECT_LE(longest_edge(import_surface(path, options)), 5e-4);
  options.largest_edge = 1e-7;
  EXPECT_THAT(import_error(path, options), ::testing::HasSubstr("give a larger --edge"));
  options.largest_edge = 0;
  EXPECT_THAT(import_error(path, options), ::testing::HasSubstr("above zero"));
}

#endif

}  // namespace
}  // namespace flexel::test
