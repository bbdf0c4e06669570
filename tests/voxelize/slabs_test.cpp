// Lattices in pieces: put together they are the whole lattice, to the bit.
#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "base/error.h"
#include "formats/lattice/body_file.h"
#include "formats/pieces/join.h"
#include "tests/sanitized.h"
#include "tests/scratch.h"
#include "tests/voxelize/shapes.h"
#include "voxelize/slabs/layers.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;
using test::Scratch;

struct Case {
  const char* name;
  Mesh mesh;
  double size;
  bool moments = false;
};

// A facet that stands off the part: healing leaves it out, and it lies over the cells beneath all the same.
Mesh with_fin(Mesh mesh) {
  mesh.vertices.emplace_back(4.5, -1.5, 1);
  mesh.triangles.push_back({0, 1, static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  return mesh;
}

// Box along each axis; curved; in two fragments with nothing between; leaves thinner than a cell; turned, so that slivers
// are dropped and voxels hold several pieces.
std::vector<Case> cases() {
  const Mat3 turned_all = turned(.3, .5, .7);
  return {{"along_x", box({0, 0, 0}, {9.3, 3, 2}), 1},
          {"along_y", box({0, 0, 0}, {3, 9.3, 2}), 1, true},
          {"along_z", box({0, 0, 0}, {3, 2, 9.3}), 1},
          {"ball", icosphere(2, 4), .9, true},
          {"ring", torus(5, 1.3, 24, 12), .8},
          {"apart", merged(box({0, 0, 0}, {3, 3, 3}), box({8, 1, 1}, {12, 2.5, 3})), .7},
          {"fork", transformed(fork(.06, .03, .3, .4), turned_all), .1},
          {"leaves", transformed(fork(.06, .03, 0, .4), turned(.2, .1, 0)), .11, true},
          {"plate", transformed(box({0, 0, 0}, {9, 8, .4}), turned_all), .7},
          {"healed", with_fin(box({0, 0, 0}, {9.3, 3, 2})), 1},
          {"shells_cross", merged(box({0, 0, 0}, {5, 2, 2}), box({4, .5, .3}, {9, 1.7, 1.2})), .6, true}};
}

VoxelizeOptions options_of(const Case& each, std::size_t pieces) {
  VoxelizeOptions options;
  options.size = each.size;
  options.align = Align::none;
  options.moments = each.moments;
  options.max_memory = 1e12;
  options.pieces = pieces;
  return options;
}

// The files of the pieces.
VoxelizeResult write_all(const Surface& surface, const VoxelizeOptions& options, const std::string& list) {
  Progress progress("test", Progress::Mode::quiet);
  std::vector<vtu::HeadArray> arrays;
  std::uint64_t run = 0;
  const auto use = [&](Body& whole, PieceBody& piece) {
    arrays = write_piece(piece, list, write_shared_surface(whole, list));
    run = piece.numbers.run;
  };
  VoxelizeResult result = voxelize_pieces(surface, options, use, progress);
  write_piece_list(list, run, static_cast<std::uint32_t>(options.pieces), arrays);
  return result;
}

VoxelizeResult whole_of(const Surface& surface, const VoxelizeOptions& options) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions whole = options;
  whole.pieces = 0;
  return voxelize(surface, whole, progress);
}

void expect_same_report(const VoxelizeResult& pieces, const VoxelizeResult& whole) {
  ASSERT_EQ(pieces.parts.size(), whole.parts.size());
  for (std::size_t p = 0; p < whole.parts.size(); ++p) {
    const VoxelizedPart &a = pieces.parts[p], &b = whole.parts[p];
    EXPECT_EQ(a.cells, b.cells);
    EXPECT_EQ(a.elements, b.elements);
    EXPECT_EQ(a.dropped_cells, b.dropped_cells);
    EXPECT_EQ(a.split_voxels, b.split_voxels);
    EXPECT_EQ(a.overlapping_voxels, b.overlapping_voxels);
    EXPECT_EQ(a.undecided_voxels, b.undecided_voxels);
    EXPECT_EQ(a.spread_cells, b.spread_cells);
    EXPECT_NEAR(a.lattice_volume, b.lattice_volume, 1e-12 * b.lattice_volume);
    EXPECT_NEAR(a.dropped_volume, b.dropped_volume, 1e-12 * b.lattice_volume);
  }
}

TEST(Slabs, PutTogetherAreTheWholeToTheBit) {
  for (const Case& each : cases())
    for (const std::size_t pieces :
         less_if_sanitized<std::vector<std::size_t>>({1, 2, 3, 7}, {2, 7}, "2 and 7 pieces")) {
      SCOPED_TRACE(testing::Message() << each.name << " in " << pieces);
      const Scratch scratch;
      const Surface part = surface(each.mesh);
      const VoxelizeOptions options = options_of(each, pieces);
      const VoxelizeResult whole = whole_of(part, options);
      const std::string list = scratch.path("body.pvtu");
      std::optional<VoxelizeResult> made;
      try {
        made = write_all(part, options, list);
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("--pieces 7: part"));
        continue;
      }
      expect_same_report(*made, whole);
      EXPECT_TRUE(body_bytes(join_pieces(read_piece_list(list))) == body_bytes(whole.body));
    }
}

// What every piece promises to who solves on it.
TEST(Slabs, OwnPointsOfAPieceHaveAllTheirCells) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.name);
    const Scratch scratch;
    const std::string list = scratch.path("body.pvtu");
    const VoxelizeResult whole = [&] {
      (void)write_all(surface(each.mesh), options_of(each, 3), list);
      return whole_of(surface(each.mesh), options_of(each, 3));
    }();
    const PieceFiles files = read_piece_list(list);
    // Cells around each point of the whole, by the place of the point.
    using Place = std::tuple<int, int, int, int>;
    const auto place = [](const Body& body, std::uint32_t e) {
      const Index3& at = body.lattice_index[e];
      return Place(at[0], at[1], at[2], body.piece[e]);
    };
    std::map<Place, int> around;
    for (const auto& cell : whole.body.cell_elements)
      for (const std::uint32_t e : cell) ++around[place(whole.body, e)];
    std::size_t own_cells = 0;
    std::int64_t own_points = 0;
    std::map<std::int64_t, Place> point;
    for (std::uint32_t r = 0; r < 3; ++r) {
      const PieceBody piece = read_piece(files, r);
      std::map<std::uint32_t, int> here;
      for (const auto& cell : piece.body.cell_elements)
        for (const std::uint32_t e : cell) ++here[e];
      for (std::uint32_t e = 0; e < piece.body.element_count(); ++e) {
        const auto [known, fresh] = point.try_emplace(piece.global_point[e], place(piece.body, e));
        EXPECT_EQ(known->second, place(piece.body, e)) << "one number, one place";
        EXPECT_EQ(piece.numbers.owner(piece.global_point[e]) == r, piece.numbers.owns(piece.global_point[e]));
        if (!piece.numbers.owns(piece.global_point[e])) continue;
        ++own_points;
        EXPECT_EQ(here[e], around[place(piece.body, e)]);
      }
      own_cells +=
          static_cast<std::size_t>(std::count(piece.ghost_cells.begin(), piece.ghost_cells.end(), 0));
      // A body like any other
      const Body alone = read_body(files.files[r]);
      EXPECT_EQ(alone.cell_count(), piece.body.cell_count());
    }
    EXPECT_EQ(own_cells, whole.body.cell_count());
    EXPECT_EQ(own_points, static_cast<std::int64_t>(whole.body.element_count()));
    EXPECT_EQ(point.size(), whole.body.element_count());
  }
}

TEST(Slabs, OfTwoPartsAreCutEachAlongItsOwnAxis) {
  Surface parts = surface(box({0, 0, 0}, {9, 3, 2}));
  const Surface other = surface(box({0, 20, 0}, {2, 23, 11}));
  const auto vertices = static_cast<std::uint32_t>(parts.vertices.size());
  for (const Vec3& v : other.vertices) parts.vertices.push_back(v);
  for (std::size_t p = 0; p < other.polygon_count(); ++p) {
    for (const std::uint32_t v : other.polygon(p)) parts.polygon_vertices.push_back(v + vertices);
    parts.polygon_offsets.push_back(static_cast<std::uint32_t>(parts.polygon_vertices.size()));
    parts.polygon_face.push_back(other.polygon_face[p] + static_cast<std::uint32_t>(parts.faces.size()));
  }
  parts.parts.push_back({"second", ""});
  if (!parts.part_source.empty()) parts.part_source.push_back(parts.part_source[0]);
  for (SurfaceFace face : other.faces) {
    face.part = 1;
    parts.faces.push_back(face);
  }
  const Case each{"two", {}, .8};
  for (const std::size_t pieces : {1, 2, 4}) {
    const Scratch scratch;
    const std::string list = scratch.path("body.pvtu");
    (void)write_all(parts, options_of(each, pieces), list);
    EXPECT_TRUE(body_bytes(join_pieces(read_piece_list(list))) ==
                body_bytes(whole_of(parts, options_of(each, pieces)).body));
  }
}

// A cell by the places of its elements.
using ElementPlace = std::tuple<int, int, int, int>;
using CellPlace = std::array<ElementPlace, 8>;
CellPlace place_of_cell(const Body& body, std::uint32_t cell) {
  CellPlace place;
  for (std::size_t a = 0; a < 8; ++a) {
    const std::uint32_t e = body.cell_elements[cell][a];
    const Index3& at = body.lattice_index[e];
    place[a] = {at[0], at[1], at[2], body.piece[e]};
  }
  return place;
}

// 0, 1 or 2 as PiecesAround has it, 3 elsewhere; from the whole body alone.
std::vector<std::uint8_t> rings_of(const Body& whole, const std::vector<bool>& own) {
  std::vector<std::uint8_t> ring(whole.cell_count(), 3);
  std::vector<bool> reached(whole.element_count(), false);
  for (std::uint8_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < ring.size(); ++c) {
      const auto& corners = whole.cell_elements[c];
      const bool next =
          std::any_of(corners.begin(), corners.end(), [&](std::uint32_t e) { return reached[e]; });
      if (ring[c] == 3 && (r == 0 ? own[c] : next)) ring[c] = r;
    }
    for (std::size_t c = 0; c < ring.size(); ++c)
      if (ring[c] == r)
        for (const std::uint32_t e : whole.cell_elements[c]) reached[e] = true;
  }
  return ring;
}

// Of the cells with ring < 3: place, ring, whose they are, fill, and the polygons that they lie under.
using CellsAround =
    std::map<CellPlace, std::tuple<std::uint8_t, std::uint32_t, double, std::vector<std::uint32_t>>>;
CellsAround cells_around(const Body& body, const std::vector<std::uint8_t>& ring,
                         const std::vector<std::uint32_t>& piece) {
  std::vector<std::vector<std::uint32_t>> under(body.cell_count());
  for (std::uint32_t p = 0; p < body.surface.polygon_count(); ++p)
    for (std::uint32_t i = body.surface_cell_offsets[p]; i < body.surface_cell_offsets[p + 1]; ++i)
      under[body.surface_cells[i]].push_back(p);
  CellsAround cells;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (ring[c] < 3) cells[place_of_cell(body, c)] = {ring[c], piece[c], body.fill[c], under[c]};
  return cells;
}

TEST(Slabs, SomePiecesComeWithTwoRingsOfCellsAround) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.name);
    const Scratch scratch;
    const std::string list = scratch.path("body.pvtu");
    (void)write_all(surface(each.mesh), options_of(each, 3), list);
    const PieceFiles files = read_piece_list(list);
    const Body whole = join_pieces(files);
    std::map<CellPlace, std::uint32_t> owner;
    std::array<std::set<CellPlace>, 3> ghosts;
    for (std::uint32_t r = 0; r < 3; ++r) {
      const PieceBody piece = read_piece(files, r);
      for (std::uint32_t c = 0; c < piece.body.cell_count(); ++c)
        piece.ghost_cells[c] ? void(ghosts[r].insert(place_of_cell(piece.body, c)))
                             : void(owner[place_of_cell(piece.body, c)] = r);
    }
    std::vector<std::uint32_t> piece;
    for (std::uint32_t c = 0; c < whole.cell_count(); ++c) piece.push_back(owner.at(place_of_cell(whole, c)));
    for (const auto& [first, end] : {std::pair(0u, 1u), {1u, 2u}, {2u, 3u}, {0u, 2u}, {0u, 3u}}) {
      std::vector<bool> own;
      for (const std::uint32_t of : piece) own.push_back(of >= first && of < end);
      std::vector<std::uint8_t> ring = rings_of(whole, own);
      for (std::uint32_t c = 0; c < whole.cell_count(); ++c)
        for (std::uint32_t r = first; r < end; ++r)
          if (ring[c] == 3 && ghosts[r].contains(place_of_cell(whole, c))) ring[c] = 2;
      const PiecesAround found = join_around(files, first, end);
      EXPECT_TRUE(cells_around(found.body, found.ring, found.piece) == cells_around(whole, ring, piece));
      EXPECT_EQ(found.point.size(), found.body.element_count());
      EXPECT_EQ(std::set(found.point.begin(), found.point.end()).size(), found.point.size());
    }
  }
}

TEST(Slabs, OfACountHaveTheSpacingOfTheWhole) {
  const Case each{"ring", torus(5, 1.3, 24, 12), 1};
  VoxelizeOptions options = options_of(each, 3);
  options.size.reset();
  options.count = 900;
  const Scratch scratch;
  const std::string list = scratch.path("body.pvtu");
  const VoxelizeResult made = write_all(surface(each.mesh), options, list);
  const VoxelizeResult whole = whole_of(surface(each.mesh), options);
  EXPECT_EQ(made.size, whole.size);
  EXPECT_TRUE(body_bytes(join_pieces(read_piece_list(list))) == body_bytes(whole.body));
}

TEST(Slabs, AreRefusedWhereTheyCannotBeCut) {
  const auto refused = [](const Mesh& mesh, VoxelizeOptions options) {
    Progress progress("test", Progress::Mode::quiet);
    try {
      (void)voxelize_pieces(
          surface(mesh), options, [](Body&, PieceBody&) {}, progress);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const Case thin{"thin", box({0, 0, 0}, {3, 2, 1}), 1};
  EXPECT_THAT(refused(thin.mesh, options_of(thin, 4)), testing::HasSubstr("3 layers"));
  VoxelizeOptions centre = options_of(thin, 2);
  centre.placement = Placement::centre;
  EXPECT_THAT(refused(thin.mesh, centre), testing::HasSubstr("--placement corner"));
  Mesh open = thin.mesh;
  open.triangles.pop_back();
  VoxelizeOptions as_it_is = options_of(thin, 2);
  as_it_is.heal.mode = Heal::none;
  EXPECT_THAT(refused(open, as_it_is), testing::HasSubstr("not closed"));
}

TEST(Slabs, OfEqualLayersDifferByOneAtMost) {
  PartLayers layers;
  layers.cells.assign(100, 10);
  const std::vector<std::size_t> cut = cut_layers(layers, 7);
  for (std::size_t r = 0; r < 7; ++r) {
    EXPECT_GE(cut[r + 1] - cut[r], 14u);
    EXPECT_LE(cut[r + 1] - cut[r], 15u);
  }
}

TEST(Slabs, AscendAndHaveCellsEach) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 300; ++trial) {
    PartLayers layers;
    const std::size_t n = 1 + random() % 40;
    for (std::size_t l = 0; l < n; ++l) layers.cells.push_back(random() % 3 == 0 ? 0 : random() % 100);
    layers.cells.front() = layers.cells.back() = 1;
    const auto full = static_cast<std::size_t>(n - std::count(layers.cells.begin(), layers.cells.end(), 0u));
    const std::size_t pieces = 1 + random() % 12;
    const std::vector<std::size_t> cut = cut_layers(layers, pieces);
    if (full < pieces) {
      EXPECT_TRUE(cut.empty());
      continue;
    }
    ASSERT_EQ(cut.size(), pieces + 1);
    EXPECT_EQ(cut.front(), 0u);
    EXPECT_EQ(cut.back(), n);
    for (std::size_t r = 0; r < pieces; ++r) {
      const auto begin = layers.cells.begin() + static_cast<std::ptrdiff_t>(cut[r]),
                 end = layers.cells.begin() + static_cast<std::ptrdiff_t>(cut[r + 1]);
      EXPECT_GT(std::accumulate(begin, end, std::size_t{0}), 0u);
    }
  }
}

}  // namespace
}  // namespace flexel::voxelize
