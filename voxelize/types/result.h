// The result of voxelizing a part, besides the body.
#pragma once
#include <array>
#include <optional>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::voxelize {

// A place where the surface is thinner than it should be for the spacing.
struct ThinWall {
  double thickness = 0;       // m
  Vec3 where = Vec3::Zero();  // m, world frame, on the surface
  std::uint32_t part = 0;
};

// What was healed in one part's surface, for the classification only.
struct Healing {
  std::size_t open_edges = 0;                                                           // before
  std::size_t degenerate_facets = 0, duplicate_facets = 0, fins = 0, loose_facets = 0;  // facets left out
  std::size_t welded_edges = 0;               // open edges closed by welding at 1e-7 of the diagonal
  std::size_t holes = 0, hole_triangles = 0;  // filled, and with how many triangles
  double widest_hole = 0;                     // m
  std::size_t flipped_facets = 0;             // turned over to agree with their neighbours
  std::size_t inverted_shells = 0;            // taken the other way round: they were inside out
  std::size_t left_open = 0;                  // open edges afterwards
  bool wrapped = false;
  double wrap_alpha = 0;                                    // m, the widest opening spanned
  enum class By { surface, vote, flood } by = By::surface;  // the classifier that was used
};

// What was found for one part.
struct VoxelizedPart {
  bool closed = false;  // every edge has two triangles, consistently oriented
  std::uint32_t shells = 0;
  double surface_volume = 0;  // m^3, of the union where shells interpenetrate
  double lattice_volume = 0;  // m^3, sum of fill x cell volume of the cells kept
  double dropped_volume = 0;  // m^3 in cells under fill 1/64
  std::size_t cells = 0, elements = 0, dropped_cells = 0;
  std::size_t split_voxels = 0;        // voxels that hold more than one piece
  std::size_t overlapping_voxels = 0;  // in which shells interpenetrate; fill from 64 x 64 lines
  std::size_t undecided_voxels = 0;    // voxels whose pieces could not be told apart
  std::size_t spread_cells = 0;        // cut cells whose moments are those of matter spread evenly
  Healing healing;
  std::size_t disagreements = 0;  // voxels where the parities of the three axes differ (open surfaces)
  Vec3 spacing = Vec3::Zero();
  std::optional<ThinWall> thinnest;  // thinnest wall found
  double fifth_wall = 1e300;         // m: a fifth of the matter lies in thinner walls
  std::size_t thin_walls = 0;        // sampled places thinner than two cells
  std::size_t lost_walls = 0;        // of them, thinner than one cell: the lattice does not have their shape
  std::size_t wall_samples = 0;      // places sampled
};

// Two parts that lie in each other, or that miss each other by less than a cell.
struct PartPair {
  std::array<std::uint32_t, 2> parts{};
  bool same = false;   // one body twice
  double overlap = 0;  // m^3 in both; 0: none
  double gap = 0;      // m, where nothing is in both
};

struct VoxelizeResult {
  Body body;
  std::vector<VoxelizedPart> parts;
  std::vector<PartPair> pairs;
  double size = 0;  // m, asked for, or chosen for the count
  bool with_moments = false;
  double simulation_memory = 0;  // bytes that simulate will need at equilibrium, estimated
};

// A part as healing makes it, without a lattice.
struct MeasuredPart {
  std::optional<double> volume;  // m^3, of the union where shells interpenetrate; none where it stays open
  std::optional<ThinWall> thinnest;
  Healing healing;
};

}  // namespace flexel::voxelize
