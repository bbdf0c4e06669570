// Every real part through import, lattice and mapping: nothing is lost, nothing moves by itself, imposed
// motions are followed, units do not matter. A part is read and voxelised once for all of that.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "base/error.h"
#include "bodies.h"
#include "formats/exchange/import.h"
#include "mapping/methods/map_surface.h"
#include "mapping/report/report.h"
#include "motions.h"
#include "tests/sanitized.h"
#include "voxelize/voxelize.h"

namespace flexel::mapping {
namespace {

using test::silent;

// Sanitizers make all of this twenty times as slow: there the lattice is coarser, and of many polygons only
// some are mapped.
const std::size_t kCells = sanitized() ? 300 : 1500, kMostVertices = sanitized() ? 1000 : 5000;

const std::filesystem::path kFolder = FLEXEL_PARTS_DIR;

// These are refused: a size for 2,000 cells is larger than many of its 67 parts; UTF-16; inner walls; two
// sheets, which enclose nothing; a lattice of beams.
const std::set<std::string> kRefused = {"2CylinderEngine.glb", "box_UTF16BE.obj",
                                        "nonmanifold_cells_symmetrical.stl", "planar-geom-03.stl",
                                        "spinal_implant.3mf"};

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

// The meshes and solids of the folder; one that is not there where the folder is absent.
std::vector<std::string> parts() {
  const std::set<std::string> known = {".step", ".stl", ".obj", ".ply", ".off", ".glb", ".3mf"};
  std::set<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder, error)) {
    if (known.count(ending_of(entry.path()))) names.insert(entry.path().filename().string());
  }
  if (names.empty()) names.insert("absent.step");
  return {names.begin(), names.end()};
}

// Keeps every n-th polygon, so that at most `most` vertices are used, and says so.
void thin_out(Body& body, std::size_t most) {
  Surface& surface = body.surface;
  const std::size_t step = (surface.vertices.size() + most - 1) / most;
  if (step <= 1) return;
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> offsets{0}, corners, faces, cell_offsets{0}, cells;
  for (std::size_t p = 0; p < surface.polygon_count(); p += step) {
    for (const std::uint32_t v : surface.polygon(p)) {
      corners.push_back(static_cast<std::uint32_t>(vertices.size()));
      vertices.push_back(surface.vertices[v]);
    }
    offsets.push_back(static_cast<std::uint32_t>(corners.size()));
    faces.push_back(surface.polygon_face[p]);
    for (std::uint32_t s = body.surface_cell_offsets[p]; s < body.surface_cell_offsets[p + 1]; ++s)
      cells.push_back(body.surface_cells[s]);
    cell_offsets.push_back(static_cast<std::uint32_t>(cells.size()));
  }
  std::printf("1 of %zu of the %zu polygons is mapped\n", step, surface.polygon_count());
  surface.vertices = std::move(vertices);
  surface.polygon_offsets = std::move(offsets);
  surface.polygon_vertices = std::move(corners);
  surface.polygon_face = std::move(faces);
  surface.vertex_columns.clear();
  surface.polygon_columns.clear();
  body.surface_cell_offsets = std::move(cell_offsets);
  body.surface_cells = std::move(cells);
}

class RealPart : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    const std::filesystem::path path = kFolder / GetParam();
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
#ifndef FLEXEL_STEP
    if (ending_of(path) == ".step") GTEST_SKIP() << "built without OpenCASCADE";
#endif
    voxelize::VoxelizeOptions options;
    options.count = kCells;
    try {
      body_ = voxelize::voxelize(import_surface(path.string()), options, silent()).body;
    } catch (const InputError& error) {
      ASSERT_TRUE(kRefused.count(GetParam())) << error.what();
      GTEST_SKIP() << error.what();
    }
    thin_out(body_, kMostVertices);
    diagonal_ = bounding_box(body_.surface.vertices).diagonal();
  }

  // Over the diagonal.
  double largest_error(MapMethod method, const test::Field& field) {
    test::deform(body_, field);
    const MapResult result = map_surface(body_, {method}, silent());
    left_ = 0;
    for (const std::uint8_t flags : result.flags) {
      EXPECT_EQ(flags & ~kVoronoiCellLeft, 0);
      left_ += flags != 0;
    }
    return test::largest_error(body_, result.displacement, field) / diagonal_;
  }

  void stays_at_rest_and_follows_imposed_motions() {
    const Mat3 turn = test::rotation(2.1, Vec3(1, -2, 0.5));
    const Vec3 move(0.1, 0.2, -0.3);
    const Mat3 stretch = (Mat3() << 1.02, 0.01, 0, -0.01, 0.99, 0.005, 0, 0.01, 1.01).finished();
    for (const MapMethod method : test::kEveryMethod) {
      EXPECT_EQ(largest_error(method, [](const Vec3& x) { return x; }), 0);
      EXPECT_LT(largest_error(method, [&](const Vec3& x) -> Vec3 { return turn * x + move; }), 1e-9);
      EXPECT_EQ(left_, 0u);
      if (method == &kGramSchmidt) continue;
      EXPECT_LT(largest_error(method, [&](const Vec3& x) -> Vec3 { return turn * (stretch * x) + move; }),
                1e-9)
          << name_of(method);
    }
  }

  // In inches.
  void is_the_same_in_another_unit() {
    const double bend = 1 / diagonal_;
    test::deform(body_, [&](const Vec3& x) -> Vec3 {
      return x + Vec3(0.2 * bend * x.y() * x.z(), 0.3 * bend * x.x() * x.x(), -0.1 * bend * x.x() * x.y());
    });
    std::vector<MapResult> ones;
    for (const MapMethod method : test::kEveryMethod) ones.push_back(map_surface(body_, {method}, silent()));
    constexpr double kScale = 1 / 0.0254;
    for (Part& part : body_.parts) {
      part.lattice.origin *= kScale;
      part.lattice.spacing *= kScale;
    }
    for (auto* points : {&body_.rest, &body_.position, &body_.surface.vertices})
      for (Vec3& x : *points) x *= kScale;
    diagonal_ *= kScale;
    for (std::size_t m = 0; m < ones.size(); ++m) {
      const MapMethod method = test::kEveryMethod[m];
      const MapResult &one = ones[m], two = map_surface(body_, {method}, silent());
      double largest = 0;
      for (std::size_t v = 0; v < one.displacement.size(); ++v)
        largest = std::max(largest, (two.displacement[v] - kScale * one.displacement[v]).norm());
      EXPECT_LT(largest, 1e-9 * diagonal_) << name_of(method);
    }
  }

  void has_four_elements_for_every_vertex() {
    const MapReport found = report(body_, map_surface(body_, {}, silent()));
    EXPECT_EQ(found.kinds[0], found.vertices);
    EXPECT_LT(found.rest_residual, 1e-12 * diagonal_);
    // A vertex whose matter was too little for a cell hangs on the cell beside it.
    EXPECT_LT(found.distance_outside, 1);
  }

  Body body_;
  double diagonal_ = 0;
  std::size_t left_ = 0;  // vertices that left their Voronoi cell in the last motion
};

TEST_P(RealPart, IsMapped) {
  stays_at_rest_and_follows_imposed_motions();
  is_the_same_in_another_unit();
  has_four_elements_for_every_vertex();
}

INSTANTIATE_TEST_SUITE_P(Parts, RealPart, testing::ValuesIn(parts()), [](const auto& with) {
  std::string name = with.param;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return name;
});

}  // namespace
}  // namespace flexel::mapping
