// A repair is kept only if it reduces the open edges. What stays open is classified by samples
// (voxelize/classify/inside_consensus.h).
#include "voxelize/heal/heal.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/units.h"
#include "voxelize/heal/heal_cgal.h"
#include "voxelize/heal/heal_mesh.h"
#include "voxelize/heal/orientation.h"

namespace flexel::voxelize {
namespace {

constexpr double kWeld = 1e-7;       // of the diagonal: noise of single-precision coordinates
constexpr double kMajorShell = .1;   // of the area
constexpr double kAlpha = .01;       // of the diagonal: the widest opening that a wrap spans
constexpr double kOffset = 1. / 30;  // of alpha

std::string place(const Vec3& at) {
  return fmt::format("({}, {}, {})", human_length(at.x()), human_length(at.y()), human_length(at.z()));
}

void heal_automatically(HealedPart& part) {
  PartMesh& mesh = part.mesh;
  Healing& done = part.done;
  done.degenerate_facets = mesh.degenerate_triangles;
  done.open_edges = mesh.open_edges;
  const std::size_t triangles = mesh.corners.size();
  if (!mesh.balanced()) {
    part.original = mesh;
    if (mesh.crowded_edges > 0) done.duplicate_facets = drop_duplicates(mesh);
    const std::size_t degenerate = mesh.degenerate_triangles;
    done.welded_edges = weld_open_edges(mesh, kWeld * bounding_box(mesh.world).diagonal());
    done.degenerate_facets += mesh.degenerate_triangles - degenerate;
    if (done.welded_edges > 0 && mesh.crowded_edges > 0) done.duplicate_facets += drop_duplicates(mesh);
    if (mesh.open_edges > 0) done.fins = drop_fins(mesh);
    if (mesh.open_edges > 0) {
      FilledHoles filled = fill_holes(mesh);
      done.hole_triangles = filled.triangles;
      for (Hole& hole : filled.holes)
        if (hole.filled) {
          ++done.holes;
          done.widest_hole = std::max(done.widest_hole, hole.width);
        } else {
          part.holes.push_back(std::move(hole));
        }
    }
    if (mesh.open_edges > 0) done.loose_facets = drop_loose_sheets(mesh);
    if (done.loose_facets > 0) part.holes.clear();
    if (mesh.corners.size() - done.hole_triangles == triangles) part.original = {};
  }
  repair_orientation(mesh);
  done.flipped_facets = mesh.flipped_triangles;
  done.inverted_shells = mesh.inverted_shells;
  done.left_open = mesh.open_edges;
}

// The mesh wrapped; nothing where the wrap is a skin: around a sheet, or through an opening and along the
// inside, it is twice the offset thick everywhere.
std::optional<PartMesh> wrapped(const PartMesh& mesh, double alpha) {
  constexpr double kNoThicker = 4;  // offsets
  PartMesh wrap = alpha_wrap(mesh, alpha, kOffset * alpha);
  const double area = surface_area(wrap), volume = enclosed_volume(wrap);
  if (!wrap.balanced() || !(2 * volume > kNoThicker * kOffset * alpha * area)) return std::nullopt;
  return wrap;
}

// The widest hole of a shell that matters, or null.
const Hole* widest_hole(const HealedPart& part) {
  const Hole* widest = nullptr;
  for (const Hole& hole : part.holes)
    if (hole.shell_share > kMajorShell && (!widest || hole.width > widest->width)) widest = &hole;
  return widest;
}

double diagonal_of(const PartMesh& mesh) {
  return bounding_box(mesh.world).diagonal();
}

// The least width above `least` that a wrap has to span to keep a volume, tried; nothing where none of those
// up to the part's own size does.
std::optional<double> width_to_span(const HealedPart& part, double least) {
  std::vector<double> widths;
  if (const Hole* widest = widest_hole(part); widest && 1.1 * widest->width > least)
    widths = {1.1 * widest->width};
  else
    widths = {2 * least, 8 * least};
  for (const double width : widths)
    if (width <= diagonal_of(part.mesh) && wrapped(part.mesh, width)) return width;
  return std::nullopt;
}

// Holes that can be filled are, so that the wrap does not get in by them; a wider one is refused before
// minutes are spent inside the part.
void wrap(HealedPart& part, double alpha, const std::string& name) {
  const PartMesh original = part.mesh;
  heal_automatically(part);
  const auto refuse = [&] {
    const Hole* widest = widest_hole(part);
    const std::optional<double> width = width_to_span(part, alpha);
    throw InputError(fmt::format(
        "part \"{}\": its surface is a sheet, or has {}, through which a wrap of {} gets inside: close it in "
        "a "
        "mesh program{}",
        name,
        widest ? fmt::format("an opening {} wide at {}", human_length(widest->width), place(widest->centre))
               : "an opening",
        human_length(alpha),
        width ? fmt::format(", or give the width to span: --heal \"wrap:{}\"", human_length(*width))
              : "; no wrap closes it"));
  };
  if (const Hole* widest = widest_hole(part); widest && widest->width > alpha) refuse();
  std::optional<PartMesh> found = wrapped(part.mesh, alpha);
  if (!found) refuse();
  part.original = original;
  part.mesh = std::move(*found);
  part.done.wrapped = true;
  part.done.wrap_alpha = alpha;
  part.done.left_open = 0;
}

// What is wrong at the edges, by how many triangles they have and which way those face.
std::string faults_of(const PartMesh& mesh) {
  std::size_t open = 0, crowded = 0;
  for (const std::uint32_t degree : edge_degrees(mesh)) {
    open += degree == 1;
    crowded += degree > 2;
  }
  std::string text;
  const auto add = [&](std::size_t count, const char* one, const char* many) {
    if (count > 0)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", human_count(count), count == 1 ? one : many);
  };
  add(open, "open edge", "open edges");
  add(crowded, "edge where more than two triangles meet", "edges where more than two triangles meet");
  if (text.empty())
    add(mesh.unbalanced_edges, "edge whose triangles face ways that do not fit together",
        "edges whose triangles face ways that do not fit together");
  return text;
}

// A small shell that is open says nothing of the part.
const Hole* largest_hole(const HealedPart& part) {
  const auto weight = [](const Hole& hole) { return std::pair{hole.shell_share > kMajorShell, hole.share}; };
  const auto largest = std::max_element(part.holes.begin(), part.holes.end(),
                                        [&](const Hole& a, const Hole& b) { return weight(a) < weight(b); });
  return largest == part.holes.end() ? nullptr : &*largest;
}

bool is_sheet(const HealedPart& part) {
  constexpr double kSheet = .3;
  const Hole* largest = largest_hole(part);
  return largest && part.holes.size() <= 4 && largest->share >= kSheet && largest->shell_share > kMajorShell;
}

std::string why_undecided(const HealedPart& part) {
  const std::string faults = faults_of(part.mesh);
  if (is_sheet(part)) return fmt::format("its surface is a sheet with {}", faults);
  const Hole* largest = largest_hole(part);
  if (largest && part.holes.size() <= 64)
    return fmt::format("{}, the largest hole {} wide at {}", faults, human_length(largest->width),
                       place(largest->centre));
  return faults;
}

// Advice for open parts; a wrap is tried for 10 s in all.
std::string cure(const std::vector<UndecidedPart>& parts) {
  constexpr std::chrono::seconds kPatience(10);
  const auto begin = std::chrono::steady_clock::now();
  std::size_t closed = 0, tried = 0;
  for (const UndecidedPart& each : parts) {
    if (std::chrono::steady_clock::now() - begin > kPatience) break;
    ++tried;
    const double alpha = kAlpha * diagonal_of(each.part->mesh);
    const Hole* widest = widest_hole(*each.part);
    const bool gets_inside = widest && widest->width > alpha;
    closed += !gets_inside && wrapped(each.part->mesh, alpha);
  }
  if (tried == closed)
    return fmt::format("repair {} in a mesh program, or take a wrap of {}: --heal wrap",
                       parts.size() == 1 ? "it" : "them", parts.size() == 1 ? "it" : "each");
  if (parts.size() == 1)
    if (const auto width = width_to_span(*parts[0].part, kAlpha * diagonal_of(parts[0].part->mesh)))
      return fmt::format("close it in a mesh program, or span it: --heal \"wrap:{}\"", human_length(*width));
  return parts.size() == 1
             ? "close it in a mesh program; no wrap closes it"
             : fmt::format("close them in a mesh program; --heal wrap closes {} of the {} tried", closed,
                           tried);
}

}  // namespace

HealChoice heal_choice(const std::string& word) {
  if (word == "none") return {Heal::none};
  if (word == "auto") return {Heal::automatic};
  if (word == "wrap") return {Heal::wrap};
  if (word.starts_with("wrap:")) {
    const double alpha = parse_quantity(word.substr(5), Dimension::length);
    if (!(alpha > 0)) throw InputError("--heal: the width to span must be above zero");
    return {Heal::wrap, alpha};
  }
  throw InputError("--heal: unknown word \"" + word + "\" (one of none, auto, wrap, wrap:LENGTH)" +
                   did_you_mean(word, {"none", "auto", "wrap"}));
}

HealedPart heal(PartMesh mesh, const HealChoice& how, const std::string& name) {
  HealedPart part;
  part.mesh = std::move(mesh);
  if (part.mesh.corners.empty()) return part;
  if (how.mode == Heal::none) part.done.open_edges = part.done.left_open = part.mesh.open_edges;
  if (how.mode == Heal::automatic) heal_automatically(part);
  if (how.mode == Heal::wrap)
    wrap(part, how.alpha.value_or(kAlpha * bounding_box(part.mesh.world).diagonal()), name);
  return part;
}

// CGAL's peak is 2.1 kB for every square of that width on the surface, measured on a bar at 20,000 to 170,000
// squares.
void refuse_fine_wrap(const PartMesh& mesh, const HealChoice& how, double memory, const std::string& name) {
  constexpr double kBytesPerSquare = 2200;
  if (how.mode != Heal::wrap || !how.alpha) return;
  const double area = surface_area(mesh), needed = kBytesPerSquare * area / (*how.alpha * *how.alpha);
  if (!(needed > memory)) return;
  throw InputError(fmt::format(
      "part \"{}\": a wrap of {} is too fine: it needs {} of memory, more than the limit of {}; --heal "
      "\"wrap:{}\" would fit",
      name, human_length(*how.alpha), human_bytes(needed), human_bytes(memory),
      human_length(1.05 * std::sqrt(area * kBytesPerSquare / memory))));
}

bool has_large_hole(const HealedPart& part) {
  return std::any_of(part.holes.begin(), part.holes.end(), [](const Hole& hole) {
    return (hole.share > kLargestHole || hole.uncertain) && hole.shell_share > kMajorShell;
  });
}

InputError undecided(const std::vector<UndecidedPart>& parts, std::size_t all) {
  const bool one_file = std::all_of(parts.begin(), parts.end(),
                                    [&](const UndecidedPart& each) { return each.file == parts[0].file; });
  const std::string where = one_file ? parts[0].file : "";
  if (parts.size() == 1 && is_sheet(*parts[0].part))
    return InputError(where,
                      fmt::format("part \"{}\" encloses no volume: {}; give it a thickness or close it",
                                  parts[0].name, why_undecided(*parts[0].part)));
  if (parts.size() == 1)
    return InputError(where, fmt::format("part \"{}\": inside cannot be told from outside: {}; {}",
                                         parts[0].name, why_undecided(*parts[0].part), cure(parts)));
  constexpr std::size_t kNamed = 4;
  std::string names;
  for (std::size_t p = 0; p < std::min(kNamed, parts.size()); ++p)
    names += fmt::format("{}\"{}\" ({})", p == 0 ? "" : ", ", parts[p].name, why_undecided(*parts[p].part));
  if (parts.size() > kNamed) names += fmt::format(" and {} more", parts.size() - kNamed);
  return InputError(where, fmt::format("inside cannot be told from outside in {} of {} parts: {}; {}",
                                       parts.size(), all, names, cure(parts)));
}

std::vector<std::string> healing_lines(const Healing& done) {
  std::vector<std::string> lines;
  const auto add = [&](std::size_t count, const char* one, const char* many, const std::string& rest) {
    if (count > 0) lines.push_back(fmt::format("{} {}{}", human_count(count), count == 1 ? one : many, rest));
  };
  add(done.degenerate_facets, "degenerate facet", "degenerate facets", " left out");
  add(done.duplicate_facets, "repeated facet", "repeated facets", " left out");
  add(done.welded_edges, "open edge", "open edges", " closed by welding at 1e-7 of the diagonal");
  add(done.fins, "facet", "facets", " of fins, which enclose nothing, left out");
  add(done.loose_facets, "facet", "facets", " of loose sheets, which enclose nothing, left out");
  add(done.holes, "hole", "holes",
      fmt::format(" filled with {} triangles, the widest {}", human_count(done.hole_triangles),
                  human_length(done.widest_hole)));
  add(done.flipped_facets, "triangle", "triangles", " faced the other way than their neighbours and turned");
  add(done.inverted_shells, "shell", "shells", " inside out and turned");
  if (done.wrapped)
    lines.push_back(
        fmt::format("wrapped: openings up to {} are spanned, and the wrap lies {} outside the surface",
                    human_length(done.wrap_alpha), human_length(kOffset * done.wrap_alpha)));
  return lines;
}

}  // namespace flexel::voxelize
