// flexel-map: a deformed body in, its surface deformed out.
#include <optional>

#include "formats/body_file.h"
#include "formats/files.h"
#include "formats/parallel.h"
#include "formats/program.h"
#include "formats/surface_file.h"
#include "formats/units.h"
#include "mapping/crack.h"

namespace flexel {
namespace {

constexpr const char* kProgram = "flexel-map";

struct Arguments {
  std::string body = "-", output, method = "blended", report, format, unit, crack = "keep", debris = "keep",
              pieces;
  bool ascii = false, strict = false, quiet = false;
  int threads = 0;
};

void declare(CLI::App& app, Arguments& arguments) {
  app.add_option("body", arguments.body, "Body file (.vtu); without one, or with -, stdin")
      ->type_name("BODY");
  app.add_option("--method", arguments.method,
                 "How elements carry the vertices: blended, smooth, affine or gram-schmidt (the paper's)")
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option(
         "--crack", arguments.crack,
         "Where the part broke: keep the surface as it is, open it, or cap the pieces (docs/cracks.md)")
      ->type_name("HOW")
      ->capture_default_str();
  app.add_option("--debris", arguments.debris, "Pieces of a single element: keep or drop")
      ->type_name("HOW")
      ->capture_default_str();
  app.add_option("--pieces", arguments.pieces,
                 "Write each piece to a file of its own too: a folder, or \"out/{piece}.stl\"")
      ->type_name("PATH");
  app.add_option("--report", arguments.report, "Write the validity report as JSON")->type_name("FILE");
  app.add_option("--format", arguments.format,
                 "stl, obj, ply, off or glb; else told by the output's extension")
      ->type_name("NAME");
  app.add_flag("--ascii", arguments.ascii, "Write an ASCII STL or PLY");
  app.add_option("--unit", arguments.unit, "Unit of the coordinates written; else that of the input")
      ->type_name("UNIT");
  app.add_flag("--strict", arguments.strict,
               "Exit 4 and write no surface when a frame is inverted or degenerate");
  app.add_option("--threads", arguments.threads, "Threads; 0 is every core")->check(CLI::NonNegativeNumber);
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
  app.add_option("-o,--output", arguments.output,
                 "Where the surface goes; -: stdout, also without it unless --pieces is given")
      ->type_name("FILE");
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Maps the deformation of a body onto the surface that it was made from.", kProgram};
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const MapOptions options{map_method(arguments.method)};
  const CrackOptions crack =
      crack_options(arguments.crack, arguments.debris, arguments.pieces, arguments.format, arguments.ascii);
  if (arguments.output.empty() && arguments.pieces.empty()) arguments.output = "-";
  // Nothing: only the pieces are wanted.
  std::optional<SurfaceFormat> format;
  if (!arguments.output.empty()) format = surface_format(arguments.format, arguments.output, arguments.ascii);
  const double unit = arguments.unit.empty() ? 0 : length_unit(arguments.unit);
  if (unit > 0 && (format == SurfaceFormat::glb || crack.pieces_format == SurfaceFormat::glb))
    throw InputError("GLB has a unit of its own: leave out --unit");
  if (arguments.report == "-" && arguments.output == "-")
    throw InputError("the report and the surface cannot both go to stdout: give one of them a file");
  const ThreadLimit limit(arguments.threads);
  Progress progress(kProgram, arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);

  progress.stage("read");
  Body body = read_body(arguments.body);
  progress.stage("map");
  const MappedPart mapped = map_part(body, options, crack, progress);
  const MapReport& found = mapped.report;
  const std::vector<std::string> lines = report_lines(found);
  progress.finish();
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (i == 0 && !found.valid())
      progress.warn(lines[i]);
    else
      progress.say(lines[i]);
  // The report is written first: it says why --strict refuses.
  if (!arguments.report.empty()) write_text(report_json(found, options), arguments.report);
  if (!found.valid() && (arguments.strict || found.not_finite > 0)) throw InvalidMappingError(lines.front());
  progress.stage("write");
  const double written = unit > 0 ? unit : default_unit(body.surface);
  if (!crack.pieces.empty())
    write_parts(mapped.surface(body), mapped.result.displacement, crack.pieces_format, written, crack.pieces);
  if (format)
    write_surface(mapped.surface(body), mapped.result.displacement, *format, written, arguments.output);
  progress.finish();
  return kExitDone;
}

}  // namespace
}  // namespace flexel

int main(int argc, char** argv) {
  return flexel::run_program(flexel::kProgram, [&] { return flexel::run(argc, argv); });
}
