// Corners and centres against a brute-force winding number, shifts of the lattice, and the limits that are
// refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/voxelize/shapes.h"
#include "voxelize/classify/classify.h"
#include "voxelize/lattice/elements.h"
#include "voxelize/memory.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

// Sum of the triangles' solid angles over 4 pi (Van Oosterom and Strackee, 1983).
double winding_number(const PartMesh& mesh, const Vec3& point) {
  double sum = 0;
  for (const Corners& t : mesh.corners) {
    const Vec3 a = mesh.vertices[t[0]] - point, b = mesh.vertices[t[1]] - point,
               c = mesh.vertices[t[2]] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

PartMesh placed(const Mesh& mesh, double h) {
  PartMesh part = part_meshes(surface(mesh))[0];
  Lattice lattice;
  lattice.spacing = Vec3::Constant(h);
  place_on_lattice(part, lattice);
  return part;
}

void expect_winding(const PartMesh& mesh, const std::string& what) {
  const Voxels voxels = classify_closed(mesh, {.with_centres = true});
  std::size_t checked = 0;
  for (std::size_t s = 0; s < voxels.slabs.size(); ++s) {
    const Slab& slab = voxels.slabs[s];
    for (int j = slab.j_begin; j < slab.j_begin + slab.rows(); ++j) {
      const auto row = slab.row(j);
      for (std::size_t p = 0; p < row.size();) {
        const int i = row[p].i;
        int corners = 0, centre = 0;
        for (; p < row.size() && row[p].i == i; ++p) {
          EXPECT_EQ(corners & row[p].corners, 0) << "a corner in two pieces";
          corners |= row[p].corners;
          centre |= row[p].flags & kContainsCentre;
        }
        const Vec3 low(i, j, voxels.k_begin + static_cast<int>(s));
        for (int a = 0; a < 8; ++a, ++checked)
          ASSERT_EQ(corners >> a & 1, winding_number(mesh, low + Vec3(a & 1, a >> 1 & 1, a >> 2)) > .5)
              << what;
        ASSERT_EQ(centre != 0, winding_number(mesh, low + Vec3::Constant(.5)) > .5) << what;
      }
    }
  }
  EXPECT_GT(checked, 500u) << what;
}

TEST(Classify, CornersAndCentresAgreeWithTheWindingNumber) {
  std::mt19937 random(41);
  for (int trial = 0; trial < 5; ++trial) {
    const Mat3 rotation = random_rotation(random);
    expect_winding(placed(transformed(torus(1, .3, 19, 11), rotation), .19), "torus");
    expect_winding(placed(transformed(fork(.08, .03, .3, .5), rotation, {.013, .027, .041}), .1), "fork");
    expect_winding(placed(transformed(merged(icosphere(2, 1), inverted(icosphere(2, .8))), rotation), .23),
                   "hollow ball");
  }
}

TEST(Classify, AShiftByWholeCellsShiftsTheBody) {
  std::mt19937 random(43);
  const double h = .125;  // exact in binary, and so are the shifted coordinates below
  Mesh mesh = transformed(fork(.1, .0375, .25, .5), random_rotation(random));
  for (Vec3& v : mesh.vertices) v = (v * 1048576).array().round() / 1048576;
  const Voxels here = classify_closed(placed(mesh, h), {});
  const Voxels there =
      classify_closed(placed(transformed(mesh, Mat3::Identity(), Vec3(3, -5, 7) * h), h), {});
  ASSERT_EQ(here.slabs.size(), there.slabs.size());
  EXPECT_EQ(here.k_begin + 7, there.k_begin);
  for (std::size_t s = 0; s < here.slabs.size(); ++s) {
    ASSERT_EQ(here.slabs[s].pieces.size(), there.slabs[s].pieces.size());
    for (std::size_t p = 0; p < here.slabs[s].pieces.size(); ++p) {
      const Piece &a = here.slabs[s].pieces[p], &b = there.slabs[s].pieces[p];
      EXPECT_EQ(a.i + 3, b.i);
      EXPECT_EQ(a.corners, b.corners);
      EXPECT_EQ(a.faces, b.faces);
      EXPECT_NEAR(a.fill, b.fill, 1e-12);
    }
  }
  const LatticeElements first = make_elements(here), second = make_elements(there);
  EXPECT_EQ(first.of_piece, second.of_piece);
  EXPECT_EQ(first.number, second.number);
}

TEST(Classify, SeveralPartsShareNoElement) {
  Surface two = surface(box({0, 0, 0}, {1, 1, 1}));
  append(two, surface(box({0, 0, 1}, {1, 1, 2})));
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = .25;
  options.material = "steel";
  const VoxelizeResult result = voxelize(two, options, progress);
  check(result.body, "test");
  ASSERT_EQ(result.body.parts.size(), 2u);
  EXPECT_EQ(result.body.parts[0].material, "steel");
  EXPECT_EQ(component_count(result.body), 2u);
  EXPECT_EQ(result.body.cell_count(), 128u);
}

TEST(Classify, CountIsMetWithinATenthForChunkyParts) {
  std::mt19937 random(47);
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.count = 5000;
  options.align = Align::none;
  for (const Mesh& mesh : {icosphere(3, 1), transformed(torus(1, .3, 41, 23), random_rotation(random)),
                           transformed(box({0, 0, 0}, {1, 1, .02}), random_rotation(random))}) {
    const VoxelizeResult result = voxelize(surface(mesh), options, progress);
    EXPECT_NEAR(static_cast<double>(result.parts[0].cells) / 5000, 1, .1);
  }
}

TEST(Classify, MemoryBeyondTheLimitIsRefusedWithASizeThatFits) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = 1e-5;
  options.max_memory = 1e9;
  try {
    static_cast<void>(voxelize(surface(icosphere(2, 1)), options, progress));
    FAIL() << "not refused";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("--size"));
    EXPECT_THAT(error.what(), testing::HasSubstr("--max-memory"));
  }
  const PartExtent extent{4.19, 12.57};
  for (const bool moments : {false, true}) {
    options.moments = moments;
    options.max_memory = moments ? 3e8 : 1e9;
    options.size =
        1.05 * spacing_for_cells({extent}, cells_within(*options.max_memory, Placement::corner, moments),
                                 Placement::corner);
    EXPECT_LE(voxelize(surface(icosphere(2, 1)), options, progress).simulation_memory, *options.max_memory);
    options.size = 0.8 * *options.size;
    EXPECT_THROW(static_cast<void>(voxelize(surface(icosphere(2, 1)), options, progress)), InputError);
  }
}

}  // namespace
}  // namespace flexel::voxelize
