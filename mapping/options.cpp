// The options of a mapping are declared, checked and applied here, for flexel-map and `flexel deform` alike.
#include "mapping/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/nearest_word.h"
#include "base/printable.h"
#include "base/units.h"
#include "formats/common/file_formats.h"
#include "formats/exchange/surface_file.h"
#include "mapping/methods/method.h"
#include "mapping/report/report.h"

namespace flexel::mapping {
namespace {

constexpr std::string_view kPlace = "{piece}";

// The path of every piece's file, as write_parts() wants it.
std::string pattern_of(const std::string& pieces, const std::string& format) {
  std::string path = pieces;
  bool named = names_parts(path);
  for (std::size_t at = path.find(kPlace); at != std::string::npos; at = path.find(kPlace, at)) {
    path.replace(at, kPlace.size(), "{part}");
    named = true;
  }
  if (named) return path;
  if (std::error_code error; !std::filesystem::is_directory(path, error))
    throw InputError(
        fmt::format("--pieces: \"{}\" is no folder; make it, or give a path with {{piece}} in it, such as "
                    "out/{{piece}}.stl",
                    pieces));
  return (std::filesystem::path(path) / ("{part}." + (format.empty() ? "stl" : format))).string();
}

// Whether write_report() throws the first of its lines.
bool ends_run(const MapReport& found, const MapArguments& arguments) {
  return !found.valid() && (arguments.strict || found.not_finite > 0);
}

}  // namespace

void declare_map_options(CommandLine& app, MapArguments& arguments) {
  app.add_option("--method", arguments.method,
                 fmt::format("How elements carry the vertices: {}", method_help()))
      .type_name("NAME")
      .default_text(name_of(MapOptions().method));
  app.add_option("--check", arguments.checks,
                 "Also check the mapped surface: voronoi, self-intersection, or both with a comma")
      .type_name("NAMES");
  app.add_option("--crack", arguments.crack,
                 "Where the part broke: keep the surface as it is, open it, or cap the pieces "
                 "(docs/reference/cracks.md)")
      .type_name("HOW")
      .show_default();
  app.add_option("--debris", arguments.debris, "Pieces of a single element: keep or drop")
      .type_name("HOW")
      .show_default();
  app.add_option("--pieces", arguments.pieces,
                 "Write each piece to a file of its own too: a folder, or \"out/{piece}.stl\"")
      .type_name("PATH");
  app.add_option(
         "--refine", arguments.refine,
         "Split triangles that are too large to show the deformation: auto, off, or all to this longest "
         "edge (\"2 mm\")")
      .type_name("HOW")
      .show_default();
  app.add_flag("--keep-vertices", arguments.keep_vertices,
               "The file's own vertices, whatever they show: --refine off");
  app.add_option("--scale", arguments.scale, "Write displacements this many times as large")
      .type_name("FACTOR");
  app.add_option("--format", arguments.format,
                 fmt::format("{} or vtu, for stdout and pieces; else told by the extension",
                             fmt::join(written_formats(true), ", ")))
      .type_name("NAME");
  app.add_option(
         "--tolerance", arguments.tolerance,
         "STEP, IGES, BREP: how far their faces may be from the deformation: a share of the part's diagonal "
         "or a length")
      .type_name("SHARE|LENGTH")
      .default_text("1e-4");
  app.add_flag(
      "--ascii", arguments.ascii,
      fmt::format(
          "Write an ASCII {}",
          written_titles([](const FileFormat& each) { return each.encoding == FileEncoding::both; }, "or")));
  app.add_flag(
      "--attributes", arguments.attributes,
      fmt::format("{}: write what is known of each vertex too (.vtu always has it)",
                  written_titles([](const FileFormat& each) { return each.holds_attributes; }, "or")));
  app.add_option("--report", arguments.report, "Write the mapping's validity report (JSON)")
      .type_name("FILE");
  app.add_flag("--table", arguments.table, "Print the mapping's whole report as a table");
  app.add_flag("--strict", arguments.strict,
               "Exit 4 and write no surface when a frame is inverted or degenerate, or a check fails");
}

MapOptions map_options(const MapArguments& arguments) {
  MapOptions options;
  if (!arguments.method.empty()) options.method = map_method(arguments.method);
  if (!arguments.checks.empty()) add_checks(options, arguments.checks);
  return options;
}

void use_field(const Body& body, const MapArguments& arguments, MapOptions& options) {
  if (arguments.method.empty()) options.method = default_method(body);
}

CrackOptions crack_options(const MapArguments& arguments) {
  CrackOptions options;
  options.mode = crack_mode(arguments.crack);
  const std::vector<std::string> words = {"keep", "drop"};
  if (arguments.debris != words[0] && arguments.debris != words[1])
    throw InputError(fmt::format("unknown word \"{}\": --debris is keep or drop{}", arguments.debris,
                                 did_you_mean(arguments.debris, words)));
  options.drop_debris = arguments.debris == words[1];
  if (options.mode == CrackMode::keep && options.drop_debris)
    throw InputError("--debris drop needs --crack open or cap: else debris is not told from the rest");
  if (arguments.pieces.empty()) return options;
  if (options.mode == CrackMode::keep)
    throw InputError("--pieces needs --crack open or cap: else there are no pieces");
  options.pieces = pattern_of(arguments.pieces, arguments.format);
  options.pieces_format = surface_format("", options.pieces, arguments.ascii);
  return options;
}

RefineOptions refine_options(const MapArguments& arguments, const CommandLine& app,
                             const CrackOptions& crack) {
  using Mode = RefineOptions::Mode;
  RefineOptions options;
  options.asked = app.has("--refine");
  const std::string& word = arguments.refine;
  if (word == "off")
    options.mode = Mode::off;
  else if (word != "auto") {
    options.mode = Mode::to_edge;
    if (word.find_first_of("0123456789") == std::string::npos)
      throw InputError(
          fmt::format("unknown word \"{}\": --refine is auto, off or a length such as \"2 mm\"{}", word,
                      did_you_mean(word, {"auto", "off"})));
    options.edge = parse_quantity(word, Dimension::length);
    if (!(options.edge > 0)) throw InputError("--refine: the length must be above zero");
  }
  if (arguments.keep_vertices && options.asked && options.mode != Mode::off)
    throw InputError("--keep-vertices is --refine off: give one of the two");
  if (arguments.keep_vertices) options.mode = Mode::off;
  if (crack.mode == CrackMode::keep || options.mode != Mode::automatic) return options;
  if (options.asked)
    throw InputError(
        "--refine auto is for surfaces that stay whole: with --crack open or cap give it a length");
  return options;
}

void say_report(const MapReport& found, const MapArguments& arguments, const MapOptions& options,
                Progress& progress) {
  const std::vector<std::string> lines = report_lines(found);
  for (std::size_t i = ends_run(found, arguments) ? 1 : 0; i < lines.size(); ++i)
    if (i == 0 && !found.valid())
      progress.warn(lines[i]);
    else
      progress.say(lines[i]);
  if (arguments.table) fmt::print(stderr, "{}", printable_lines(report_table(found, options)));
}

void write_report(const MapReport& found, const MapArguments& arguments, const MapOptions& options,
                  const std::string& path) {
  if (!path.empty()) write_text(report_json(found, options), path);
  if (ends_run(found, arguments)) throw InvalidMappingError(report_lines(found).front());
}

}  // namespace flexel::mapping
