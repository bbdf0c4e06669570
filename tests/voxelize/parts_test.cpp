// Real parts, good and broken.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "formats/exchange/import.h"
#include "formats/lattice/locate.h"
#include "tests/sanitized.h"
#include "tests/voxelize/shapes.h"
#include "voxelize/classify/axis_parity.h"
#include "voxelize/lattice/align.h"
#include "voxelize/measure_part.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {
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

TEST_F(Parts, ClosedOnesKeepTheirVolumeAtAThirdOfTheThinnestWall) {
  for (const char* file :
       {"lower_leg_structure_200mm.STL", "lower_leg_structure_fork.STL", "hook.stl", "ADIS16480.STL",
        "Springy_Trigger.STL", "transmission_pulley_at3_t30_output.STL", "hip_aa_module_shell_cover.STL",
        "spot_triangulated.obj", "spot_quadrangulated.obj", "quadknot.obj", "yarn_guide.stl"}) {
    Surface surface = import_surface(kParts / file);
    const auto wall = heal_and_measure(surface, 64)[0].thinnest;
    ASSERT_TRUE(wall) << file;
    // Not below 1/100 of the diagonal: a test takes seconds.
    VoxelizeOptions options;
    options.size = std::max(wall->thickness / 3, bounding_box(surface.vertices).diagonal() / 100);
    const VoxelizeResult result = run_surface(std::move(surface), options);
    EXPECT_TRUE(result.parts[0].closed) << file;
    EXPECT_NEAR(shapes::total_volume(result.parts[0]) / result.parts[0].surface_volume, 1, 1e-6) << file;
    EXPECT_EQ(result.parts[0].undecided_voxels, 0u) << file;
    EXPECT_EQ(result.parts[0].overlapping_voxels, 0u) << file;
  }
}

// A block with open edges, and two open rings. The thickness of the cells decides nothing.
TEST_F(Parts, WhatIsASheetIsOneOnEveryLattice) {
  double finest = 0;
  for (const double size :
       less_if_sanitized<std::vector<double>>({.008, .014, .03}, {.014, .03}, "two lattices of three")) {
    const VoxelizedPart block = run_file("featuretype.3MF", size).parts[0];
    EXPECT_FALSE(block.closed);
    if (finest == 0) finest = shapes::total_volume(block);
    EXPECT_NEAR(shapes::total_volume(block) / finest, 1, .02) << size;
  }
  for (const std::size_t count : {1000, 50}) {
    VoxelizeOptions options;
    options.count = count;
    try {
      (void)run_surface(import_surface(kParts / "planar-geom-03.stl"), options);
      ADD_FAILURE() << count;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("is a sheet"), std::string::npos) << error.what();
    }
  }
}

TEST_F(Parts, ConrodHasTheVolumeOfItsUnion) {
  const VoxelizeResult result = run_file("conrod.stl", .04e-3);
  EXPECT_EQ(result.parts[0].shells, 3u);
  EXPECT_GT(result.parts[0].overlapping_voxels, 0u);
  EXPECT_NEAR(shapes::total_volume(result.parts[0]) / result.parts[0].surface_volume, 1, 1e-3);
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
    EXPECT_NEAR(shapes::total_volume(part) / part.surface_volume, 1, 1e-6);
    flipped += part.healing.flipped_facets;
    inverted += part.healing.inverted_shells;
  }
  EXPECT_GT(flipped, 0u);
  EXPECT_GT(inverted, 0u);
}

// Two places on the surface that face each other across a void, found by rays alone.
struct Gap {
  std::uint32_t polygons[2];
  Vec3 points[2];
  double width;
};

// Distance along the ray to the triangle, infinite where it misses (Moeller and Trumbore, 1997).
double ray_distance(const Vec3& from, const Vec3& along, const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const Vec3 u = b - a, v = c - a, p = along.cross(v);
  const double determinant = u.dot(p);
  if (std::abs(determinant) < 1e-30) return kMiss;
  const Vec3 offset = from - a, q = offset.cross(u);
  const double s = offset.dot(p) / determinant, t = along.dot(q) / determinant,
               distance = v.dot(q) / determinant;
  return s < 0 || t < 0 || s + t > 1 || distance <= 0 ? kMiss : distance;
}

// From the middle of every triangle outwards, while the void is narrower than `widest` and the
// triangle beyond faces back.
std::vector<Gap> gaps(const Surface& surface, double widest) {
  const Triangles triangles = triangulate(surface);
  const auto corner = [&](std::size_t t, int k) { return surface.vertices[triangles.corners[t][k]]; };
  const auto normal = [&](std::size_t t) {
    return Vec3((corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).normalized());
  };
  std::vector<Gap> found;
  for (std::size_t t = 0; t < triangles.corners.size(); ++t) {
    const Vec3 middle = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3, out = normal(t);
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t hit = t;
    for (std::size_t other = 0; other < triangles.corners.size(); ++other) {
      if (other == t) continue;
      const double distance = ray_distance(middle, out, corner(other, 0), corner(other, 1), corner(other, 2));
      if (distance < nearest) nearest = distance, hit = other;
    }
    if (nearest < widest && normal(hit).dot(out) < -.8)
      found.push_back(
          {{triangles.polygon[t], triangles.polygon[hit]}, {middle, middle + nearest * out}, nearest});
  }
  return found;
}

// Steps through connected elements from any of `from` to any of `to`; `farthest` + 1 where that many do not
// do.
int steps_between(const Adjacency& adjacency, const std::array<std::uint32_t, 8>& from,
                  const std::array<std::uint32_t, 8>& to, int farthest) {
  std::vector<int> steps(adjacency.offsets.size() - 1, -1);
  std::vector<std::uint32_t> front(from.begin(), from.end());
  for (const std::uint32_t e : from) steps[e] = 0;
  for (std::size_t next = 0; next < front.size(); ++next) {
    const std::uint32_t e = front[next];
    if (std::find(to.begin(), to.end(), e) != to.end()) return steps[e];
    if (steps[e] == farthest) break;
    for (const std::uint32_t neighbour : adjacency.of(e))
      if (steps[neighbour] < 0) steps[neighbour] = steps[e] + 1, front.push_back(neighbour);
  }
  return farthest + 1;
}

// Places that face each other across a slit narrower than 1.2 cells, between which the way through matter (in
// a lattice of 1 mm, in which the slits are nine cells wide and more) is longer than 4 cells, have no
// element in common.
TEST_F(Parts, SpringyTriggerKeepsItsSlits) {
  constexpr double kFine = 1e-3;
  const Body fine = run_file("Springy_Trigger.STL", kFine, Align::none).body;
  const Adjacency adjacency = element_adjacency(fine);
  const std::vector<Gap> places = gaps(fine.surface, 1.2 * 14e-3);
  for (const double size : {10e-3, 12e-3, 14e-3}) {
    const Body coarse = run_file("Springy_Trigger.STL", size, Align::none).body;
    EXPECT_EQ(shapes::component_count(coarse), 1u);
    std::size_t checked = 0, joined = 0;
    for (const Gap& gap : places) {
      if (gap.width > 1.2 * size) continue;
      std::array<std::uint32_t, 8> elements[2], fine_elements[2];
      for (int side = 0; side < 2; ++side) {
        const auto at = locate_on_surface(coarse, gap.polygons[side], gap.points[side]);
        const auto fine_at = locate_on_surface(fine, gap.polygons[side], gap.points[side]);
        ASSERT_TRUE(at && fine_at);
        elements[side] = coarse.cell_elements[at->cell];
        fine_elements[side] = fine.cell_elements[fine_at->cell];
      }
      const int far = static_cast<int>(4 * size / kFine);
      if (steps_between(adjacency, fine_elements[0], fine_elements[1], far) <= far) continue;
      ++checked;
      joined += std::find_first_of(elements[0].begin(), elements[0].end(), elements[1].begin(),
                                   elements[1].end()) != elements[0].end();
    }
    EXPECT_EQ(joined, 0u) << "of " << checked << " places at " << size;
    EXPECT_GT(checked, 50u) << "at " << size;
  }
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
}  // namespace flexel::voxelize
