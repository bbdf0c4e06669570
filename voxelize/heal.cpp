// Each repair is kept only where it makes the surface more closed. What is still open then is left to
// judge.h.
#include "voxelize/heal.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "formats/error.h"
#include "formats/program.h"
#include "formats/units.h"
#include "voxelize/heal_cgal.h"
#include "voxelize/heal_mesh.h"

namespace flexel {
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

// Holes that can be filled are, so that the wrap does not get in by them; a wider one is refused before
// minutes are spent inside the part.
void wrap(HealedPart& part, double alpha, const std::string& name) {
  const PartMesh original = part.mesh;
  heal_automatically(part);
  const Hole* widest = nullptr;
  for (const Hole& hole : part.holes)
    if (hole.shell_share > kMajorShell && hole.width > alpha && (!widest || hole.width > widest->width))
      widest = &hole;
  const std::string opening =
      widest ? fmt::format("an opening {} wide at {}", human_length(widest->width), place(widest->centre))
             : "an opening";
  const std::string refusal = fmt::format(
      "part \"{}\": its surface is a sheet, or has {}, through which a wrap of {} gets inside; close it, or "
      "give "
      "the width to span: --heal \"wrap:{}\"",
      name, opening, human_length(alpha), human_length(widest ? 1.1 * widest->width : 2 * alpha));
  if (widest) throw InputError(refusal);
  part.original = original;
  part.mesh = alpha_wrap(part.mesh, alpha, kOffset * alpha);
  part.done.wrapped = true;
  part.done.wrap_alpha = alpha;
  part.done.left_open = 0;
  const double area = surface_area(part.mesh), volume = enclosed_volume(part.mesh);
  // Around a sheet, or through an opening and along the inside, a wrap is twice the offset thick everywhere.
  constexpr double kNoThicker = 4;  // offsets
  if (!part.mesh.balanced() || !(2 * volume > kNoThicker * kOffset * alpha * area)) throw InputError(refusal);
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

bool has_large_hole(const HealedPart& part) {
  return std::any_of(part.holes.begin(), part.holes.end(), [](const Hole& hole) {
    return (hole.share > kLargestHole || hole.uncertain) && hole.shell_share > kMajorShell;
  });
}

std::string why_undecided(const HealedPart& part, const std::string& name) {
  // A small shell that is open says nothing of the part.
  const auto weight = [](const Hole& hole) { return std::pair{hole.shell_share > kMajorShell, hole.share}; };
  const auto largest = std::max_element(part.holes.begin(), part.holes.end(),
                                        [&](const Hole& a, const Hole& b) { return weight(a) < weight(b); });
  constexpr double kSheet = .3;
  const std::string edges = fmt::format("{} open edges", human_count(part.mesh.open_edges));
  if (largest != part.holes.end() && part.holes.size() <= 4 && largest->share >= kSheet &&
      largest->shell_share > kMajorShell)
    return fmt::format(
        "part \"{}\" encloses no volume: its surface is a sheet with {}; give it a thickness or close it",
        name, edges);
  if (largest != part.holes.end() && part.holes.size() <= 64)
    return fmt::format(
        "part \"{}\": inside cannot be told from outside: {}, the largest hole {} wide at {}; close it, or "
        "try "
        "--heal wrap",
        name, edges, human_length(largest->width), place(largest->centre));
  if (part.mesh.open_edges == 0)
    return fmt::format(
        "part \"{}\": inside cannot be told from outside: no open edges, but {} edges whose triangles face "
        "ways that "
        "do not fit together; repair it in a mesh program, or try --heal wrap",
        name, human_count(part.mesh.unbalanced_edges));
  return fmt::format(
      "part \"{}\": inside cannot be told from outside: {}, and lines, flood and winding numbers disagree "
      "about what "
      "they enclose; repair it in a mesh program, or try --heal wrap",
      name, edges);
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

}  // namespace flexel
