// Per finding, the sum over the parts and the worst part.
#include "voxelize/report_assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/units.h"
#include "voxelize/heal/heal.h"

namespace flexel::voxelize {
namespace {

using Has = std::function<bool(const VoxelizedPart&)>;

// "3 of 18 parts ("nut", "bolt", ...)", the parts that have it; "" where none has.
std::string parts_with(const VoxelizeResult& result, const Has& has) {
  constexpr std::size_t kNamed = 3;
  std::size_t count = 0;
  std::string names;
  for (std::size_t p = 0; p < result.parts.size(); ++p)
    if (has(result.parts[p]) && ++count <= kNamed)
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", result.body.parts[p].name);
  if (count == 0) return "";
  return fmt::format("{} of {} parts ({}{})", human_count(count), human_count(result.parts.size()), names,
                     count > kNamed ? ", ..." : "");
}

void say_sums(const VoxelizeResult& result, Progress& progress) {
  std::size_t elements = 0, cells = 0, split = 0;
  double least = result.parts[0].spacing.minCoeff(), most = 0, lattice = 0, surface = 0, dropped = 0,
         worst = 0;
  for (const VoxelizedPart& part : result.parts) {
    elements += part.elements;
    cells += part.cells;
    split += part.split_voxels;
    least = std::min(least, part.spacing.minCoeff());
    most = std::max(most, part.spacing.maxCoeff());
    if (!part.closed) continue;
    lattice += part.lattice_volume + part.dropped_volume;
    surface += part.surface_volume;
    dropped += part.dropped_volume;
    worst = std::max(worst, std::abs((part.lattice_volume + part.dropped_volume) / part.surface_volume - 1));
  }
  const std::string spacing =
      most - least <= 1e-9 * most ? human_length(most) : human_length(least) + " to " + human_length(most);
  progress.say(result.body.parts[0].placement == Placement::corner
                   ? fmt::format("{} parts: {} elements, {} cells of {}", human_count(result.parts.size()),
                                 human_count(elements), human_count(cells), spacing)
                   : fmt::format("{} parts: {} elements, spacing {}", human_count(result.parts.size()),
                                 human_count(elements), spacing));
  if (surface > 0)
    progress.say(
        fmt::format("volume of the lattices {}, of the surfaces {} (largest relative difference {:.1e}, "
                    "{:.1e} in slivers that were dropped)",
                    human_volume(lattice), human_volume(surface), worst, dropped / surface));
  if (split > 0) progress.say(fmt::format("{} voxels hold several pieces, kept apart", human_count(split)));
}

void say_healing(const VoxelizeResult& result, Progress& progress) {
  Healing sum;
  for (const VoxelizedPart& part : result.parts) {
    const Healing& done = part.healing;
    sum.degenerate_facets += done.degenerate_facets;
    sum.duplicate_facets += done.duplicate_facets;
    sum.fins += done.fins;
    sum.loose_facets += done.loose_facets;
    sum.welded_edges += done.welded_edges;
    sum.holes += done.holes;
    sum.hole_triangles += done.hole_triangles;
    sum.widest_hole = std::max(sum.widest_hole, done.widest_hole);
    sum.flipped_facets += done.flipped_facets;
    sum.inverted_shells += done.inverted_shells;
    sum.wrapped |= done.wrapped;
    sum.wrap_alpha = std::max(sum.wrap_alpha, done.wrap_alpha);
  }
  const std::string which =
      parts_with(result, [](const VoxelizedPart& part) { return !healing_lines(part.healing).empty(); });
  for (const std::string& line : healing_lines(sum))
    progress.warn(fmt::format("healed in {}: {}", which, line));
}

void say_doubts(const VoxelizeResult& result, Progress& progress) {
  if (const std::string which = parts_with(result, [](const VoxelizedPart& part) { return !part.closed; });
      !which.empty())
    progress.warn(
        fmt::format("the surfaces of {} are not closed: what is inside is judged by samples", which));
  if (const std::string which =
          parts_with(result, [](const VoxelizedPart& part) { return part.overlapping_voxels > 0; });
      !which.empty())
    progress.say(fmt::format("shells interpenetrate within {}; their union is taken", which));
  if (const std::string which =
          parts_with(result, [](const VoxelizedPart& part) { return part.undecided_voxels > 0; });
      !which.empty())
    progress.warn(fmt::format("pieces in some voxels of {} could not be told apart; taken as one", which));
}

void say_losses(const VoxelizeResult& result, Progress& progress) {
  const auto thinnest = [&](const Has& has) {
    std::size_t least = result.parts.size();
    for (std::size_t p = 0; p < result.parts.size(); ++p)
      if (has(result.parts[p]) &&
          (least == result.parts.size() ||
           result.parts[p].thinnest->thickness < result.parts[least].thinnest->thickness))
        least = p;
    return fmt::format("{} in \"{}\"", human_length(result.parts[least].thinnest->thickness),
                       result.body.parts[least].name);
  };
  const Has lost = [](const VoxelizedPart& part) { return part.thinnest && part.lost_walls > 0; };
  const Has thin = [&](const VoxelizedPart& part) {
    return part.thinnest && part.thin_walls > 0 && !lost(part);
  };
  const bool with_moments = result.with_moments;
  if (const std::string which = parts_with(result, lost); !which.empty() && with_moments)
    progress.say(fmt::format("walls thinner than one cell in {}, the thinnest {}: {}", which, thinnest(lost),
                             kForQuadratic));
  else if (!which.empty())
    progress.warn(
        fmt::format("features lost: walls thinner than one cell in {}, the thinnest {}; the lattice "
                    "holds their matter, not their shape",
                    which, thinnest(lost)));
  if (const std::string which = parts_with(result, thin); !which.empty() && !with_moments)
    progress.warn(
        fmt::format("walls thinner than two cells in {}, the thinnest {}; a smaller size resolves them",
                    which, thinnest(thin)));
  constexpr double kNotable = 1e-2;  // of the volume
  if (const std::string which = parts_with(result,
                                           [](const VoxelizedPart& part) {
                                             return part.closed && part.cells > 0 &&
                                                    part.dropped_volume > kNotable * part.surface_volume;
                                           });
      !which.empty())
    progress.warn(
        fmt::format("features lost: more than 1 % of the volume of {} is in cells filled by less than "
                    "1/64, which are dropped; a smaller size keeps it",
                    which));
}

std::string names_of(const PartPair& pair, const Body& body) {
  return fmt::format("\"{}\" and \"{}\"", body.parts[pair.parts[0]].name, body.parts[pair.parts[1]].name);
}

void say_overlaps(const VoxelizeResult& result, Progress& progress) {
  const PartPair* most = nullptr;
  std::size_t count = 0;
  double sum = 0;
  for (const PartPair& pair : result.pairs) {
    if (!(pair.overlap > 0)) continue;
    ++count;
    sum += pair.overlap;
    if (!most || pair.overlap > most->overlap) most = &pair;
  }
  if (count == 0) return;
  constexpr const char* kMeans =
      "counts twice in mass and stiffness, and joins nothing; cut one from the other in CAD, or unite them";
  if (count == 1)
    progress.warn(fmt::format("parts {} overlap: {} lies in both, {}", names_of(*most, result.body),
                              human_volume(most->overlap), kMeans));
  else
    progress.warn(fmt::format("{} pairs of parts overlap, {} most ({} of {}): what lies in both {}",
                              human_count(count), names_of(*most, result.body), human_volume(most->overlap),
                              human_volume(sum), kMeans));
}

void say_gaps(const VoxelizeResult& result, Progress& progress) {
  const PartPair* widest = nullptr;
  std::size_t count = 0;
  for (const PartPair& pair : result.pairs) {
    if (pair.overlap > 0) continue;
    ++count;
    if (!widest || pair.gap > widest->gap) widest = &pair;
  }
  if (count == 0) return;
  const Body& body = result.body;
  // A [[bond]] spans half a spacing. Whether there is one the scene says.
  const double spanned = std::max(body.parts[widest->parts[0]].lattice.spacing.minCoeff(),
                                  body.parts[widest->parts[1]].lattice.spacing.minCoeff()) /
                         2;
  const std::string cure = 1.05 * widest->gap <= spanned
                               ? fmt::format(": only [[bond]] with gap = \"{}\" in the scene joins them",
                                             human_length(1.05 * widest->gap))
                               : ", and are not joined: close the gap in CAD, or hold both";
  if (count == 1)
    progress.warn(fmt::format("parts {} miss each other by {}, less than a cell{}", names_of(*widest, body),
                              human_length(widest->gap), cure));
  else
    progress.warn(fmt::format("{} pairs of parts miss each other by less than a cell, {} by {}{}",
                              human_count(count), names_of(*widest, body), human_length(widest->gap), cure));
}

}  // namespace

void report_together(const VoxelizeResult& result, Progress& progress) {
  say_sums(result, progress);
  say_healing(result, progress);
  say_doubts(result, progress);
  say_losses(result, progress);
}

void report_pairs(const VoxelizeResult& result, Progress& progress) {
  say_overlaps(result, progress);
  say_gaps(result, progress);
}

}  // namespace flexel::voxelize
