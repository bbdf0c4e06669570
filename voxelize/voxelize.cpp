// The run: meshes of the parts, a spacing that fits the request and the memory, then part by part lattice,
// classification and assembly.
#include "voxelize/voxelize.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/human.h"
#include "base/nearest_word.h"
#include "base/program/share_scope.h"
#include "base/resources.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/exchange/resolution.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/column_names.h"
#include "formats/pieces/pieces.h"
#include "voxelize/classify/assign_polygons.h"
#include "voxelize/classify/axis_parity.h"
#include "voxelize/classify/classify.h"
#include "voxelize/classify/inside_consensus.h"
#include "voxelize/classify/overlap.h"
#include "voxelize/heal/heal.h"
#include "voxelize/heal/outward.h"
#include "voxelize/lattice/align.h"
#include "voxelize/lattice/assemble.h"
#include "voxelize/lattice/assemble_moments.h"
#include "voxelize/memory.h"
#include "voxelize/mesh/part_mesh.h"
#include "voxelize/neighbours.h"
#include "voxelize/slabs/slab_body.h"
#include "voxelize/walls.h"

namespace flexel::voxelize {
namespace {

constexpr std::size_t kDefaultCount = 20000;

std::vector<PartExtent> extents_of(const std::vector<HealedPart>& parts) {
  std::vector<PartExtent> extents;
  extents.reserve(parts.size());
  for (const HealedPart& part : parts)
    extents.push_back({std::abs(enclosed_volume(part.mesh)), surface_area(part.mesh)});
  return extents;
}

// Of the box around the part, which has no more than these, whatever shells overlap in it.
double cells_of_box(const HealedPart& part, double spacing) {
  return (bounding_box(part.mesh.world).size().array() / spacing + 2).prod();
}

// Spacing asked for, or that for the count asked for.
double choose_spacing(const VoxelizeOptions& options, const std::vector<PartExtent>& extents) {
  if (options.size) return *options.size;
  const double any = spacing_for_cells(extents, static_cast<double>(options.count.value_or(kDefaultCount)),
                                       options.placement);
  return options.rounded ? options.rounded(any) : any;
}

void check_spacing(double spacing, const std::vector<HealedPart>& meshes, const Surface& surface) {
  if (!(spacing > 0) || !std::isfinite(spacing)) throw InputError("the size must be a length above zero");
  std::size_t smaller = 0, smallest = 0;
  double least = std::numeric_limits<double>::infinity();  // m, the smallest part's longest side
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    const double longest = bounding_box(meshes[p].mesh.world).size().maxCoeff();
    smaller += spacing > longest;
    if (longest < least) {
      least = longest;
      smallest = p;
    }
  }
  if (smaller > 0)
    throw InputError(fmt::format(
        "a size of {} is larger than {}\"{}\" ({} long): --size \"{}\" gives it two cells",
        human_length(spacing),
        smaller == 1 ? "part " : fmt::format("{} of {} parts, the smallest ", smaller, meshes.size()),
        surface.parts[smallest].name, human_length(least), human_length(least / 2)));
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    const double longest = bounding_box(meshes[p].mesh.world).size().maxCoeff();
    if (longest / spacing > 1e6)
      throw InputError(fmt::format(
          "size {} would cut part \"{}\" into more than a million cells along one side; choose a larger size",
          human_length(spacing), surface.parts[p].name));
    constexpr double kResolution = .01;  // of the spacing
    const double resolution = coordinate_resolution(surface, p);
    if (resolution > kResolution * spacing)
      throw InputError(fmt::format(
          "part \"{}\" lies so far from the origin that its file's single-precision coordinates have a "
          "resolution of {}, more than a hundredth of the spacing of {}; move it to the origin, or export it "
          "with double precision (ASCII STL, OBJ)",
          surface.parts[p].name, human_length(resolution), human_length(spacing)));
  }
}

void check_memory(double cells, const VoxelizeOptions& options, double limit,
                  const std::vector<PartExtent>& extents) {
  const double needed = simulation_memory(cells, options.placement, options.moments);
  if (needed <= limit) return;
  const double fitting =
      spacing_for_cells(extents, cells_within(limit, options.placement, options.moments), options.placement);
  throw InputError(
      fmt::format("about {} cells need {} to simulate, more than the limit of {}; --size {} would fit, or "
                  "raise --max-memory",
                  human_count(static_cast<std::size_t>(std::min(cells, 1e18))), human_bytes(needed),
                  human_bytes(limit), human_length(1.05 * fitting)));
}

void check_meshes(const std::vector<HealedPart>& meshes, const Surface& surface) {
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    if (meshes[p].mesh.corners.empty())
      throw InputError(fmt::format("part \"{}\" has no triangle with an area", surface.parts[p].name));
  }
}

VoxelizedPart describe(const HealedPart& healed, const AssembledPart& assembled, const Part& part) {
  VoxelizedPart found;
  const PartMesh& mesh = healed.mesh;
  const double voxel = part.lattice.spacing.prod();
  found.closed = mesh.balanced();
  found.shells = mesh.shell_count;
  found.lattice_volume = assembled.volume * voxel;
  found.dropped_volume = assembled.dropped_volume * voxel;
  found.cells = assembled.cells;
  found.elements = assembled.elements;
  found.dropped_cells = assembled.dropped_cells;
  found.spacing = part.lattice.spacing;
  found.healing = healed.done;
  return found;
}

void add_counts(const Voxels& voxels, VoxelizedPart& found) {
  for (const Slab& slab : voxels.slabs) {
    found.split_voxels += slab.split_voxels;
    found.overlapping_voxels += slab.overlapping_voxels;
    found.undecided_voxels += slab.undecided_voxels;
    found.disagreements += slab.disagreements;
  }
}

// Walls of a part: the thinnest, and how many samples are thinner than two cells.
void measure_walls(const PartMesh& mesh, std::uint32_t part, int lines, VoxelizedPart& found) {
  if (!mesh.balanced()) return;
  const std::vector<WallSample> samples = wall_samples(mesh, lines);
  if (samples.empty()) return;
  const WallSample& least = samples[thinnest_sample(samples)];
  found.thinnest = ThinWall{least.thickness, least.where, part};
  const double cell = found.spacing.maxCoeff();
  const auto thinner_than = [&](double thickness) {
    return static_cast<std::size_t>(std::count_if(
        samples.begin(), samples.end(), [&](const WallSample& s) { return s.thickness < thickness; }));
  };
  constexpr double kWhole = 1 - 1e-6;  // a wall of whole cells, but for rounding
  found.thin_walls = thinner_than(2 * kWhole * cell);
  found.lost_walls = thinner_than(kWhole * cell);
  found.wall_samples = samples.size();
  found.fifth_wall = std::min(found.fifth_wall, fifth_wall(samples, found.surface_volume));
}

// A scope for part p of those that move a stage from one share to another.
struct Stretch {
  Progress& progress;
  double from, to;
  [[nodiscard]] ShareScope part(std::size_t p, std::size_t parts, const std::string& name) const {
    const double each = (to - from) / static_cast<double>(parts);
    return {progress, from + each * static_cast<double>(p), from + each * static_cast<double>(p + 1), name};
  }
};

// What does not depend on the lattice but where shells interpenetrate: volumes and walls.
void measure(const std::vector<HealedPart>& meshes, VoxelizeResult& result, const Stretch& stretch) {
  const int lines = wall_lines(128, meshes.size());
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    const ShareScope scope = stretch.part(p, meshes.size(), "walls");
    VoxelizedPart& found = result.parts[p];
    if (found.closed)
      found.surface_volume =
          found.overlapping_voxels > 0 ? union_volume(meshes[p].mesh) : enclosed_volume(meshes[p].mesh);
    result.body.parts[p].surface_volume = found.surface_volume;
    measure_walls(meshes[p].mesh, static_cast<std::uint32_t>(p), lines, found);
  }
}

// The parts, healed; the polygons of `surface` face as they do then.
std::vector<HealedPart> heal_parts(Surface& surface, const HealChoice& how, double memory,
                                   Progress& progress) {
  std::vector<HealedPart> healed;
  std::vector<PartMesh> meshes = exact_part_meshes(surface);
  for (PartMesh& mesh : meshes) {
    const std::string& name = surface.parts[healed.size()].name;
    const ShareScope scope = Stretch{progress, 0, 1}.part(healed.size(), meshes.size(), name);
    refuse_fine_wrap(mesh, how, memory, name);
    healed.push_back(heal(std::move(mesh), how, name));
  }
  face_outward(healed, surface);
  return healed;
}

// Inside and outside of a part whose mesh lies on the lattice; nothing where they cannot be told apart.
std::optional<Voxels> classify(HealedPart& part, const Lattice& lattice, const VoxelizeOptions& options,
                               const std::string& name) {
  if (part.mesh.balanced()) {
    Voxels voxels = classify_closed(
        part.mesh, {.with_centres = options.placement == Placement::centre, .with_moments = options.moments});
    if (options.moments) voxels.dropped_fill = kDroppedFillWithMoments;
    if (!part.original.corners.empty()) {
      place_on_lattice(part.original, lattice);
      trace_missing(part.original, voxels);
    }
    return voxels;
  }
  if (options.moments)
    throw InputError(
        fmt::format("part \"{}\": its surface is not closed, and exact moments (model quadratic) "
                    "need it to be; {}use model cells",
                    name, options.heal.mode == Heal::wrap ? "" : "use --heal wrap, or "));
  if (options.heal.mode == Heal::none) {
    Voxels voxels = classify_open(part.mesh);
    part.done.by = Healing::By::vote;
    if (voxels.piece_count() == 0) return std::nullopt;
    return voxels;
  }
  Sampled sampled = classify_sampled(part.mesh, has_large_hole(part));
  if (sampled.by == Sampled::By::nobody) return std::nullopt;
  part.done.by = sampled.by == Sampled::By::vote ? Healing::By::vote : Healing::By::flood;
  return std::move(sampled.voxels);
}

void require_elements(const AssembledPart& assembled, const PartMesh& mesh, const std::string& name,
                      double spacing) {
  if (assembled.elements == 0 && enclosed_volume(mesh) < 0)
    throw InputError(fmt::format("part \"{}\" is inside out; --heal auto turns it", name));
  if (assembled.elements == 0)
    throw InputError(fmt::format("nothing of part \"{}\" is left at size {}; choose a smaller size", name,
                                 human_length(spacing)));
}

// The part on its lattice.
Part placed_part(HealedPart& healed, double spacing, const VoxelizeOptions& options,
                 const std::string& name) {
  Part part;
  part.name = name;
  part.material = options.material;
  part.placement = options.placement;
  part.lattice = align_lattice(healed.mesh, spacing, options.align,
                               options.cubic || options.placement == Placement::centre);
  place_on_lattice(healed.mesh, part.lattice);
  return part;
}

// What was made of all parts.
struct Made {
  VoxelizeResult result;
  std::vector<PartLayers>
      layers;  // (parts) where the lattice is cut into pieces: the body has no elements then
  PolygonCells polygon_cells;
};

// One part onto the body; nothing where its inside cannot be told from outside.
std::optional<VoxelizedPart> voxelize_part(HealedPart& healed, double spacing, const VoxelizeOptions& options,
                                           const std::string& name, Made& made) {
  const Part part = placed_part(healed, spacing, options, name);
  const std::optional<Voxels> voxels = classify(healed, part.lattice, options, name);
  if (!voxels) return std::nullopt;
  Body& body = made.result.body;
  const AssembledPart assembled = assemble_part(*voxels, part, body, made.polygon_cells);
  const std::size_t spread = options.moments ? append_moments(*voxels, body) : 0;
  require_elements(assembled, healed.mesh, name, spacing);
  VoxelizedPart described = describe(healed, assembled, part);
  add_counts(*voxels, described);
  described.spread_cells = spread;
  return described;
}

// Counts what the part will have, for its lattice is made in pieces.
VoxelizedPart survey_part(HealedPart& healed, double spacing, const VoxelizeOptions& options,
                          const std::string& name, Made& made) {
  if (!healed.mesh.balanced())
    throw InputError(
        fmt::format("part \"{}\": its surface is not closed, and --pieces needs it to be; {}leave "
                    "out --pieces",
                    name, options.heal.mode == Heal::wrap ? "" : "use --heal wrap, or "));
  const Part part = placed_part(healed, spacing, options, name);
  if (!healed.original.corners.empty()) place_on_lattice(healed.original, part.lattice);
  Survey survey = survey_layers(healed, options.moments ? kDroppedFillWithMoments : kDroppedFill);
  require_elements(survey.found, healed.mesh, name, spacing);
  VoxelizedPart described = describe(healed, survey.found, part);
  described.split_voxels = survey.split_voxels;
  described.undecided_voxels = survey.undecided_voxels;
  described.overlapping_voxels = survey.overlapping_voxels;
  made.result.body.parts.push_back(part);
  made.layers.push_back(std::move(survey.layers));
  return described;
}

// "": a surface made in memory.
std::string file_of(const Surface& surface, std::size_t part) {
  return part < surface.part_source.size() ? surface.sources[surface.part_source[part]].file : "";
}

// All parts at one spacing.
Made build(Surface& surface, std::vector<HealedPart>& meshes, double spacing, const VoxelizeOptions& options,
           const Stretch& stretch) {
  Made made;
  std::vector<UndecidedPart> open;
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    check_stop();
    const std::string& name = surface.parts[p].name;
    const ShareScope scope = stretch.part(p, meshes.size(), name);
    if (options.pieces > 0)
      made.result.parts.push_back(survey_part(meshes[p], spacing, options, name, made));
    else if (auto part = voxelize_part(meshes[p], spacing, options, name, made))
      made.result.parts.push_back(std::move(*part));
    else
      open.push_back({name, file_of(surface, p), &meshes[p]});
  }
  if (!open.empty()) throw undecided(open, meshes.size());
  Body& body = made.result.body;
  std::swap(body.surface, surface);
  if (options.placement == Placement::corner && options.pieces == 0) {
    set_surface_cells(made.polygon_cells, body.surface.polygon_count(), body);
    derive_connections(body);
  }
  made.polygon_cells.clear();
  return made;
}

double total_cells(const VoxelizeResult& result, Placement placement) {
  double total = 0;
  for (const VoxelizedPart& part : result.parts)
    total += static_cast<double>(placement == Placement::corner ? part.cells : part.elements);
  return total;
}

// Of the stage: where the lattice is made; and how much of what is left until there each trial of a count takes, as if two
// more were to come.
constexpr double kBuilt = .8, kOfRest = .4;

// The body at the spacing for the count asked for. The estimate is rough for thin parts: it is scaled by what
// came out, again while the count is off by more than a tenth (of rounded spacings, what half a step makes of
// it too), at most three times; a spacing between one that gave too many and one that gave too few stays
// between them. None is tried twice. The best is kept.
class CountSearch {
 public:
  CountSearch(const std::vector<PartExtent>& extents, const VoxelizeOptions& options)
      : extents_(extents),
        placement_(options.placement),
        rounded_(options.rounded),
        wanted_(static_cast<double>(options.count.value_or(kDefaultCount))),
        target_(wanted_) {}

  // What came out at `spacing`.
  void add(double spacing, double got) {
    tried_.push_back(spacing);
    if (got > wanted_)
      too_small_ = std::max(too_small_, spacing);
    else
      too_large_ = std::min(too_large_, spacing);
    target_ *= wanted_ / got;
    if (const double error = std::abs(std::log(got / wanted_)); error < least_error_) {
      least_error_ = error;
      best_ = spacing;
    }
  }
  [[nodiscard]] bool close() const { return least_error_ <= std::log(rounded_ ? 1.3 : 1.1); }
  [[nodiscard]] double best() const { return best_; }
  // Nothing: there is no other.
  [[nodiscard]] std::optional<double> next() const {
    double spacing = spacing_for_cells(extents_, target_, placement_);
    const bool between = spacing > too_small_ && spacing < too_large_;
    if (!between && too_small_ > 0 && !std::isinf(too_large_)) spacing = std::sqrt(too_small_ * too_large_);
    if (rounded_) spacing = rounded_(spacing);
    if (std::find(tried_.begin(), tried_.end(), spacing) != tried_.end()) return std::nullopt;
    return spacing;
  }

 private:
  const std::vector<PartExtent>& extents_;
  Placement placement_;
  std::function<double(double)> rounded_;
  std::vector<double> tried_;  // m
  double wanted_, target_;
  double too_small_ = 0, too_large_ = std::numeric_limits<double>::infinity();
  double least_error_ = std::numeric_limits<double>::infinity(), best_ = 0;
};

// For the search of a spacing: moments take longer than all else.
VoxelizeOptions without_moments(VoxelizeOptions options) {
  options.moments = false;
  return options;
}

Made correct_count(Made made, double spacing, std::vector<HealedPart>& meshes,
                   const std::vector<PartExtent>& extents, const VoxelizeOptions& options, Stretch stretch) {
  constexpr int kCorrections = 3;
  CountSearch search(extents, options);
  search.add(spacing, total_cells(made.result, options.placement));
  Surface surface;
  const auto build_at = [&](double next, const VoxelizeOptions& how) {
    stretch.from = stretch.to;
    stretch.to += kOfRest * (kBuilt - stretch.to);
    spacing = next;
    check_spacing(spacing, meshes, surface);
    made = build(surface, meshes, spacing, how, stretch);
  };
  const VoxelizeOptions quick = without_moments(options);
  for (int n = 0; n < kCorrections && !search.close(); ++n) {
    const std::optional<double> next = search.next();
    if (!next) break;
    std::swap(surface, made.result.body.surface);
    try {
      build_at(*next, quick);
    } catch (const InputError&) {  // as small a count cannot be met: the best before stays
      spacing = 0;
      break;
    }
    search.add(spacing, total_cells(made.result, options.placement));
  }
  if (spacing != search.best() || options.moments) {
    if (surface.parts.empty()) std::swap(surface, made.result.body.surface);
    build_at(search.best(), options);
  }
  made.result.size = spacing;
  return made;
}

// Writes into the body what of the parts' shape the lattice does not have.
void note_what_is_lost(const std::vector<VoxelizedPart>& parts, Body& body) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const VoxelizedPart& part = parts[p];
    const std::string& name = body.parts[p].name;
    if (part.lost_walls > 0)
      append_text(body.notes[kLostWallsNote],
                  "walls of \"{}\" thinner than a cell ({} of the places measured)\n", name,
                  human_share(static_cast<double>(part.lost_walls) / static_cast<double>(part.wall_samples)));
    if (part.undecided_voxels > 0)
      append_text(body.notes[kJoinedPiecesNote], "pieces of \"{}\" in {} taken as one\n", name,
                  counted(part.undecided_voxels, "voxel"));
  }
}

// Everything but the bodies of pieces. `meshes`: set to the parts, healed and on their lattices.
Made make(Surface surface, const VoxelizeOptions& options, std::vector<HealedPart>& meshes,
          Progress& progress) {
  if (options.moments && options.placement == Placement::centre)
    throw InputError("--moments: centre placement has no cells; use --placement corner");
  progress.stage("heal");
  const double limit = options.max_memory.value_or(memory_to_use());
  const double at_once = 1 / static_cast<double>(std::max<std::size_t>(1, options.pieces));  // of all cells
  meshes = heal_parts(surface, options.heal, limit, progress);
  check_meshes(meshes, surface);
  progress.stage("voxelize");
  const std::vector<PartExtent> extents = extents_of(meshes);
  const double spacing = choose_spacing(options, extents);
  check_spacing(spacing, meshes, surface);
  double estimate = 0;
  for (std::size_t p = 0; p < extents.size(); ++p)
    estimate +=
        std::min(estimate_cells(extents[p], spacing, options.placement), cells_of_box(meshes[p], spacing));
  // a lattice has more elements than cells, and the estimate may be high
  check_elements(at_once * estimate / 2, "");
  check_memory(at_once * estimate, options, limit, extents);
  const Stretch first{progress, 0, options.size ? kBuilt : kOfRest * kBuilt};
  Made made = build(surface, meshes, spacing, options.size ? options : without_moments(options), first);
  made.result.size = spacing;
  if (!options.size) made = correct_count(std::move(made), spacing, meshes, extents, options, first);
  VoxelizeResult& result = made.result;
  const double cells = total_cells(result, options.placement);
  check_elements(static_cast<double>(result.body.element_count()), "");
  check_memory(at_once * cells, options, limit, extents);
  measure(meshes, result, {progress, kBuilt, 1});
  std::vector<double> cell;
  for (const VoxelizedPart& part : result.parts) cell.push_back(part.spacing.maxCoeff());
  result.pairs = noteworthy_pairs(meshes, cell);
  refuse_duplicates(result.pairs, result.body.surface);
  result.with_moments = options.moments;
  note_what_is_lost(result.parts, result.body);
  result.simulation_memory = simulation_memory(cells, options.placement, options.moments);
  return made;
}

void say_pieces(const SlabBodies& slabs, std::size_t pieces, Progress& progress) {
  std::size_t largest = 0, all = 0;
  for (std::uint32_t index = 0; index < pieces; ++index) {
    largest = std::max(largest, slabs.own_cells(index));
    all += slabs.own_cells(index);
  }
  progress.say(fmt::format("{}, the largest with {}, {:.2f} times the mean", counted(pieces, "piece"),
                           counted(largest, "cell"),
                           static_cast<double>(largest * pieces) / static_cast<double>(all)));
}

// What the pieces are made from: those of two runs can be put together only where it is the same.
std::uint64_t run_of(const Body& whole, const SlabBodies& slabs, const VoxelizeOptions& options) {
  std::vector<std::uint64_t> from = {surface_hash(whole.surface), options.moments, options.pieces};
  for (std::size_t p = 0; p < whole.parts.size(); ++p) {
    const Part& part = whole.parts[p];
    from.push_back(content_hash(std::as_bytes(std::span(&part.lattice, 1))));
    from.push_back(content_hash(std::as_bytes(std::span(part.name))));
    from.push_back(content_hash(std::as_bytes(std::span(part.material))));
    from.insert(from.end(), slabs.cuts()[p].begin(), slabs.cuts()[p].end());
  }
  return run_number(from);
}

}  // namespace

Placement placement_choice(const std::string& word) {
  if (word == "corner") return Placement::corner;
  if (word == "centre") return Placement::centre;
  throw InputError("--placement: unknown word \"" + word + "\" (one of corner, centre)" +
                   did_you_mean(word, {"corner", "centre"}));
}

VoxelizeResult voxelize(Surface surface, const VoxelizeOptions& options, Progress& progress) {
  std::vector<HealedPart> meshes;
  VoxelizeResult result = make(std::move(surface), options, meshes, progress).result;
  progress.finish();
  return result;
}

VoxelizeResult voxelize_pieces(Surface surface, const VoxelizeOptions& options, const UsePiece& use,
                               Progress& progress) {
  if (options.placement == Placement::centre)
    throw InputError("--pieces: centre placement has no cells; use --placement corner");
  std::vector<HealedPart> meshes;
  Made made = make(std::move(surface), options, meshes, progress);
  VoxelizeResult& result = made.result;
  std::vector<SlabPart> parts;
  for (std::size_t p = 0; p < meshes.size(); ++p)
    parts.push_back({result.body.parts[p], &meshes[p], &made.layers[p]});
  const SlabBodies slabs(std::move(parts), options.pieces, result.body.surface.polygon_count(),
                         options.moments);
  say_pieces(slabs, options.pieces, progress);
  const std::uint64_t run = run_of(result.body, slabs, options);
  progress.stage("pieces");
  for (std::uint32_t index = 0; index < options.pieces; ++index) {
    const double each = 1 / static_cast<double>(options.pieces);
    const ShareScope scope(progress, each * index, each * (index + 1), fmt::format("piece {}", index));
    std::vector<std::size_t> spread;
    PieceBody piece = slabs.make(index, spread);
    for (std::size_t p = 0; p < spread.size(); ++p) result.parts[p].spread_cells += spread[p];
    piece.numbers.run = run;
    piece.body.notes.insert(result.body.notes.begin(), result.body.notes.end());
    use(result.body, piece);
  }
  progress.finish();
  return std::move(result);
}

}  // namespace flexel::voxelize
