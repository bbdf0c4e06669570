// Counts over the vertices, the volume that the surface encloses before and after, and the words for it.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/program.h"
#include "formats/topology.h"
#include "formats/units.h"
#include "mapping/map.h"

namespace flexel {
namespace {

double largest_norm(const std::vector<Vec3>& vectors) {
  double largest = 0;
  for (const Vec3& vector : vectors) largest = std::max(largest, vector.norm());
  return largest;
}

std::string share(std::size_t count, std::size_t of) {
  const double percent = 100.0 * static_cast<double>(count) / static_cast<double>(of);
  return fmt::format("{} of {} vertices ({:.2g} %)", human_count(count), human_count(of), percent);
}

// Why a mapping that fails must not be used.
std::string failure(const MapReport& report) {
  std::vector<std::string> causes;
  if (report.inverted > 0)
    causes.push_back(share(report.inverted, report.vertices) +
                     " sit in frames that the deformation turned inside out");
  if (report.degenerate > 0)
    causes.push_back(share(report.degenerate, report.vertices) + " sit in frames that were crushed flat");
  if (report.not_finite > 0)
    causes.push_back(share(report.not_finite, report.vertices) + " have no finite position");
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

MapReport report(const Body& body, const MapResult& result) {
  MapReport report;
  report.vertices = result.displacement.size();
  report.distinct_frames = result.frames.size();
  for (std::size_t v = 0; v < report.vertices; ++v) {
    const std::uint8_t flags = result.flags[v];
    const Frame& frame = result.frame_of(v);
    ++report.kinds[static_cast<std::size_t>(frame.kind)];
    report.unreferenced += result.referenced[v] == 0;
    report.widened += frame.rings > 0;
    report.voronoi_cell_left += (flags & kVoronoiCellLeft) != 0;
    report.inverted += (flags & kFrameInverted) != 0;
    report.degenerate += (flags & kFrameDegenerate) != 0;
    report.not_finite += (flags & kNotFinite) != 0;
  }
  report.rest_residual = result.rest_residual;
  report.distance_outside = result.distance_outside;
  report.largest_displacement = largest_norm(result.displacement);
  const Triangles triangles = triangulate(body.surface);
  report.volume_before = signed_volume(body.surface.vertices, triangles.corners);
  std::vector<Vec3> moved = body.surface.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += result.displacement[v];
  report.volume_after = signed_volume(moved, triangles.corners);
  return report;
}

std::vector<std::string> report_lines(const MapReport& report) {
  std::vector<std::string> lines;
  if (report.valid())
    lines.push_back(
        fmt::format("the mapped surface can be used: no frame of its {} vertices is inverted or degenerate",
                    human_count(report.vertices)));
  else
    lines.push_back("the mapped surface cannot be used as it is: " + failure(report));
  if (report.kinds[0] < report.vertices) lines.push_back(fewer_elements(report));
  if (report.voronoi_cell_left > 0)
    lines.push_back(share(report.voronoi_cell_left, report.vertices) +
                    " are now nearer to another element than to the one that holds them (Voronoi cell left): "
                    "expected under "
                    "strong shear, worth a look where it is not");
  if (report.distance_outside > 1)
    lines.push_back(
        fmt::format("the farthest vertex lies {:.2g} spacings outside the lattice: its place is extrapolated",
                    report.distance_outside));
  lines.push_back(fmt::format("largest displacement {}", human_length(report.largest_displacement)));
  if (report.volume_before > 0 && std::isfinite(report.volume_after))
    lines.back() += fmt::format(", volume {} -> {} ({:+.3g} %)", human_volume(report.volume_before),
                                human_volume(report.volume_after),
                                100 * (report.volume_after / report.volume_before - 1));
  for (const std::string& line : crack_lines(report.crack)) lines.push_back(line);
  return lines;
}

std::string report_json(const MapReport& report, const MapOptions& options) {
  nlohmann::ordered_json json;
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
  json["failures"] = {
      {"inverted", report.inverted}, {"degenerate", report.degenerate}, {"not_finite", report.not_finite}};
  json["advisories"] = {{"voronoi_cell_left", report.voronoi_cell_left}};
  json["rest_residual"] = report.rest_residual;
  json["distance_outside"] = report.distance_outside;
  json["largest_displacement"] = report.largest_displacement;
  json["volume_before"] = report.volume_before;
  json["volume_after"] = report.volume_after;
  json["crack"] = nlohmann::ordered_json::parse(crack_json(report.crack));
  return json.dump(2) + "\n";
}

}  // namespace flexel
