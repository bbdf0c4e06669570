// The report on each part: text.
#include <fmt/format.h>
#include <cmath>

#include "base/human.h"
#include "base/units.h"
#include "voxelize/heal/heal.h"
#include "voxelize/report_assembly.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {
namespace {

std::string spacing_text(const Vec3& spacing) {
  if (spacing.maxCoeff() - spacing.minCoeff() <= 1e-9 * spacing.maxCoeff()) return human_length(spacing.x());
  return fmt::format("{} x {} x {}", human_length(spacing.x()), human_length(spacing.y()),
                     human_length(spacing.z()));
}

void say_volume(const VoxelizedPart& part, const std::string& name, Placement placement, Progress& progress) {
  if (!part.closed) return;
  const double lattice = part.lattice_volume + part.dropped_volume;
  progress.say(fmt::format("{}: volume of the lattice {}, of the surface {}{} ({} apart)", name,
                           human_volume(lattice), human_volume(part.surface_volume),
                           part.overlapping_voxels > 0 ? " (union of its shells)" : "",
                           human_share(std::abs(lattice / part.surface_volume - 1))));
  if (placement == Placement::corner && part.dropped_cells > 0)
    progress.say(fmt::format("{}: {} too small for a cell dropped, {} together ({} of the volume)", name,
                             counted(part.dropped_cells, "sliver"), human_volume(part.dropped_volume),
                             human_share(part.dropped_volume / part.surface_volume)));
}

void say_repairs(const VoxelizedPart& part, const std::string& name, Progress& progress) {
  for (const std::string& line : healing_lines(part.healing))
    progress.warn(fmt::format("{}: healed: {}", name, line));
  if (!part.closed)
    progress.warn(
        fmt::format("{}: the surface is not closed ({} open edges left): what is inside is judged by samples",
                    name, human_count(part.healing.left_open)));
  if (part.overlapping_voxels > 0)
    progress.say(fmt::format("{}: shells interpenetrate in {}; their union is taken", name,
                             counted(part.overlapping_voxels, "voxel")));
  if (part.undecided_voxels > 0)
    progress.warn(fmt::format("{}: the pieces of {} could not be told apart; taken as one", name,
                              counted(part.undecided_voxels, "voxel")));
}

void say_walls(const VoxelizedPart& part, const std::string& name, bool with_moments, Progress& progress) {
  if (!part.thinnest || part.thin_walls == 0) return;
  if (with_moments) {
    if (part.lost_walls > 0)
      progress.say(fmt::format("{}: walls thinner than one cell, the thinnest {}: {}", name,
                               human_length(part.thinnest->thickness), kForQuadratic));
    return;
  }
  const Vec3& at = part.thinnest->where;
  const std::string place =
      fmt::format("({}, {}, {})", human_length(at.x()), human_length(at.y()), human_length(at.z()));
  const auto share = [&](std::size_t count) {
    return human_share(static_cast<double>(count) / static_cast<double>(part.wall_samples));
  };
  if (part.lost_walls > 0) {
    progress.warn(
        fmt::format("{}: features lost: walls thinner than one cell ({} of the places measured), the "
                    "thinnest {} at {}; the "
                    "lattice holds their matter, not their shape: a size of {} gives the thinnest two cells",
                    name, share(part.lost_walls), human_length(part.thinnest->thickness), place,
                    human_length(part.thinnest->thickness / 2)));
    return;
  }
  progress.warn(
      fmt::format("{}: walls thinner than two cells, the thinnest {} at {}; a smaller size resolves them",
                  name, human_length(part.thinnest->thickness), place));
}

// Matter that no cell holds, where that is no sliver of the surface but a part's own share.
void say_lost_matter(const VoxelizedPart& part, const std::string& name, Progress& progress) {
  constexpr double kNotable = 1e-2;  // of the volume
  if (!part.closed || !(part.dropped_volume > kNotable * part.surface_volume)) return;
  progress.warn(
      fmt::format("{}: features lost: {} of the volume is in cells filled by less than 1/64, which "
                  "are dropped; a smaller size keeps it",
                  name, human_share(part.dropped_volume / part.surface_volume)));
}

void say_spread_moments(const VoxelizeResult& result, Progress& progress) {
  std::size_t spread = 0;
  for (const VoxelizedPart& part : result.parts) spread += part.spread_cells;
  if (spread > 0)
    progress.warn(
        fmt::format("model quadratic takes the matter of {} as spread evenly: a shell passes "
                    "through itself there",
                    counted(spread, "cut cell")));
}

void report_each(const VoxelizeResult& result, Progress& progress) {
  for (std::size_t p = 0; p < result.parts.size(); ++p) {
    const VoxelizedPart& part = result.parts[p];
    const Part& lattice = result.body.parts[p];
    progress.say(lattice.placement == Placement::corner
                     ? fmt::format("{}: {} elements, {} cells of {}", lattice.name,
                                   human_count(part.elements), human_count(part.cells),
                                   spacing_text(part.spacing))
                     : fmt::format("{}: {} elements, spacing {}", lattice.name, human_count(part.elements),
                                   spacing_text(part.spacing)));
    say_volume(part, lattice.name, lattice.placement, progress);
    if (part.split_voxels > 0)
      progress.say(fmt::format("{}: {} with several pieces, kept apart", lattice.name,
                               counted(part.split_voxels, "voxel")));
    say_repairs(part, lattice.name, progress);
    say_walls(part, lattice.name, result.with_moments, progress);
    if (lattice.placement == Placement::corner) say_lost_matter(part, lattice.name, progress);
  }
}

}  // namespace

void report(const VoxelizeResult& result, Progress& progress) {
  constexpr std::size_t kFew = 3;  // parts: of more, what is said of each is said once
  for (const SurfaceSource& source : result.body.surface.sources)
    if (!source.unit_given)
      progress.say(
          fmt::format("{} has no unit: {} assumed (--unit)", source.file, human_length(source.unit)));
  result.parts.size() <= kFew ? report_each(result, progress) : report_together(result, progress);
  say_spread_moments(result, progress);
  report_pairs(result, progress);
  progress.say(fmt::format("simulating this needs about {}", human_bytes(result.simulation_memory)));
}

}  // namespace flexel::voxelize
