// Surface -> Body: inside and outside, fill fractions, pieces, lattice.
#pragma once
#include <optional>
#include <string>

#include "formats/body.h"
#include "formats/progress.h"
#include "formats/surface.h"

namespace flexel {

enum class Align { snap, box, none };

struct VoxelizeOptions {
  std::optional<double> size;  // spacing h [m]
  std::optional<std::size_t>
      count;  // or about this many cells (elements for centre placement) over all parts; default 20,000
  Placement placement = Placement::corner;
  Align align = Align::snap;
  std::string material;              // of every part; "" leaves it to the scene
  std::optional<double> max_memory;  // bytes; default 80 % of what is free
};

// A place where the surface is thinner than it should be for the spacing.
struct ThinWall {
  double thickness = 0;       // m
  Vec3 where = Vec3::Zero();  // m, world frame, on the surface
  std::uint32_t part = 0;
};

// What was found for one part.
struct VoxelizedPart {
  bool closed = false;  // every edge has two triangles, consistently oriented
  std::uint32_t shells = 0;
  double surface_volume = 0;  // m^3, of the union where shells interpenetrate
  double lattice_volume = 0;  // m^3, sum of fill x cell volume of the cells kept
  double dropped_volume = 0;  // m^3 in cells under fill 1/64
  std::size_t cells = 0, elements = 0, dropped_cells = 0;
  std::size_t split_voxels = 0;  // voxels that hold more than one piece
  std::size_t overlapping_voxels =
      0;  // voxels in which shells interpenetrate; their fill comes from 64 x 64 lines
  std::size_t undecided_voxels = 0;   // voxels whose pieces could not be told apart
  std::size_t flipped_triangles = 0;  // turned over to agree with their neighbours
  std::size_t inverted_shells = 0;    // taken the other way round: they were inside out
  bool cracks_closed = false;         // vertices within 1e-7 of the diagonal were welded to close the surface
  std::size_t disagreements =
      0;  // voxels where the votes of the three axes differ (surfaces that are not closed)
  Vec3 spacing = Vec3::Zero();
  std::optional<ThinWall> thinnest;  // thinnest wall found
  std::size_t thin_walls = 0;        // sampled places thinner than two cells
};

struct VoxelizeResult {
  Body body;
  std::vector<VoxelizedPart> parts;
  double simulation_memory = 0;  // bytes that simulate will need at equilibrium, estimated
};

// Voxelises every part of `surface`, which is moved into the body. Throws InputError: no size that fits the
// part (a spacing larger than it), nothing inside, memory beyond the limit (before allocating).
[[nodiscard]] VoxelizeResult voxelize(Surface surface, const VoxelizeOptions& options, Progress& progress);

// Says what was found, a few lines a part.
void report(const VoxelizeResult& result, Progress& progress);

// Thinnest wall of each part, measured along rays through the surface on a grid of `rays` lines per axis:
// distance between an entry and the next exit whose normals oppose each other, times the cosine to the ray.
// Nothing where a part is not closed.
[[nodiscard]] std::vector<std::optional<ThinWall>> thinnest_walls(const Surface& surface, int rays = 256);

}  // namespace flexel
