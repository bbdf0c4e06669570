// flexel-voxelize: parts in, body out.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <cmath>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/nearest_word.h"
#include "base/parallel.h"
#include "base/program/arguments.h"
#include "base/program/program.h"
#include "base/program/progress.h"
#include "base/program/termination.h"
#include "base/resources.h"
#include "base/units.h"
#include "formats/common/file_formats.h"
#include "formats/exchange/body_name.h"
#include "formats/exchange/import_parts.h"
#include "formats/exchange/size_warning.h"
#include "formats/exchange/vdb_file.h"
#include "formats/lattice/body_file.h"
#include "formats/pieces/pieces.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"

namespace flexel::voxelize {
namespace {

constexpr const char* kName = "flexel-voxelize";

struct Arguments {
  std::vector<std::string> parts;
  std::string size, placement = "corner", unit, align = "snap", heal = "auto", material, deflection, edge,
                    format, vdb, summary, output = "-";
  std::optional<long long> count, pieces;
  int threads = 0;
  bool moments = false, compress = false, quiet = false, force = false, json = false;
};

void declare(CommandLine& app, Arguments& arguments) {
  app.add_option("PART", arguments.parts, read_titles() + " files; - or none: stdin");
  app.add_option("--size", arguments.size, "spacing of the lattice, for example \"2 mm\"");
  app.add_option("--count", arguments.count, "or: about this many cells over all parts (default 20000)");
  app.add_option("--placement", arguments.placement, "elements at the voxels' corner (default) or centre");
  app.add_option("--unit", arguments.unit, "length unit of files that carry none (default mm)");
  app.add_option("--align", arguments.align,
                 "lattice to the part's flat faces, its box or neither: snap (default), box or none");
  app.add_option("--heal", arguments.heal,
                 "broken surfaces: auto (default) repairs small damage and refuses what cannot be told, wrap "
                 "(wrap:LENGTH) wraps them, none takes them as they are");
  app.add_option("--material", arguments.material, "name of the parts' material; else the scene gives it");
  app.add_flag("--moments", arguments.moments,
               "write the exact moments of cut cells too, for model quadratic");
  app.add_option("--deflection", arguments.deflection,
                 "STEP: largest distance of the triangles from the CAD surface");
  app.add_option(
      "--edge", arguments.edge,
      "split the mesh to this longest edge (default: STEP a 64th of the file's diagonal, meshes not)");
  app.add_option("--input-format,--format", arguments.format,
                 fmt::format("format of the input ({}) instead of what its bytes tell",
                             fmt::join(read_formats(), ", ")));
  app.add_option(
      "--pieces", arguments.pieces,
      "cut the lattice into this many pieces, for flexel-simulate-mpi: a list of them (-o body.pvtu), "
      "body_0.vtu ... and body_surface.vtu beside it");
  add_threads_option(app, arguments.threads);
  app.add_flag("--compress", arguments.compress, "compress the arrays of the body file");
  app.add_flag("--quiet", arguments.quiet, "say warnings only");
  app.add_flag("--force", arguments.force, "let results replace files that are read");
  app.add_option("--vdb", arguments.vdb, "also write fill and distance as OpenVDB grids to this file");
  app.add_option("--summary", arguments.summary,
                 "also write what was found as JSON (docs/reference/voxelize.md)");
  app.add_flag("--json", arguments.json, "print that to stdout; the body needs a file (-o)");
  app.add_option("-o,--output", arguments.output,
                 "body file (.vtu), or with --pieces their list (.pvtu); - or none: standard output");
}

// One of `words`; throws InputError with the nearest.
std::size_t choose(const std::string& option, const std::string& word,
                   const std::vector<std::string>& words) {
  for (std::size_t n = 0; n < words.size(); ++n)
    if (words[n] == word) return n;
  std::string list;
  for (const std::string& each : words) list += (list.empty() ? "" : ", ") + each;
  throw InputError(option + ": unknown word \"" + word + "\" (one of " + list + ")" +
                   did_you_mean(word, words));
}

VoxelizeOptions voxelize_options(const Arguments& arguments) {
  VoxelizeOptions options;
  if (!arguments.size.empty() && arguments.count) throw InputError("give --size or --count, not both");
  if (!arguments.size.empty()) {
    options.size = parse_quantity(arguments.size, Dimension::length);
    if (!(*options.size > 0)) throw InputError("--size: must be above zero");
  }
  if (arguments.count && *arguments.count <= 0) throw InputError("--count: must be above zero");
  if (arguments.count) options.count = static_cast<std::size_t>(*arguments.count);
  options.placement = placement_choice(arguments.placement);
  constexpr Align aligns[] = {Align::snap, Align::box, Align::none};
  options.align = aligns[choose("--align", arguments.align, {"snap", "box", "none"})];
  options.heal = heal_choice(arguments.heal);
  options.material = arguments.material;
  options.moments = arguments.moments;
  options.pieces = static_cast<std::size_t>(arguments.pieces.value_or(0));
  return options;
}

void check_pieces(const Arguments& arguments) {
  const bool list = extension(arguments.output) == "pvtu";
  if (!arguments.pieces) {
    if (list)
      throw InputError("-o: a .pvtu is a list of pieces; say how many with --pieces, or write a .vtu");
    return;
  }
  constexpr long long kMost = 1000000;
  if (*arguments.pieces <= 0 || *arguments.pieces > kMost)
    throw InputError(fmt::format("--pieces: must be from 1 to {}", kMost));
  if (!list) throw InputError("--pieces: their list needs a file: -o body.pvtu");
  if (!arguments.vdb.empty()) throw InputError("--vdb: needs the whole lattice; leave out --pieces");
}

ImportOptions import_options(const Arguments& arguments) {
  ImportOptions options;
  if (!arguments.unit.empty()) options.unit = length_unit(arguments.unit);
  if (!arguments.format.empty()) options.format = arguments.format;
  if (!arguments.deflection.empty()) {
    options.deflection = parse_quantity(arguments.deflection, Dimension::length);
    if (!(*options.deflection > 0)) throw InputError("--deflection: must be above zero");
  }
  if (!arguments.edge.empty()) {
    options.largest_edge = parse_quantity(arguments.edge, Dimension::length);
    if (!(*options.largest_edge > 0)) throw InputError("--edge: must be above zero");
  }
  return options;
}

Surface import_all(const Arguments& arguments, const ImportOptions& options, Progress& progress) {
  std::vector<std::string> files = arguments.parts;
  if (files.empty()) files.emplace_back("-");
  return import_parts(files, options, progress);
}

// Every file of the body.
std::vector<std::string> body_files(const Arguments& arguments) {
  std::vector<std::string> files = {arguments.output};
  if (!arguments.pieces) return files;
  files.push_back(shared_surface_path(arguments.output));
  for (long long index = 0; index < *arguments.pieces; ++index)
    files.push_back(piece_path(arguments.output, static_cast<std::uint32_t>(index)));
  return files;
}

void check_files(const Arguments& arguments) {
  std::vector<OutputName> outputs = {{arguments.vdb, true}, {arguments.summary}, {arguments.json ? "-" : ""}};
  for (const std::string& file : body_files(arguments)) outputs.push_back({file, true});
  for (OutputName& each : outputs) each.literal = true;
  check_outputs(outputs, arguments.parts, arguments.force);
}

// Makes and writes the pieces, one after another, and their list.
VoxelizeResult write_pieces(Surface surface, const VoxelizeOptions& options, const Arguments& arguments,
                            Progress& progress) {
#ifdef __GLIBC__
  // The library would raise its bound with what is freed, and keep the memory of one piece, in holes, beside the next.
  mallopt(M_MMAP_THRESHOLD, 1024 * 1024);
#endif
  std::optional<SurfaceBeside> beside;
  std::vector<vtu::HeadArray> arrays;
  std::uint64_t run = 0;
  const auto use = [&](Body& whole, PieceBody& piece) {
    if (!beside) beside = write_shared_surface(whole, arguments.output, arguments.compress);
    arrays = write_piece(piece, arguments.output, *beside, arguments.compress);
    run = piece.numbers.run;
  };
  VoxelizeResult result = voxelize_pieces(std::move(surface), options, use, progress);
  write_piece_list(arguments.output, run, static_cast<std::uint32_t>(options.pieces), arrays);
  return result;
}

int run(int argc, char** argv) {
  CommandLine app("Turns parts into lattices of elements.", kName);
  Arguments arguments;
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  check_pieces(arguments);
  const VoxelizeOptions options = voxelize_options(arguments);
  ImportOptions how = import_options(arguments);
  if (!arguments.vdb.empty() && options.placement != Placement::corner)
    throw InputError("--vdb: centre placement has no cells; use --placement corner");
  check_files(arguments);
  const ThreadLimit threads(arguments.threads);
  Progress progress(kName, arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  how.warn = [&](const std::string& line) { progress.warn(line); };
  if (const std::string line = body_name_warning(arguments.output); !line.empty()) progress.warn(line);
  progress.stage("import");
  Surface surface = import_all(arguments, how, progress);
  for (const std::string& line : size_warnings(surface)) progress.warn(line);
  for (const std::string& line : refinement_notes(surface)) progress.say(line);
  std::vector<std::string> files = body_files(arguments);
  files.insert(files.end(), {arguments.vdb, arguments.summary});
  OutputsTogether outputs(files);
  const VoxelizeResult result = options.pieces > 0
                                    ? write_pieces(std::move(surface), options, arguments, progress)
                                    : voxelize(std::move(surface), options, progress);
  report(result, progress);
  progress.stage("write");
  if (!arguments.vdb.empty()) write_vdb(result.body, arguments.vdb);
  if (!arguments.summary.empty()) write_text(summary_json(result), arguments.summary);
  if (options.pieces == 0) write_body(result.body, arguments.output, {.compress = arguments.compress});
  outputs.appear();
  progress.finish();
  if (arguments.json) write_text(summary_json(result), "-");
  return kExitDone;
}

}  // namespace
}  // namespace flexel::voxelize

int main(int argc, char** argv) {
  return flexel::run_program(flexel::voxelize::kName, [&] { return flexel::voxelize::run(argc, argv); });
}
