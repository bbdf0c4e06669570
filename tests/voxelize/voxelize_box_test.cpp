// A box of a part has the cells that the whole part has there.
#include "voxelize/voxelize_box.h"

#include <gmock/gmock.h>

#include <map>

#include "base/error.h"
#include "formats/lattice/cell_moments.h"
#include "tests/voxelize/shapes.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

VoxelizeResult exactly_voxelized(const Mesh& mesh, double size) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = size;
  options.align = Align::none;
  options.moments = true;
  options.max_memory = 1e12;
  return voxelize(surface(mesh), options, progress);
}

struct AskedBox {
  Lattice lattice;
  Index3 lower{}, upper{};
};

// (cells) by voxel: fill and moments; those of whole cells are known.
using BoxCells = std::multimap<Index3, std::vector<double>>;
BoxCells box_cells(const Body& body, const Index3& lower, const Index3& upper) {
  BoxCells cells;
  std::size_t next = 0;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    std::vector<double> values(1, body.fill[c]);
    if (next < body.moment_cells.size() && body.moment_cells[next] == c) {
      values.insert(values.end(), &body.moments[kMoments * next], &body.moments[kMoments * next] + kMoments);
      ++next;
    }
    const Index3& at = body.lattice_index[body.cell_elements[c][0]];
    bool in = true;
    for (std::size_t axis = 0; axis < 3; ++axis) in &= at[axis] >= lower[axis] && at[axis] < upper[axis];
    if (in) cells.emplace(at, values);
  }
  return cells;
}

void expect_cells_of_the_whole(const BoxCells& box, const BoxCells& whole) {
  ASSERT_EQ(box.size(), whole.size());
  for (auto a = box.begin(), b = whole.begin(); a != box.end(); ++a, ++b) {
    EXPECT_EQ(a->first, b->first);
    ASSERT_EQ(a->second.size(), b->second.size());
    for (std::size_t i = 0; i < a->second.size(); ++i) EXPECT_NEAR(a->second[i], b->second[i], 1e-10);
  }
}

TEST(VoxelizeBox, HasTheCellsOfTheWhole) {
  std::mt19937 random(7);
  const Mesh hollow = merged(icosphere(3, 1), inverted(icosphere(3, 0.6)));
  for (const Mesh& mesh :
       {box(Vec3::Zero(), Vec3(1, 0.5, 0.25)), torus(1, 0.3, 24, 16), fork(0.15, 0.06, 0.2, 0.3), hollow}) {
    const Mesh turned_mesh = transformed(mesh, random_rotation(random));
    const VoxelizeResult whole = exactly_voxelized(turned_mesh, 0.11);
    const BoxVoxelizer boxes(whole.body.surface, {});
    AskedBox asked;
    asked.lattice = whole.body.parts.front().lattice;
    std::uniform_int_distribution<std::size_t> any(0, whole.body.cell_count() - 1);
    for (int n = 0; n < 6; ++n) {
      asked.lower = whole.body.lattice_index[whole.body.cell_elements[any(random)][0]];
      asked.upper = asked.lower;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        asked.lower[axis] -= 2;
        asked.upper[axis] += 3;
      }
      const Body part = boxes(asked.lattice, asked.lower, asked.upper);
      check(part, "box");
      expect_cells_of_the_whole(box_cells(part, asked.lower, asked.upper),
                                box_cells(whole.body, asked.lower, asked.upper));
    }
  }
}

// Eight cells of half the spacing hold what one holds.
TEST(VoxelizeBox, FinerCellsHoldTheSameMatter) {
  const VoxelizeResult whole =
      exactly_voxelized(transformed(torus(1, 0.3, 24, 16), turned(0.3, 0.5, 0.7)), 0.15);
  const BoxVoxelizer boxes(whole.body.surface, {});
  AskedBox asked;
  asked.lattice = whole.body.parts.front().lattice;
  asked.lower = whole.body.lattice_index[whole.body.cell_elements[whole.body.cell_count() / 2][0]];
  asked.upper = {asked.lower[0] + 4, asked.lower[1] + 4, asked.lower[2] + 4};
  const auto matter = [](const BoxCells& cells) {
    double sum = 0;
    for (const auto& each : cells) sum += each.second[0];
    return sum;
  };
  const double coarse = matter(box_cells(whole.body, asked.lower, asked.upper));
  AskedBox finer = asked;
  finer.lattice.spacing /= 2;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    finer.lower[axis] *= 2;
    finer.upper[axis] *= 2;
  }
  EXPECT_NEAR(matter(box_cells(boxes(finer.lattice, finer.lower, finer.upper), finer.lower, finer.upper)) / 8,
              coarse, 1e-3 * coarse);
}

TEST(VoxelizeBox, RefusesABoxWithoutMatter) {
  const VoxelizeResult whole = exactly_voxelized(box(Vec3::Zero(), Vec3::Ones()), 0.25);
  AskedBox far;
  far.lattice = whole.body.parts.front().lattice;
  far.lower = {100, 100, 100};
  far.upper = {105, 105, 105};
  EXPECT_THROW((void)BoxVoxelizer(whole.body.surface, {})(far.lattice, far.lower, far.upper), InputError);
}

}  // namespace
}  // namespace flexel::voxelize
