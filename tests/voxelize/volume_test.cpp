// The fills add up to the volume of the surface, whatever its place on the lattice.
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sanitized.h"
#include "tests/voxelize/shapes.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

double relative_volume_error(const Mesh& mesh, double size, Align align) {
  const VoxelizeResult result = run(mesh, size, align);
  return std::abs((result.parts[0].lattice_volume + result.parts[0].dropped_volume) / volume(mesh) - 1);
}

TEST(Volume, IsThatOfTheSurfaceForRandomPlacesAndSizes) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 40; ++trial) {
    const Mat3 rotation = random_rotation(random);
    const Vec3 shift(uniform(random), uniform(random), uniform(random));
    const double size = .05 + .4 * uniform(random);
    const Align align = trial % 2 == 0 ? Align::none : Align::box;
    EXPECT_LT(relative_volume_error(transformed(icosphere(2, 1), rotation, shift), size, align), 1e-9)
        << trial;
    EXPECT_LT(relative_volume_error(transformed(box({0, 0, 0}, {1.3, .7, .4}), rotation, shift), size, align),
              1e-9)
        << trial;
    EXPECT_LT(relative_volume_error(transformed(torus(1, .3, 31, 17), rotation, shift), size, align), 1e-9)
        << trial;
  }
}

TEST(Volume, OfAnAlignedBoxIsFullCellsOnly) {
  for (const Vec3& low : {Vec3(0, 0, 0), Vec3(.1, .2, .3), Vec3(-7.77, 1e3, .05)}) {
    const VoxelizeResult result = run(box(low, low + Vec3(2, .7, .5)), .1, Align::box);
    EXPECT_EQ(result.parts[0].cells, 20u * 7u * 5u);
    EXPECT_EQ(result.parts[0].elements, 21u * 8u * 6u);
    EXPECT_EQ(result.parts[0].dropped_volume, 0);
    for (const double fill : result.body.fill) EXPECT_NEAR(fill, 1, 1e-9);
  }
}

TEST(Volume, HollowBallStaysHollow) {
  const Mesh mesh = merged(icosphere(3, 1), inverted(icosphere(3, .7)));
  const VoxelizeResult result = run(mesh, .09);
  EXPECT_NEAR((result.parts[0].lattice_volume + result.parts[0].dropped_volume) / volume(mesh), 1, 1e-9);
  for (const Vec3& rest : result.body.rest) EXPECT_GT(rest.norm(), .7 - .09 * std::sqrt(3.));
  EXPECT_EQ(component_count(result.body), 1u);
}

// A body in a form that does not depend on the order of triangles.
struct Cells {
  std::vector<Index3> index;
  std::vector<double> fill;
};

void expect_same_cells(const Body& a, const Body& b, const Index3& shift, double tolerance) {
  ASSERT_EQ(a.element_count(), b.element_count());
  ASSERT_EQ(a.cell_count(), b.cell_count());
  EXPECT_EQ(a.piece, b.piece);
  for (std::size_t e = 0; e < a.element_count(); ++e)
    for (int c = 0; c < 3; ++c) ASSERT_EQ(a.lattice_index[e][c] + shift[c], b.lattice_index[e][c]);
  EXPECT_EQ(a.cell_elements, b.cell_elements);
  for (std::size_t c = 0; c < a.cell_count(); ++c) ASSERT_NEAR(a.fill[c], b.fill[c], tolerance);
}

TEST(Volume, FlippedOrderOfTrianglesAndVerticesGivesTheSameBody) {
  std::mt19937 random(3);
  Mesh mesh = transformed(torus(1, .3, 23, 11), random_rotation(random));
  const VoxelizeResult first = run(mesh, .17);
  std::vector<std::uint32_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), random);
  Mesh other = mesh;
  for (std::size_t v = 0; v < order.size(); ++v) other.vertices[order[v]] = mesh.vertices[v];
  for (auto& t : other.triangles) t = {order[t[1]], order[t[2]], order[t[0]]};
  std::shuffle(other.triangles.begin(), other.triangles.end(), random);
  expect_same_cells(first.body, run(other, .17).body, {0, 0, 0}, 1e-12);
}

// The count is met within a tenth on thick and thin parts; snapping moves the spacing in steps, and so may
// miss by a little more.
TEST(Count, IsMetWithinATenth) {
  const Mesh plate = box({0, 0, 0}, {1, .8, .004}), ball = icosphere(4, .5),
             leaves = transformed(fork(.01, .01, .1, .4), turned(.3, .5, .7)), ring = torus(1, .02, 200, 24);
  for (const Mesh& mesh : {plate, ball, leaves, ring})
    for (const std::size_t count :
         less_if_sanitized<std::vector<std::size_t>>({2000, 20000, 40000}, {2000}, "one count of three"))
      for (const Align align : {Align::snap, Align::none}) {
        Progress progress("test", Progress::Mode::quiet);
        VoxelizeOptions options;
        options.count = count;
        options.align = align;
        options.max_memory = 1e12;
        const VoxelizeResult result = voxelize(surface(mesh), options, progress);
        EXPECT_NEAR(static_cast<double>(result.parts[0].cells) / static_cast<double>(count), 1,
                    align == Align::snap ? .15 : .1)
            << volume(mesh) << (align == Align::snap ? " snap" : " none");
        EXPECT_EQ(result.body.surface.vertices.size(), mesh.vertices.size());
      }
}

TEST(Count, TriesRoundedSizesOnly) {
  const auto rounded = [](double size) { return std::pow(10, std::round(20 * std::log10(size)) / 20); };
  for (const Mesh& mesh : {box({0, 0, 0}, {1, .8, .004}), icosphere(4, .5)}) {
    Progress progress("test", Progress::Mode::quiet);
    VoxelizeOptions options;
    options.count = 20000;
    options.rounded = rounded;
    const VoxelizeResult result = voxelize(surface(mesh), options, progress);
    EXPECT_NEAR(result.size, rounded(result.size), 1e-12);
    EXPECT_NEAR(static_cast<double>(result.parts[0].cells) / 20000, 1, .35);
    VoxelizeOptions same;
    same.size = result.size;
    EXPECT_EQ(voxelize(surface(mesh), same, progress).parts[0].cells, result.parts[0].cells);
  }
}

}  // namespace
}  // namespace flexel::voxelize
