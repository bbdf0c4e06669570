// Counts over the vertices, the volume that the surface encloses before and after, and the words for it.
#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "base/files/json.h"
#include "base/human.h"
#include "base/program/share_scope.h"
#include "base/units.h"
#include "base/version.h"
#include "mapping/anchors/frame.h"
#include "mapping/report/chord.h"
#include "mapping/report/quality.h"

namespace flexel::mapping {
namespace {

double largest_norm(const std::vector<Vec3>& vectors) {
  double largest = 0;
  for (const Vec3& vector : vectors) largest = std::max(largest, vector.norm());
  return largest;
}

// Over the frames that hold a vertex some polygon uses.
double largest_stretch(const MapResult& result, const std::vector<Mat3>& gradients) {
  std::vector<std::uint8_t> used(gradients.size(), 0);
  for (std::size_t v = 0; v < result.frame.size(); ++v)
    if (result.referenced[v]) used[result.frame[v]] = 1;
  double largest = 0;
  for (std::size_t f = 0; f < gradients.size(); ++f)
    if (used[f]) largest = std::max(largest, stretch(gradients[f]));
  return largest;
}

std::string share(std::size_t count, std::size_t of) {
  return fmt::format("{} of {} vertices ({})", human_count(count), human_count(of),
                     human_share(static_cast<double>(count) / static_cast<double>(of)));
}

// "4mm", as options take it.
std::string as_option(double metres) {
  std::string text = human_length(metres);
  std::erase(text, ' ');
  return text;
}

// What the triangles do not show, and with which edges they would.
std::string coarseness(const ChordError& chord, SplitAdvice advice) {
  std::string line = fmt::format(
      "its triangles, up to {} long, stay flat where the part bends and miss it by up to {} ({} of the "
      "largest displacement) at ({}, {}, {})",
      human_length(chord.longest_edge), human_length(chord.largest), human_share(chord.share()),
      human_length(chord.at.x()), human_length(chord.at.y()), human_length(chord.at.z()));
  if (advice == SplitAdvice::none) return line;
  line += fmt::format("; --refine {} splits them", as_option(sufficient_edge(chord)));
  if (advice == SplitAdvice::new_binding) line += " with a binding that --save-binding makes anew for it";
  return line;
}

// Why a mapping that fails must not be used.
std::string failure(const MapReport& report) {
  if (report.placed()) return coarseness(*report.chord, report.split_advice);
  std::vector<std::string> causes;
  if (report.inverted > 0)
    causes.push_back(share(report.inverted, report.vertices) +
                     " sit in frames that the deformation turned inside out");
  if (report.degenerate > 0)
    causes.push_back(share(report.degenerate, report.vertices) + " sit in frames that were crushed flat");
  if (report.not_finite > 0)
    causes.push_back(share(report.not_finite, report.vertices) + " have no finite position");
  const SurfaceMeetings meetings = report.new_meetings.value_or(SurfaceMeetings{});
  if (meetings.self > 0)
    causes.push_back(
        fmt::format("{} pairs of triangles of one part pass through each other and did not at rest",
                    human_count(meetings.self)));
  if (meetings.through > 0)
    causes.push_back(
        fmt::format("{} pairs of triangles of different parts pass through each other, by up to {}, and did "
                    "not at rest",
                    human_count(meetings.through), human_length(meetings.deepest)));
  return fmt::format("{}; take a smaller load or a finer lattice", fmt::join(causes, ", "));
}

std::string fewer_elements(const MapReport& report) {
  const auto count = [&](FrameKind kind) { return report.kinds[static_cast<std::size_t>(kind)]; };
  const std::size_t fewer = count(FrameKind::plane) + count(FrameKind::line) + count(FrameKind::rigid);
  return fmt::format(
      "{} are held by fewer than four elements (plane {}, line {}, single {}): the part is one element thick "
      "there, or broken off; a finer lattice gives them a frame of their own",
      share(fewer, report.vertices), human_count(count(FrameKind::plane)),
      human_count(count(FrameKind::line)), human_count(count(FrameKind::rigid)));
}

}  // namespace

MapReport report(const Body& body, const MapResult& result, bool cut) {
  MapReport report;
  report.vertices = result.displacement.size();
  report.distinct_frames = result.frames.size();
  report.voronoi_changed = 0;
  for (std::size_t v = 0; v < report.vertices; ++v) {
    const std::uint8_t flags = result.flags[v];
    const Frame& frame = result.frame_of(v);
    ++report.kinds[static_cast<std::size_t>(frame.kind)];
    report.unreferenced += result.referenced[v] == 0;
    report.widened += frame.rings > 0;
    report.voronoi_cell_left += (flags & kVoronoiCellLeft) != 0;
    *report.voronoi_changed += (flags & kVoronoiChanged) != 0;
    report.inverted += (flags & kFrameInverted) != 0;
    report.degenerate += (flags & kFrameDegenerate) != 0;
    report.not_finite += (flags & kNotFinite) != 0;
  }
  if (!result.voronoi_checked) report.voronoi_changed.reset();
  report.new_meetings = result.new_meetings;
  report.far = result.far;
  report.rest_residual = result.rest_residual;
  report.distance_outside = result.distance_outside;
  report.largest_displacement = largest_norm(result.displacement);
  const std::vector<Mat3> gradients = deformation_gradients(result.frames, body.rest, body.position);
  report.largest_strain = largest_stretch(result, gradients);
  const double quality = !cut && has_long_triangles(body) ? 0.35 : 0.95;  // of the time
  {
    const ShareScope judging(0, quality);
    report.quality = surface_quality(body.surface, result, gradients);
  }
  if (!cut) {
    const ShareScope looking(quality, 1);
    report.chord = chord_error(body, result);
  }
  const LatticeVolume lattice = lattice_volume(body);
  report.lattice_volume_before = lattice.before;
  report.lattice_volume_after = lattice.after;
  return report;
}

namespace {

// What the deformation did to the triangles, where it is worth a word.
void add_triangle_lines(const MapReport& report, std::vector<std::string>& lines) {
  const SurfaceQuality& quality = report.quality;
  if (quality.flipped + quality.folded > 0)
    lines.push_back(
        fmt::format("{} triangles are turned over and {} folded on a neighbour: slivers mostly, but look "
                    "before meshing it",
                    human_count(quality.flipped), human_count(quality.folded)));
  constexpr double kSharp = 20;  // degrees
  if (quality.largest_normal_jump_added > kSharp)
    lines.push_back(fmt::format(
        "an edge between two triangles is bent by {:.2g} degrees more than at rest: a mesh this coarse does "
        "not show the deformation smoothly there",
        quality.largest_normal_jump_added));
}

// Of a volume, by its share, with its sign.
std::string human_change(double share) {
  constexpr double kLeast = 1e-4;  // human_share: "under 0.01 %"
  return fmt::format("{}{}", share >= kLeast ? "+" : "", human_share(share));
}

std::string volume_line(const MapReport& report) {
  const SurfaceQuality& quality = report.quality;
  std::string line =
      fmt::format("vertices move by up to {}, stretched by up to {}",
                  human_length(report.largest_displacement), human_share(report.largest_strain));
  if (!(quality.volume_before > 0) || !std::isfinite(quality.volume_after)) return line;
  line += fmt::format(", volume {} -> {} ({}", human_volume(quality.volume_before),
                      human_volume(quality.volume_after),
                      human_change(quality.volume_after / quality.volume_before - 1));
  if (report.lattice_volume_before > 0)
    line += ", the lattice " + human_change(report.lattice_volume_after / report.lattice_volume_before - 1);
  return line + ")";
}

}  // namespace

std::vector<std::string> report_lines(const MapReport& report) {
  std::vector<std::string> lines;
  if (report.valid())
    lines.push_back(fmt::format(
        "the mapped surface can be used: no frame of its {} vertices is inverted or degenerate{}",
        human_count(report.vertices),
        report.new_meetings ? ", and no part passes through itself where it did not before" : ""));
  else
    lines.push_back("the mapped surface cannot be used as it is: " + failure(report));
  if (report.new_meetings && report.new_meetings->between > report.new_meetings->through)
    lines.push_back(
        fmt::format("parts touch: {} pairs of their triangles meet that did not at rest, by up to {}",
                    human_count(report.new_meetings->between), human_length(report.new_meetings->deepest)));
  if (report.kinds[0] < report.vertices) lines.push_back(fewer_elements(report));
  constexpr double kStrongStrain = 0.1;
  if (report.voronoi_cell_left > 0 && report.largest_strain > kStrongStrain)
    lines.push_back(
        fmt::format("{} are now nearer to another element than to the one that holds them (Voronoi cell "
                    "left), at strains "
                    "of up to {:.2g} %: a finer lattice shows whether their place depends on it",
                    share(report.voronoi_cell_left, report.vertices), 100 * report.largest_strain));
  if (report.voronoi_changed.value_or(0) > 0)
    lines.push_back(
        share(*report.voronoi_changed, report.vertices) +
        " are held by elements whose Voronoi neighbours have changed: the paper's condition for a "
        "valid mapping, which shear over 2 % breaks without harm");
  if (report.far > 0)
    lines.push_back(share(report.far, report.vertices) +
                    " lie far outside the lattice and are carried rigidly");
  else if (report.distance_outside > 1)
    lines.push_back(
        fmt::format("the farthest vertex lies {:.2g} spacings outside the lattice: its place is extrapolated",
                    report.distance_outside));
  if (!report.placed() && report.chord && report.chord->coarse_triangles > 0)
    lines.push_back(coarseness(*report.chord, report.split_advice));
  add_triangle_lines(report, lines);
  lines.push_back(volume_line(report));
  for (const std::string& line : crack_lines(report.crack)) lines.push_back(line);
  return lines;
}

namespace {

using Json = nlohmann::ordered_json;

Json optional_count(const std::optional<std::size_t>& count) {
  return count ? Json(*count) : Json(nullptr);
}

Json chord_object(const ChordError& chord) {
  return {{"largest", chord.largest},
          {"share", chord.share()},
          {"at", {chord.at.x(), chord.at.y(), chord.at.z()}},
          {"longest_edge", chord.longest_edge}};
}

Json report_object(const MapReport& report, const MapOptions& options) {
  const SurfaceQuality& quality = report.quality;
  Json json;
  json["program"] = "flexel-map";
  json["version"] = version();
  json["method"] = name_of(options.method);
  json["valid"] = report.valid();
  json["verdict"] = report_lines(report).front();
  json["vertices"] = report.vertices;
  json["unreferenced_vertices"] = report.unreferenced;
  json["frames"] = {{"distinct", report.distinct_frames}, {"full", report.kinds[0]},
                    {"plane", report.kinds[1]},           {"line", report.kinds[2]},
                    {"rigid", report.kinds[3]},           {"widened", report.widened}};
  const std::optional<SurfaceMeetings>& meetings = report.new_meetings;
  json["failures"] = {
      {"inverted", report.inverted},
      {"degenerate", report.degenerate},
      {"not_finite", report.not_finite},
      {"new_self_intersections", meetings ? Json(meetings->self) : Json(nullptr)},
      {"parts_through_each_other", meetings ? Json(meetings->through) : Json(nullptr)},
      {"coarse_triangles", report.chord ? Json(report.chord->coarse_triangles) : Json(nullptr)}};
  json["advisories"] = {{"voronoi_cell_left", report.voronoi_cell_left},
                        {"voronoi_changed", optional_count(report.voronoi_changed)},
                        {"parts_that_meet", meetings ? Json(meetings->between) : Json(nullptr)},
                        {"far_vertices", report.far},
                        {"flipped_triangles", quality.flipped},
                        {"folded_triangles", quality.folded}};
  json["deepest_meeting"] = meetings ? Json(meetings->deepest) : Json(nullptr);
  json["rest_residual"] = report.rest_residual;
  json["distance_outside"] = report.distance_outside;
  json["largest_vertex_displacement"] = report.largest_displacement;
  json["largest_stretch"] = report.largest_strain;
  json["triangles"] = quality.triangles;
  json["split_from"] = optional_count(report.split_from);
  json["smallest_angle_before"] = quality.smallest_angle_before;
  json["smallest_angle_after"] = quality.smallest_angle_after;
  json["largest_normal_jump_added"] = quality.largest_normal_jump_added;
  json["chord_error"] = report.chord ? chord_object(*report.chord) : Json(nullptr);
  json["area_before"] = quality.area_before;
  json["area_after"] = quality.area_after;
  json["volume_before"] = quality.volume_before;
  json["volume_after"] = quality.volume_after;
  json["lattice_volume_before"] = report.lattice_volume_before;
  json["lattice_volume_after"] = report.lattice_volume_after;
  json["crack"] = parse_json(crack_json(report.crack));
  return json;
}

std::string cell_text(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return fmt::format("{:.6g}", value.get<double>());
  return json_text(value);
}

}  // namespace

std::string report_json(const MapReport& report, const MapOptions& options) {
  return json_text(report_object(report, options), 2) + "\n";
}

std::string report_table(const MapReport& report, const MapOptions& options) {
  std::string table;
  const Json object = report_object(report, options);
  for (const auto& [name, value] : object.items()) {
    if (name == "program" || name == "version" || name == "verdict") continue;
    if (!value.is_object()) {
      table += fmt::format("{:<40}{}\n", name, cell_text(value));
      continue;
    }
    for (const auto& [inner, of] : value.items())
      table += fmt::format("{:<40}{}\n", fmt::format("{}.{}", name, inner), cell_text(of));
  }
  return table;
}

}  // namespace flexel::mapping
