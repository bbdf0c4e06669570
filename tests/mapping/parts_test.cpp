// Real parts through import, lattice and mapping: nothing is lost, nothing moves by itself, imposed motions
// are followed.
#include <gtest/gtest.h>

#include <filesystem>

#include "bodies.h"
#include "formats/import.h"
#include "mapping/map.h"
#include "motions.h"
#include "voxelize/voxelize.h"

namespace flexel {
namespace {

Progress& silent() {
  static Progress progress("test", Progress::Mode::quiet);
  return progress;
}

class RealPart : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::filesystem::path path = std::filesystem::path(FLEXEL_PARTS_DIR) / GetParam();
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
    VoxelizeOptions options;
    options.count = 6000;
    body_ = voxelize(import_surface(path.string()), options, silent()).body;
    diagonal_ = bounding_box(body_.surface.vertices).diagonal();
  }
  double largest_error(MapMethod method, const test::Field& field) {
    test::deform(body_, field);
    const MapResult result = map_surface(body_, {method}, silent());
    const MapReport found = report(body_, result);
    EXPECT_TRUE(found.valid());
    left_ = found.voronoi_cell_left;
    double largest = 0;
    for (std::size_t v = 0; v < body_.surface.vertices.size(); ++v) {
      const Vec3& x = body_.surface.vertices[v];
      largest = std::max(largest, (x + result.displacement[v] - field(x)).norm());
    }
    return largest / diagonal_;
  }
  Body body_;
  double diagonal_ = 0;
  std::size_t left_ = 0;  // vertices that left their Voronoi cell in the last motion
};

TEST_P(RealPart, StaysAtRestAndFollowsImposedMotions) {
  const Mat3 turn = test::rotation(2.1, Vec3(1, -2, 0.5));
  const Vec3 move(0.1, 0.2, -0.3);
  for (const MapMethod method : test::kEveryMethod) {
    EXPECT_EQ(largest_error(method, [](const Vec3& x) { return x; }), 0);
    EXPECT_LT(largest_error(method, [&](const Vec3& x) -> Vec3 { return turn * x + move; }), 1e-9);
    EXPECT_EQ(left_, 0u);
  }
  const Mat3 stretch = (Mat3() << 1.02, 0.01, 0, -0.01, 0.99, 0.005, 0, 0.01, 1.01).finished();
  for (const MapMethod method : {MapMethod::affine, MapMethod::blended, MapMethod::smooth})
    EXPECT_LT(largest_error(method, [&](const Vec3& x) -> Vec3 { return turn * (stretch * x) + move; }),
              1e-9);
}

// In another unit, and a thousand times as large. affine and gram-schmidt jump where the octant of a vertex
// changes, and a vertex half-way between two elements can go either way by rounding: they are measured where
// there are no such (Degenerate.TheUnitDoesNotMatter).
TEST_P(RealPart, IsTheSameInAnotherUnit) {
  const double bend = 1 / diagonal_;
  test::deform(body_, [&](const Vec3& x) -> Vec3 {
    return x + Vec3(0.2 * bend * x.y() * x.z(), 0.3 * bend * x.x() * x.x(), -0.1 * bend * x.x() * x.y());
  });
  for (const double scale : {1 / 0.0254, 1e3}) {
    Body other = body_;
    for (Part& part : other.parts) {
      part.lattice.origin *= scale;
      part.lattice.spacing *= scale;
    }
    for (auto* points : {&other.rest, &other.position, &other.surface.vertices})
      for (Vec3& x : *points) x *= scale;
    for (const MapMethod method : {MapMethod::blended, MapMethod::smooth}) {
      const MapResult one = map_surface(body_, {method}, silent()),
                      two = map_surface(other, {method}, silent());
      double largest = 0;
      for (std::size_t v = 0; v < one.displacement.size(); ++v)
        largest = std::max(largest, (two.displacement[v] / scale - one.displacement[v]).norm());
      EXPECT_LT(largest, 1e-9 * diagonal_) << scale << ", " << name_of(method);
    }
  }
}

TEST_P(RealPart, HasFourElementsForEveryVertex) {
  const MapResult result = map_surface(body_, {}, silent());
  const MapReport found = report(body_, result);
  EXPECT_EQ(found.kinds[0], found.vertices);
  EXPECT_LT(found.rest_residual, 1e-12 * diagonal_);
  // A vertex whose matter was too little for a cell hangs on the cell beside it.
  EXPECT_LT(found.distance_outside, 1);
}

INSTANTIATE_TEST_SUITE_P(Parts, RealPart,
                         testing::Values("base_interface_AP203.STEP", "featuretype.STEP",
                                         "4040_base_mount.step", "Moving_Jaw_SO101.step",
                                         "red_cube_blue_cylinder.step", "lower_leg_structure_fork.STEP",
                                         "lower_leg_structure_fork.STL", "lower_leg_structure_200mm.STL",
                                         "conrod.stl", "transmission_pulley_at3_t30_output.STL",
                                         "hip_aa_module_shell_cover.STL", "Springy_Trigger.STL", "hook.stl",
                                         "ADIS16480.STL", "spot_triangulated.obj", "spot_quadrangulated.obj",
                                         "quadknot.obj", "rabbit.obj", "multibody.stl"),
                         [](const auto& with) {
                           std::string name = with.param;
                           for (char& c : name)
                             if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
                           return name;
                         });

}  // namespace
}  // namespace flexel
