// The surface is mapped as it is; where that is coarse it is split and mapped again. The states of a series are gone
// through in their order, each with the surface as the states before it split it.
#include "mapping/map_refined.h"

#include <fmt/format.h>

#include "base/error.h"
#include "base/human.h"
#include "base/program/share_scope.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/exchange/refined_file.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/part/subdivide.h"
#include "mapping/loan.h"
#include "mapping/methods/map_surface.h"
#include "mapping/refine/refine.h"
#include "mapping/report/chord.h"
#include "mapping/series.h"

namespace flexel::mapping {
namespace {

constexpr const char* kNotSplitCut =
    "the surface is cut along cracks and was not split: where its triangles are too large to show the "
    "deformation, "
    "--refine LENGTH splits them before the cut";

// Of the time: a surface that may be split is mapped once or twice. One of many triangles seldom is.
double share_of_first_map(const Body& body) {
  constexpr std::size_t kMany = 100000;
  if (!has_long_triangles(body)) return 1;
  return triangle_count(body.surface) > kMany ? 0.95 : 0.2;
}

// Whether triangles of a body that broke miss too much, or are so long that they reach over what moves apart.
bool is_coarse(const Body& body, const MapOptions& options, Progress& progress) {
  constexpr double kFarAcross = 10;  // spacings
  if (!has_long_triangles(body)) return false;
  if (has_long_triangles(body, kFarAcross)) return true;
  MapOptions quick;
  quick.method = options.method;
  return chord_error(body, map_surface(body, quick, progress)).coarse_triangles > 0;
}

void warn_of_budget(Progress& progress) {
  progress.warn(
      fmt::format("the surface was split into {} triangles, the most that are made, and some still stay flat "
                  "where the part bends",
                  human_count(kMostTriangles)));
}

// What the state of a whole surface asks for.
std::optional<Refinement> refinement_of_state(const Body& body, const MapResult& result,
                                              const std::optional<ChordError>& chord, Progress& progress) {
  if (!chord || chord->coarse_triangles == 0) return std::nullopt;
  const ShareScope uncounted(1, 1);  // nobody knows how many rounds come
  RefinedWhereCoarse found = refine_where_coarse(body, result, chord->largest_displacement);
  if (!found.refinement.changes()) return std::nullopt;
  if (!found.ended) warn_of_budget(progress);
  return std::move(found.refinement);
}

MappedPart map_split(Body& body, const MapOptions& options, const CrackOptions& crack,
                     const Refinement& refinement, Surface written, Progress& progress) {
  const std::size_t before = triangle_count(body.surface);
  Surface surface = body.surface;
  std::vector<std::uint32_t> offsets = body.surface_cell_offsets, cells = body.surface_cells;
  const Loan of_surface(body.surface, surface);
  const Loan of_offsets(body.surface_cell_offsets, offsets), of_cells(body.surface_cells, cells);
  take_refined(body, refined(body.surface, refinement), refinement);
  MappedPart mapped = map_part(body, options, crack, progress);
  mapped.report.split_from = before;
  mapped.refined = std::move(written);
  return mapped;
}

}  // namespace

std::size_t triangle_count(const Surface& surface) {
  return surface.polygon_vertices.size() - 2 * surface.polygon_count();
}

SplitSurface split_surface(const Surface& surface, const Refinement& refinement, const RefineOptions& options,
                           std::span<const SurfaceFormat> formats) {
  SplitSurface split;
  try {
    split.surface = refined_with_file(surface, refinement, formats);
  } catch (const InputError& error) {
    if (options.asked) throw;
    split.line = fmt::format("the triangles are too large for this deformation and were not split: {}: {}",
                             error.where(), error.what());
    if (formats.size() > 1)
      split.line += "; nor were they for the other files, which have the same triangles";
    return split;
  }
  split.line = fmt::format("{} triangles became {}", human_count(triangle_count(surface)),
                           human_count(triangle_count(*split.surface)));
  split.line +=
      options.mode == RefineOptions::Mode::to_edge
          ? fmt::format(", with edges of at most {}", human_length(options.edge))
          : ": they were split where they stay flat and the part bends (--keep-vertices leaves them whole)";
  return split;
}

MappedPart map_refined(Body& body, const MapOptions& options, const CrackOptions& crack,
                       const RefineOptions& refine, const Surface* written,
                       std::span<const SurfaceFormat> formats, Progress& progress) {
  using Mode = RefineOptions::Mode;
  std::optional<MappedPart> whole;
  std::optional<Refinement> refinement;
  double first_map = 1;
  if (refine.mode == Mode::to_edge) {
    refinement = refine_to_edge(body.surface, refine.edge);
  } else {
    if (refine.mode == Mode::automatic) first_map = share_of_first_map(body);
    const ShareScope first(progress, 0, first_map);
    whole = map_part(body, options, crack, progress);
    if (refine.mode == Mode::automatic && !whole->cracked)
      refinement = refinement_of_state(body, whole->result, whole->report.chord, progress);
    else if (refine.mode == Mode::automatic && is_coarse(body, options, progress))
      whole->split_line = kNotSplitCut;
  }
  if (!refinement || !refinement->changes())
    return whole ? *std::move(whole) : map_part(body, options, crack, progress);
  SplitSurface split =
      split_surface(written != nullptr ? *written : body.surface, *refinement, refine, formats);
  if (!split.surface) {
    if (!whole) whole = map_part(body, options, crack, progress);
    whole->split_line = std::move(split.line);
    whole->report.split_advice = SplitAdvice::none;
    return *std::move(whole);
  }
  const ShareScope second(progress, whole ? first_map : 0, 1);
  MappedPart mapped = map_split(body, options, crack, *refinement, *std::move(split.surface), progress);
  mapped.split_line = std::move(split.line);
  return mapped;
}

std::optional<Body> split_where_coarse(const Body& body, const MapResult& result, Progress& progress) {
  if (!has_long_triangles(body)) return std::nullopt;
  const auto refinement = refinement_of_state(body, result, chord_error(body, result), progress);
  if (!refinement) return std::nullopt;
  Body split = body;
  take_refined(split, refined(body.surface, *refinement), *refinement);
  return split;
}

RefinedSeries refinement_of_series(const Body& first, const std::vector<std::string>& files,
                                   const MapOptions& options, bool cut, Progress& progress) {
  if (!has_long_triangles(first)) return {};
  MapOptions quick;
  quick.method = options.method;
  RefinedSeries found;
  Body body;
  for (const std::string& file : files) {
    check_stop();
    progress.update(0, "looking for coarse triangles in " + file);
    Body next = read_frame(file);
    if (body.parts.empty()) {
      next.surface = refined(first.surface, unsplit(first.surface));
      next.surface_cell_offsets = first.surface_cell_offsets;
      next.surface_cells = first.surface_cells;
    } else {
      take_surface(next, body, file);
    }
    body = std::move(next);
    if (cut && (may_be_broken(body) || body.notes.count(kCarvedNote) > 0))
      return {std::nullopt, kNotSplitCut};
    const MapResult result = map_surface(body, quick, progress);
    const auto more = refinement_of_state(body, result, chord_error(body, result), progress);
    if (!more) continue;
    take_refined(body, refined(body.surface, *more), *more);
    found.refinement = found.refinement ? composed(*found.refinement, *more) : *more;
  }
  return found;
}

}  // namespace flexel::mapping
