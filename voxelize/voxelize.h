// Surface -> Body: inside and outside, fill fractions, pieces, lattice.
#pragma once
#include <array>
#include <optional>
#include <string>

#include "formats/body.h"
#include "formats/progress.h"
#include "formats/surface.h"

namespace flexel {

enum class Align { snap, box, none };
// What is done to surfaces that are not closed before inside is told from outside; docs/healing.md.
enum class Heal { none, automatic, wrap };
struct HealChoice {
  Heal mode = Heal::automatic;
  std::optional<double> alpha =
      std::nullopt;  // m, wrap: the widest opening that it spans; default a hundredth of the diagonal
};
// From "none", "auto", "wrap", "wrap:5 mm"; throws InputError naming --heal.
[[nodiscard]] HealChoice heal_choice(const std::string& word);

// From "corner", "centre"; throws InputError naming --placement.
[[nodiscard]] Placement placement_choice(const std::string& word);

struct VoxelizeOptions {
  std::optional<double> size;  // spacing h [m]
  std::optional<std::size_t>
      count;  // or about this many cells (elements for centre placement) over all parts; default 20,000
  Placement placement = Placement::corner;
  Align align = Align::snap;
  HealChoice heal;
  std::string material;              // of every part; "" leaves it to the scene
  std::optional<double> max_memory;  // bytes; default 80 % of what is free
};

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
  enum class By { surface, vote, flood } by = By::surface;  // what told inside from outside
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
  std::size_t undecided_voxels = 0;  // voxels whose pieces could not be told apart
  Healing healing;
  std::size_t disagreements =
      0;  // voxels where the votes of the three axes differ (surfaces that are not closed)
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
  double simulation_memory = 0;  // bytes that simulate will need at equilibrium, estimated
};

// Voxelises every part of `surface`, which is moved into the body, its polygons turned outward (outward.h).
// Throws InputError: no size that fits the part (a spacing larger than it), nothing inside, memory beyond the
// limit (before allocating), two parts that are one body in one place.
[[nodiscard]] VoxelizeResult voxelize(Surface surface, const VoxelizeOptions& options, Progress& progress);

// Says what was found, a few lines a part.
void report(const VoxelizeResult& result, Progress& progress);
// The same as JSON, in SI units (docs/voxelize.md).
[[nodiscard]] std::string summary_json(const VoxelizeResult& result);

// A part as healing makes it, without a lattice.
struct MeasuredPart {
  std::optional<double> volume;  // m^3, of the union where shells interpenetrate; none where it stays open
  std::optional<ThinWall> thinnest;
  Healing healing;
};
// Heals every part as the voxelizer does (Heal::automatic), turns the polygons of `surface` outward
// (outward.h), and measures: the volume, and the thinnest wall along rays through the surface on a grid of
// `rays` lines per axis: distance between an entry and the next exit whose normals oppose each other, times
// the cosine to the ray.
[[nodiscard]] std::vector<MeasuredPart> heal_and_measure(Surface& surface, int rays = 256);

}  // namespace flexel
