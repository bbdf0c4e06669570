// flexel info: what a part is and what a scene can name in it.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "base/error.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/human.h"
#include "base/printable.h"
#include "base/program/arguments.h"
#include "base/program/brief_output.h"
#include "base/program/progress.h"
#include "base/program/share_scope.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "flexel/measure/coordinates.h"
#include "flexel/measure/face_shape.h"
#include "flexel/measure/pieces_info.h"
#include "formats/common/file_formats.h"
#include "formats/exchange/import_parts.h"
#include "formats/exchange/size_warning.h"
#include "formats/exchange/surface_file.h"
#include "formats/part/topology.h"
#include "voxelize/heal/heal.h"
#include "voxelize/measure_part.h"
#include "voxelize/thickness.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

struct PartInfo {
  std::string name;
  std::size_t vertices = 0, polygons = 0, triangles = 0;
  Box box;
  double area = 0;    // m^2
  Topology topology;  // as in the file
  voxelize::MeasuredPart healed;
  std::vector<std::uint32_t> faces;             // indices into Surface::faces
  std::unordered_map<std::string, int> called;  // how many of its faces have a name
  [[nodiscard]] bool closed() const { return topology.closed(); }
};

// A surface whose polygons face outward, and what is known of it.
struct Known {
  std::vector<FaceShape> shapes;       // (faces)
  std::vector<std::uint32_t> numbers;  // (faces) within their part
  std::vector<PartInfo> parts;
};

Known look_at(Surface& surface) {
  Known known;
  std::vector<PartInfo>& parts = known.parts;
  parts.resize(surface.parts.size());
  const Triangles triangles = triangulate(surface);
  const std::vector<std::uint32_t> welded = weld(surface.vertices);
  std::vector<std::vector<std::array<std::uint32_t, 3>>> corners(parts.size());
  for (std::size_t t = 0; t < triangles.corners.size(); ++t)
    corners[surface.polygon_part(triangles.polygon[t])].push_back(triangles.corners[t]);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) ++parts[surface.polygon_part(p)].polygons;
  std::vector<std::uint32_t> used_by(surface.vertices.size(), 0xffffffffu);
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    PartInfo& part = parts[p];
    part.name = surface.parts[p].name;
    part.triangles = corners[p].size();
    for (const auto& triangle : corners[p])
      for (const std::uint32_t v : triangle) {
        part.box.add(surface.vertices[v]);
        part.vertices += std::exchange(used_by[v], p) != p;
      }
    part.topology = topology(corners[p], welded);
  }
  constexpr double kSorted = 0.2, kMeasured = 0.8;  // of the time
  tell_share(kSorted);
  std::vector<voxelize::MeasuredPart> healed = [&] {
    const ShareScope measuring(kSorted, kMeasured);
    return voxelize::heal_and_measure(surface);
  }();
  for (std::size_t p = 0; p < parts.size(); ++p) parts[p].healed = std::move(healed[p]);
  known.shapes = face_shapes(surface);
  known.numbers = face_numbers(surface);
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    parts[surface.faces[f].part].faces.push_back(f);
    ++parts[surface.faces[f].part].called[surface.faces[f].name];
    parts[surface.faces[f].part].area += known.shapes[f].area;
  }
  return known;
}

struct Unit {
  double metres = 1e-3;
  std::string name = "mm";
};

// The unit to speak in: the file's own, by the shortest name that it has.
Unit unit_of(const SurfaceSource& source) {
  for (const char* name : {"mm", "cm", "m", "um", "in", "ft", "km"})
    if (std::abs(length_unit(name) - source.unit) <= 1e-12 * source.unit) return {source.unit, name};
  return {};
}

std::string place(const Vec3& at, const Unit& unit) {
  const auto tidy = [&](double x) { return std::abs(x) < 1e-9 * unit.metres ? 0.0 : x / unit.metres; };
  return fmt::format("({}, {}, {})", human_number(tidy(at.x()), 4), human_number(tidy(at.y()), 4),
                     human_number(tidy(at.z()), 4));
}

std::string closedness(const PartInfo& part) {
  std::string text;
  const auto add = [&](std::size_t count, const std::string& what) {
    if (count > 0) text += fmt::format(", {} {}", human_count(count), what);
  };
  text = part.closed() ? "closed" : "NOT closed";
  add(part.topology.shell_count, part.topology.shell_count == 1 ? "shell" : "shells");
  add(part.topology.open_edges, "open edges");
  add(part.topology.non_manifold_edges, "non-manifold edges");
  add(part.topology.misoriented_edges, "edges whose triangles face opposite ways");
  add(part.topology.degenerate_triangles, "degenerate triangles");
  return text;
}

std::string part_text(const PartInfo& part, const Unit& unit) {
  const Vec3 size = part.box.size() / unit.metres;
  std::string text =
      fmt::format("part \"{}\"\n  size       {} x {} x {} {}, from {} to {}\n", part.name,
                  human_number(size.x(), 6), human_number(size.y(), 6), human_number(size.z(), 6), unit.name,
                  place(part.box.min, unit), place(part.box.max, unit));
  text += fmt::format("  mesh       {} vertices, {} polygons; {}\n", human_count(part.vertices),
                      human_count(part.polygons), closedness(part));
  text += fmt::format("  area       {} {}^2\n", human_number(part.area / (unit.metres * unit.metres), 6),
                      unit.name);
  const voxelize::MeasuredPart& healed = part.healed;
  if (healed.volume)
    text += fmt::format("  volume     {} {}^3\n", human_number(*healed.volume / std::pow(unit.metres, 3), 6),
                        unit.name);
  else
    text += "  volume     none: the surface is not closed\n";
  for (const std::string& line : healing_lines(healed.healing)) text += "  healed     " + line + "\n";
  if (healed.thinnest)
    text += fmt::format("  thinnest   wall {} {} at {}\n",
                        human_number(healed.thinnest->thickness / unit.metres, 4), unit.name,
                        place(healed.thinnest->where, unit));
  return text;
}

// How a scene selects a face by its number: "part/2", or "part/#2" where the file calls another face "2".
std::string selection_of(std::uint32_t face, const std::vector<std::uint32_t>& numbers,
                         const Surface& surface, const PartInfo& part) {
  const std::string number = std::to_string(numbers[face]);
  const auto called = part.called.find(number);
  const int own = surface.faces[face].name == number ? 1 : 0;
  const bool taken = called != part.called.end() && called->second > own;
  return fmt::format("{}/{}{}", part.name, taken ? "#" : "", number);
}

std::string faces_text(const PartInfo& part, const Surface& surface, const std::vector<FaceShape>& shapes,
                       const std::vector<std::uint32_t>& numbers, const Unit& unit) {
  const auto selection = [&](std::uint32_t f) { return selection_of(f, numbers, surface, part); };
  std::size_t width = 4;
  for (const std::uint32_t f : part.faces) width = std::max(width, selection(f).size());
  std::string text = fmt::format("  {:<{}} {:>12}  {:<28} {}\n", "face", width, "area " + unit.name + "^2",
                                 "centre " + unit.name, "what");
  for (const std::uint32_t f : part.faces) {
    std::string what = describe(shapes[f], unit.metres, unit.name);
    if (!surface.faces[f].name.empty()) what += fmt::format(", called \"{}\"", surface.faces[f].name);
    text += fmt::format("  {:<{}} {:>12.5g}  {:<28} {}\n", selection(f), width,
                        shapes[f].area / (unit.metres * unit.metres), place(shapes[f].centroid, unit), what);
  }
  return text;
}

std::string source_text(const SurfaceSource& source, const Unit& unit) {
  return fmt::format("{}: {}, unit {}{}\n", source.file, source.format, unit.name,
                     source.unit_given ? "" : " (assumed: the file carries none; --unit)");
}

std::vector<std::string> components(const std::string& path) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin < path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    names.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

// The assemblies of one source with their parts, indented; "" where it has none.
std::string tree_text(const Surface& surface, std::uint32_t source) {
  std::string text;
  std::vector<std::string> open;  // the assemblies around the last part
  bool any = false;
  for (std::size_t p = 0; p < surface.parts.size(); ++p) {
    if (surface.part_source[p] != source) continue;
    any = any || !surface.parts[p].assembly.empty();
    const std::vector<std::string> around = components(surface.parts[p].assembly);
    const auto differs = std::mismatch(open.begin(), open.end(), around.begin(), around.end());
    for (auto name = differs.second; name != around.end(); ++name)
      text += fmt::format("  {:{}}{}/\n", "", 2 * (name - around.begin()), *name);
    text += fmt::format("  {:{}}{}\n", "", 2 * around.size(), surface.parts[p].name);
    open = around;
  }
  return any ? "parts in their assemblies\n" + text : "";
}

std::string info_text(const Surface& surface, const Known& known) {
  const auto& [shapes, numbers, parts] = known;
  std::string text;
  for (std::uint32_t s = 0; s < surface.sources.size(); ++s) {
    const Unit unit = unit_of(surface.sources[s]);
    text += source_text(surface.sources[s], unit) + tree_text(surface, s);
    for (std::size_t p = 0; p < parts.size(); ++p)
      if (surface.part_source[p] == s)
        text += part_text(parts[p], unit) + faces_text(parts[p], surface, shapes, numbers, unit);
  }
  const bool assemblies = std::any_of(surface.parts.begin(), surface.parts.end(),
                                      [](const SurfacePart& part) { return !part.assembly.empty(); });
  text += fmt::format(
      "A scene or an option can name a part, {}a face, a group, or a side: xmin, xmax, ymin, ymax, zmin, "
      "zmax. Where a name means two things, \"part/#2\" is face number 2 and \"part/=2\" what the file calls "
      "\"2\".\n",
      assemblies ? "an assembly (in selections: all its parts), " : "");
  return text;
}

using Json = nlohmann::ordered_json;

Json face_json(const SurfaceFace& face, std::uint32_t number, const std::string& selection,
               const FaceShape& shape) {
  Json json = {{"number", number},   {"selection", selection},
               {"name", face.name},  {"polygons", shape.polygons},
               {"area", shape.area}, {"centroid", coordinates(shape.centroid)}};
  constexpr const char* kKinds[] = {"flat", "round", "curved"};
  json["kind"] = kKinds[static_cast<int>(shape.kind)];
  if (shape.kind == FaceShape::Kind::flat) json["normal"] = coordinates(shape.normal);
  if (shape.kind == FaceShape::Kind::round) {
    json["axis"] = coordinates(shape.axis);
    json["axis_point"] = coordinates(shape.axis_point);
    json["radius"] = shape.radius;
    json["angle"] = shape.angle;
    json["hole"] = shape.is_hole();
  }
  return json;
}

Json part_json(const PartInfo& part) {
  Json json = {{"name", part.name},
               {"vertices", part.vertices},
               {"polygons", part.polygons},
               {"triangles", part.triangles},
               {"min", coordinates(part.box.min)},
               {"max", coordinates(part.box.max)},
               {"area", part.area},
               {"volume", part.healed.volume ? Json(*part.healed.volume) : Json()},
               {"closed", part.closed()},
               {"shells", part.topology.shell_count},
               {"open_edges", part.topology.open_edges},
               {"non_manifold_edges", part.topology.non_manifold_edges},
               {"misoriented_edges", part.topology.misoriented_edges},
               {"degenerate_triangles", part.topology.degenerate_triangles}};
  const std::optional<voxelize::ThinWall>& thinnest = part.healed.thinnest;
  json["thinnest_wall"] =
      thinnest ? Json{{"thickness", thinnest->thickness}, {"where", coordinates(thinnest->where)}} : Json();
  return json;
}

std::string info_json(const Surface& surface, const Known& known) {
  const auto& [shapes, numbers, parts] = known;
  Json files = Json::array();
  for (std::uint32_t s = 0; s < surface.sources.size(); ++s) {
    const SurfaceSource& source = surface.sources[s];
    Json file = {{"file", source.file},
                 {"format", source.format},
                 {"unit", source.unit},
                 {"unit_given", source.unit_given}};
    file["parts"] = Json::array();
    for (std::size_t p = 0; p < parts.size(); ++p) {
      if (surface.part_source[p] != s) continue;
      Json part = part_json(parts[p]);
      if (!surface.parts[p].assembly.empty()) part["assembly"] = surface.parts[p].assembly;
      part["faces"] = Json::array();
      for (const std::uint32_t f : parts[p].faces)
        part["faces"].push_back(
            face_json(surface.faces[f], numbers[f], selection_of(f, numbers, surface, parts[p]), shapes[f]));
      file["parts"].push_back(part);
    }
    files.push_back(file);
  }
  return json_text({{"files", files}}, 2) + "\n";
}

// What a scene can name, a line each.
std::string words_of(const Surface& surface) {
  constexpr std::array kSides = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};
  std::string text;
  for (const char* side : kSides) text += fmt::format("{}\n", side);
  for (const SurfacePart& part : surface.parts) {
    text += printable(part.name) + "\n";
    for (const char* side : kSides) text += fmt::format("{}/{}\n", printable(part.name), side);
  }
  std::vector<PartInfo> parts(surface.parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) parts[p].name = surface.parts[p].name;
  for (const SurfaceFace& face : surface.faces) ++parts[face.part].called[face.name];
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    text += printable(selection_of(f, numbers, surface, parts[surface.faces[f].part])) + "\n";
  return text;
}

void print(const std::string& text) {
  OutputFile out("-", false);
  out.write(text);
  out.commit();
}

// The surface as a new PLY with the wall thickness at every vertex, in the unit of the coordinates; 0 where
// there is none.
void write_thickness(Surface surface, const std::string& path) {
  const double unit = default_unit(surface);
  std::vector<double> thickness = voxelize::vertex_thickness(surface);
  for (double& value : thickness) value = std::isfinite(value) ? value / unit : 0;
  surface.vertex_columns["thickness"] = {1, std::move(thickness)};
  for (SurfaceSource& source : surface.sources)
    source.bytes = {};  // a new file, not the source's with other numbers
  const std::vector<Vec3> still(surface.vertices.size(), Vec3::Zero());
  write_surface(surface, still, surface_format("ply"), unit, path);
}

int info_of_pieces(const std::string& list, bool json, bool of_parts) {
  if (of_parts)
    throw InputError(list, "lists the pieces of a lattice: --words and --thickness are for parts");
  print(json ? pieces_info(list, true) : printable_lines(pieces_info(list, false)));
  return kExitDone;
}

}  // namespace

int info_command(int argc, char** argv) {
  std::vector<std::string> files;
  std::string unit, edge, thickness;
  bool json = false, words = false, force = false;
  CommandLine app{"What a part is, and what a scene can name in it.", "flexel info"};
  app.add_option("part", files, read_titles() + " files, or a list of pieces (.pvtu); -: stdin")
      .required()
      .type_name("PART");
  const Option as_json = app.add_flag("--json", json, "As JSON, in SI units (docs/guide/info.md)");
  const Option as_words =
      app.add_flag("--words", words, "The names alone that a scene can use, a line each, for completion")
          .excludes(as_json);
  app.add_option("--unit", unit, "Unit of files that carry none (default mm)").type_name("UNIT");
  app.add_option("--edge", edge, "Split the mesh to this longest edge (default: not split)")
      .type_name("LENGTH");
  app.add_option("--thickness", thickness,
                 "Also write the surface as PLY with the wall thickness at its vertices")
      .type_name("FILE.ply")
      .excludes(as_words);
  app.add_flag("--force", force, "Let results replace files that are read");
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  if (!thickness.empty() && extension(thickness) != "ply")
    throw InputError("--thickness: the file must end in .ply");
  check_outputs({{thickness, true}, {"-"}}, files, force);
  if (files.size() == 1 && extension(files[0]) == "pvtu")
    return info_of_pieces(files[0], json, words || !thickness.empty());
  ImportOptions options;
  // Corners on chords would make the circles that are fitted to round faces too small.
  options.largest_edge = std::numeric_limits<double>::infinity();
  if (!unit.empty()) options.unit = length_unit(unit);
  if (!edge.empty()) {
    options.largest_edge = parse_quantity(edge, Dimension::length);
    if (!(*options.largest_edge > 0)) throw InputError("--edge: must be above zero");
  }
  const BriefOutput bar_alone(true);
  Progress progress("flexel", words ? Progress::Mode::quiet : Progress::Mode::automatic);
  progress.stage("import");
  options.warn = [&](const std::string& line) { progress.warn(line); };
  Surface surface = import_parts(files, options, progress);
  if (words) {
    print(words_of(surface));
    return kExitDone;
  }
  for (const std::string& line : size_warnings(surface)) progress.warn(line);
  progress.stage("measure");
  const double looked_at = thickness.empty() ? 1 : 0.1;  // of the time
  const Known known = [&] {
    const ShareScope looking(progress, 0, looked_at);
    return look_at(surface);
  }();
  if (!thickness.empty()) {
    const ShareScope casting_rays(progress, looked_at, 1);
    write_thickness(surface, thickness);
  }
  progress.finish();
  print(json ? info_json(surface, known) : printable_lines(info_text(surface, known)));
  return kExitDone;
}

}  // namespace flexel::commands
