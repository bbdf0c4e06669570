// Parts in one place, in each other, in touch, and apart by less than a cell.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/voxelize/shapes.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

// Each mesh a part: "part", "part-2", ...
VoxelizeResult run_parts(const std::vector<Mesh>& meshes, double size) {
  Surface all = surface(meshes[0]);
  for (std::size_t m = 1; m < meshes.size(); ++m) append(all, surface(meshes[m]));
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = size;
  return voxelize(std::move(all), options, progress);
}

const Mesh kBar = box({0, 0, 0}, {2, 1, 1});

TEST(Neighbours, PartsThatTouchAreNothingToTell) {
  for (const Mat3& rotation : {Mat3(Mat3::Identity()), turned(.3, .7, -.4)}) {
    const auto at = [&](const Mesh& mesh) { return transformed(mesh, rotation, {3, -1, 2}); };
    EXPECT_TRUE(run_parts({at(kBar), at(box({2, .2, .2}, {4, .8, .8}))}, .1).pairs.empty());
    // A pin in a hole of its own size: both are the same facets.
    const Mesh block = box({-1, -1, -1}, {1, 1, 1}), pin = box({-.5, -.5, -.5}, {.5, .5, .5});
    EXPECT_TRUE(run_parts({at(merged(block, inverted(pin))), at(pin)}, .1).pairs.empty());
    EXPECT_TRUE(run_parts({at(kBar), at(box({2.2, 0, 0}, {4, 1, 1}))}, .1).pairs.empty());  // far
  }
}

TEST(Neighbours, AnOverlapHasItsVolume) {
  for (const Mat3& rotation : {Mat3(Mat3::Identity()), turned(.3, .7, -.4)}) {
    const auto at = [&](const Mesh& mesh) { return transformed(mesh, rotation, {3, -1, 2}); };
    const std::vector<PartPair> pairs = run_parts({at(kBar), at(box({1.5, .2, .2}, {4, .8, .8}))}, .1).pairs;
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_NEAR(pairs[0].overlap, .5 * .36, .02 * .5 * .36);
    EXPECT_FALSE(pairs[0].same);
  }
  // All of one in the other, far from its surface.
  const std::vector<PartPair> pairs = run_parts({kBar, box({.5, .4, .4}, {.7, .6, .6})}, .1).pairs;
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].overlap, .008, 1e-4);
}

TEST(Neighbours, AGapUnderACellHasItsWidth) {
  for (const Mat3& rotation : {Mat3(Mat3::Identity()), turned(.3, .7, -.4)}) {
    const auto at = [&](const Mesh& mesh) { return transformed(mesh, rotation, {3, -1, 2}); };
    const std::vector<PartPair> pairs = run_parts({at(kBar), at(box({2.03, .2, .2}, {4, .8, .8}))}, .1).pairs;
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_EQ(pairs[0].overlap, 0);
    EXPECT_NEAR(pairs[0].gap, .03, .03 * .02);
  }
  EXPECT_NEAR(run_parts({icosphere(3, 1), transformed(icosphere(3, 1), Mat3::Identity(), {0, 0, 2.05})}, .1)
                  .pairs.at(0)
                  .gap,
              .05, .01);
}

TEST(Neighbours, ABodyThatIsThereTwiceIsRefusedByBothNames) {
  const Mesh finer = torus(1, .3, 64, 32), thinner = torus(1, .29, 64, 32);
  for (const Mesh& twin : {finer, transformed(finer, Mat3::Identity(), {1e-5, 0, 0}), inverted(finer)}) {
    try {
      run_parts({finer, box({3, 0, 0}, {4, 1, 1}), twin}, .1);
      FAIL() << "not refused";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("\"part\" and \"part-3\""));
    }
  }
  // Another body of nearly the same shape is not the same: it overlaps.
  EXPECT_EQ(run_parts({finer, thinner}, .1).pairs.size(), 1u);
}

}  // namespace
}  // namespace flexel::voxelize
