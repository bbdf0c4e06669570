// Real parts, good and broken.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "formats/import.h"
#include "formats/parallel.h"
#include "tests/voxelize/shapes.h"
#include "voxelize/align.h"
#include "voxelize/part_mesh.h"
#include "voxelize/union_find.h"
#include "voxelize/vote.h"

namespace flexel {
namespace {

const std::filesystem::path kParts = FLEXEL_PARTS_DIR;

VoxelizeResult run_surface(Surface surface, const VoxelizeOptions& options) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeResult result = voxelize(std::move(surface), options, progress);
  check(result.body, "test");
  return result;
}

VoxelizeResult run_file(const std::string& file, double size, Align align = Align::snap) {
  VoxelizeOptions options;
  options.size = size;
  options.align = align;
  return run_surface(import_surface(kParts / file), options);
}

class Parts : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(kParts)) GTEST_SKIP() << kParts << " is not there";
  }
};

double total(const VoxelizedPart& part) {
  return part.lattice_volume + part.dropped_volume;
}

TEST_F(Parts, ClosedOnesKeepTheirVolumeAtAThirdOfTheThinnestWall) {
  for (const char* file :
       {"lower_leg_structure_200mm.STL", "lower_leg_structure_fork.STL", "hook.stl", "ADIS16480.STL",
        "Springy_Trigger.STL", "transmission_pulley_at3_t30_output.STL", "hip_aa_module_shell_cover.STL",
        "spot_triangulated.obj", "spot_quadrangulated.obj", "quadknot.obj", "yarn_guide.stl"}) {
    Surface surface = import_surface(kParts / file);
    const auto wall = thinnest_walls(surface, 64)[0];
    ASSERT_TRUE(wall) << file;
    // Not below 1/100 of the diagonal: a test takes seconds.
    VoxelizeOptions options;
    options.size = std::max(wall->thickness / 3, bounding_box(surface.vertices).diagonal() / 100);
    const VoxelizeResult result = run_surface(std::move(surface), options);
    EXPECT_TRUE(result.parts[0].closed) << file;
    EXPECT_NEAR(total(result.parts[0]) / result.parts[0].surface_volume, 1, 1e-6) << file;
    EXPECT_EQ(result.parts[0].undecided_voxels, 0u) << file;
    EXPECT_EQ(result.parts[0].overlapping_voxels, 0u) << file;
  }
}

TEST_F(Parts, ConrodHasTheVolumeOfItsUnion) {
  const VoxelizeResult result = run_file("conrod.stl", .04e-3);
  EXPECT_EQ(result.parts[0].shells, 3u);
  EXPECT_GT(result.parts[0].overlapping_voxels, 0u);
  EXPECT_NEAR(total(result.parts[0]) / result.parts[0].surface_volume, 1, 1e-3);
  EXPECT_EQ(shapes::component_count(result.body), 1u);
}

TEST_F(Parts, MultibodyIsTurnedTheRightWayRound) {
  Surface surface = import_surface(kParts / "multibody.stl");
  VoxelizeOptions options;
  options.size = .03e-3;
  const VoxelizeResult result = run_surface(std::move(surface), options);
  std::size_t flipped = 0, inverted = 0;
  for (const VoxelizedPart& part : result.parts) {
    EXPECT_TRUE(part.closed);
    EXPECT_GT(part.surface_volume, 0);
    EXPECT_NEAR(total(part) / part.surface_volume, 1, 1e-6);
    flipped += part.flipped_triangles;
    inverted += part.inverted_shells;
  }
  EXPECT_GT(flipped, 0u);
  EXPECT_GT(inverted, 0u);
}

// Connected groups of fine cells among `cells`, as the volume of each in coarse cells, largest first. `root`
// is scratch (elements).
std::vector<double> group_volumes(const Body& fine, const std::vector<std::uint32_t>& cells,
                                  UnionFind& sets) {
  std::vector<std::uint32_t> used;
  for (const std::uint32_t c : cells)
    used.insert(used.end(), fine.cell_elements[c].begin(), fine.cell_elements[c].end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  const auto local = [&](std::uint32_t e) {
    return static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), e) - used.begin());
  };
  sets.reset(used.size());
  for (const std::uint32_t c : cells)
    for (int a = 1; a < 8; ++a) sets.join(local(fine.cell_elements[c][0]), local(fine.cell_elements[c][a]));
  std::map<std::uint32_t, double> volume;
  for (const std::uint32_t c : cells) volume[sets.root(local(fine.cell_elements[c][0]))] += fine.fill[c] / 64;
  std::vector<double> volumes;
  for (const auto& [root, sum] : volume) volumes.push_back(sum);
  std::sort(volumes.rbegin(), volumes.rend());
  return volumes;
}

// Where the fine lattice, in which the slits are cells wide, has two separate bodies of matter around a
// coarse lattice point, no coarse element joins them: the cells of one element hold no more matter than the
// larger body.
TEST_F(Parts, SpringyTriggerKeepsItsSlits) {
  std::size_t checked = 0;
  for (const double size : {1e-3, 3e-3, 5e-3}) {
    const Body coarse = run_file("Springy_Trigger.STL", size, Align::none).body;
    const Body fine = run_file("Springy_Trigger.STL", size / 4, Align::none).body;
    EXPECT_EQ(shapes::component_count(coarse), 1u);
    std::map<Index3, std::vector<std::uint32_t>> fine_in_voxel;
    for (std::uint32_t c = 0; c < fine.cell_count(); ++c) {
      const Index3 index = fine.lattice_index[fine.cell_elements[c][0]];
      fine_in_voxel[{index[0] >> 2, index[1] >> 2, index[2] >> 2}].push_back(c);
    }
    std::vector<double> held(coarse.element_count(), 0);
    for (std::uint32_t c = 0; c < coarse.cell_count(); ++c)
      for (const std::uint32_t e : coarse.cell_elements[c]) held[e] += coarse.fill[c];
    UnionFind sets;
    for (std::uint32_t e = 0; e < coarse.element_count(); ++e) {
      const Index3& at = coarse.lattice_index[e];
      std::vector<std::uint32_t> around;
      for (int a = 0; a < 8; ++a)
        if (const auto found = fine_in_voxel.find({at[0] - (a & 1), at[1] - (a >> 1 & 1), at[2] - (a >> 2)});
            found != fine_in_voxel.end())
          around.insert(around.end(), found->second.begin(), found->second.end());
      if (around.size() > 500) continue;  // no room for a slit
      const std::vector<double> volumes = group_volumes(fine, around, sets);
      if (volumes.size() < 2 || volumes[1] < .1) continue;
      EXPECT_LT(held[e], volumes[0] + .08)
          << "element " << e << " joins " << volumes[0] << " and " << volumes[1];
      ++checked;
    }
  }
  EXPECT_GT(checked, 3u);
}

TEST_F(Parts, CracksVoteTheVolumeThatWeldingGives) {
  for (const char* file : {"foot_structure.STL", "angle_block.STL"}) {
    const Surface surface = import_surface(kParts / file);
    const Triangles triangles = triangulate(surface);
    PartMesh welded = part_meshes(surface)[0];
    EXPECT_TRUE(welded.cracks_closed) << file;
    PartMesh cracked = exact_part_meshes(surface)[0];
    EXPECT_GT(cracked.open_edges, 0u) << file;
    const double size = bounding_box(surface.vertices).diagonal() / 60;
    place_on_lattice(cracked, align_lattice(cracked, size, Align::none, true));
    double sum = 0;
    for (const Slab& slab : classify_open(cracked).slabs)
      for (const Piece& piece : slab.pieces) sum += piece.fill;
    EXPECT_NEAR(sum * size * size * size / std::abs(enclosed_volume(welded)), 1, .01) << file;
  }
}

TEST_F(Parts, SameBitsForAnyNumberOfThreads) {
  const auto with_threads = [](int threads) {
    const ThreadLimit limit(threads);
    return run_file("Springy_Trigger.STL", .8e-3);
  };
  const VoxelizeResult one = with_threads(1);
  for (const int threads : {2, 3}) {
    const VoxelizeResult other = with_threads(threads);
    EXPECT_EQ(one.body.fill, other.body.fill);
    EXPECT_EQ(one.body.cell_elements, other.body.cell_elements);
    EXPECT_EQ(one.body.rest, other.body.rest);
    EXPECT_EQ(one.body.surface_cells, other.body.surface_cells);
    EXPECT_EQ(one.body.connections, other.body.connections);
    EXPECT_EQ(one.parts[0].thinnest->thickness, other.parts[0].thinnest->thickness);
  }
}

}  // namespace
}  // namespace flexel
