// flexel-map: a deformed body in, its surface deformed out; or any other surface, points, or a series of
// bodies.
#include <cmath>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/parallel.h"
#include "base/program/arguments.h"
#include "base/program/program.h"
#include "base/program/termination.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/common/file_formats.h"
#include "formats/exchange/import.h"
#include "formats/exchange/surface_file.h"
#include "formats/lattice/body_file.h"
#include "formats/pieces/pieces.h"
#include "mapping/anchors/other_surfaces.h"
#include "mapping/binding_file.h"
#include "mapping/cad_output.h"
#include "mapping/lattice_pieces.h"
#include "mapping/map_refined.h"
#include "mapping/methods/map_surface.h"
#include "mapping/options.h"
#include "mapping/output.h"
#include "mapping/refine/refine.h"
#include "mapping/report/report.h"
#include "mapping/series.h"

namespace flexel::mapping {
namespace {

constexpr const char* kProgram = "flexel-map";

struct Arguments {
  std::string body = "-", output, unit, onto, edge, points, far, binding, save_binding;
  double far_distance = 3;
  MapArguments map;
  bool quiet = false, force = false, json = false;
  int threads = 0;
};

// CLI11's checks let "nan" pass.
std::string is_distance(const std::string& text) {
  double distance = 0;
  return is_number(text, distance) && distance >= 0 && std::isfinite(distance)
             ? ""
             : fmt::format("\"{}\" is no number from 0 on", text);
}

void declare(CommandLine& app, Arguments& arguments) {
  app.add_option("body", arguments.body,
                 "Body file (.vtu), list of pieces (.pvtu) or series (.pvd); without one, or with -, a body "
                 "from stdin")
      .type_name("BODY");
  app.add_option("--onto", arguments.onto,
                 fmt::format("Deform this mesh ({}) instead of the body's own", read_titles()))
      .type_name("FILE");
  app.add_option("--edge", arguments.edge, "Of --onto: split that mesh to this longest edge")
      .type_name("LENGTH");
  app.add_option("--points", arguments.points, "Deform the points of this table (CSV) instead; CSV comes out")
      .type_name("FILE");
  app.add_option("--far", arguments.far,
                 "Vertices far outside the lattice: follow (extrapolated), rigid or refuse (default with "
                 "--onto and --points)")
      .type_name("HOW");
  app.add_option("--far-distance", arguments.far_distance, "How far that is, in spacings")
      .check(is_distance)
      .show_default();
  declare_map_options(app, arguments.map);
  app.add_option(
         "--save-binding", arguments.save_binding,
         fmt::format("{}: write what ties the vertices to the elements, for --binding", saved_method_names()))
      .type_name("FILE");
  app.add_option("--binding", arguments.binding,
                 "Take the binding of this file, made for the same lattice and surface, and its method")
      .type_name("FILE");
  app.add_option("--unit", arguments.unit, "Unit of the coordinates written; else that of the input")
      .type_name("UNIT");
  add_threads_option(app, arguments.threads);
  app.add_flag("--json", arguments.json,
               "Print the report of --report to stdout; the result needs a file (-o)");
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
  app.add_flag("--force", arguments.force, "Let results replace files that are read");
  app.add_option("-o,--output", arguments.output,
                 "Where the surface goes; -: stdout, also without it unless --pieces is given. A series: "
                 "bent.stl gives "
                 "bent_00000.stl ..., or {frame} in the name")
      .type_name("FILE");
}

// What the arguments ask for, checked.
struct Plan {
  MapOptions options;
  CrackOptions crack;
  RefineOptions refine;
  std::optional<MapOutput> output;  // nothing: points, or only the pieces are wanted
  double unit = 0;                  // of the numbers written, m; 0: that of the surface
  std::optional<double> edge;       // m, longest of the mesh of --onto
  bool series = false;
  bool in_pieces = false;  // the body is
};

void check_pieces(const Arguments& arguments, const Plan& plan, bool own_surface) {
  const bool asked =
      plan.crack.mode != CrackMode::keep || plan.crack.drop_debris || !arguments.map.pieces.empty();
  if (asked && !own_surface)
    throw InputError(
        "--crack, --debris and --pieces are for a body's own surface: leave out --onto, --points");
  if (plan.series && !arguments.map.pieces.empty())
    throw InputError("--pieces are of one state: give one frame, or leave it out for a file a frame");
  if (!arguments.map.pieces.empty() && arguments.map.scale != 1)
    throw InputError("--pieces are written as they are: leave out --scale");
  if (!arguments.map.pieces.empty()) check_unit(plan.crack.pieces_format, plan.unit);
}

void check_binding(const Arguments& arguments, const Plan& plan) {
  if (arguments.binding.empty() && arguments.save_binding.empty()) return;
  if (!arguments.binding.empty() && !arguments.save_binding.empty())
    throw InputError(
        "--binding and --save-binding exclude each other: a saved binding need not be saved again");
  if (plan.crack.mode != CrackMode::keep)
    throw InputError("--binding and --save-binding are for a surface that stays whole: leave out --crack");
  if (arguments.binding.empty() && plan.options.method->file_number < 0)
    throw InputError(fmt::format("--save-binding: {} has no binding to keep: add --method {}",
                                 name_of(plan.options.method), saved_method_names()));
}

// Of a body in pieces only what lies near its surface is read.
void check_in_pieces(const Arguments& arguments, const Plan& plan) {
  const auto refuse = [](bool asked, const std::string& what) {
    if (asked)
      throw InputError(what +
                       ": needs the whole body, and pieces (.pvtu) are read near their surface: voxelize "
                       "and simulate without --pieces");
  };
  if (!plan.in_pieces) return;
  refuse(!arguments.onto.empty(), "--onto");
  refuse(!arguments.points.empty(), "--points");
  refuse(!arguments.binding.empty(), "--binding");
  refuse(!arguments.save_binding.empty(), "--save-binding");
  refuse(plan.crack.mode != CrackMode::keep, "--crack");
  refuse(plan.crack.drop_debris, "--debris");
  refuse(!arguments.map.pieces.empty(), "--pieces");
  refuse(plan.output && is_cad(*plan.output), "an output in a CAD format");
}

// Where triangles cannot be split as the state asks for it, they stay as they are unless the user asked.
void plan_refinement(const Arguments& arguments, const CommandLine& app, Plan& plan) {
  plan.refine = refine_options(arguments.map, app, plan.crack);
  const bool splits = plan.refine.asked && plan.refine.mode != RefineOptions::Mode::off;
  if (splits && !arguments.points.empty())
    throw InputError("--refine: the points of a table have no triangles to split: leave it out");
  if (splits && plan.output && is_cad(*plan.output))
    throw InputError("--refine is for meshes: leave it out where exact surfaces are written");
  const bool bound = !arguments.binding.empty() || !arguments.save_binding.empty();
  if (bound && plan.refine.mode == RefineOptions::Mode::automatic) {
    if (splits)
      throw InputError(
          "--refine auto depends on the state, and a binding does not: with --binding and --save-binding "
          "give it a length");
    plan.refine.mode = RefineOptions::Mode::off;
  }
  const bool mesh = plan.output ? !is_cad(*plan.output) : !plan.crack.pieces.empty();
  if (!arguments.points.empty() || !mesh) plan.refine.mode = RefineOptions::Mode::off;
}

std::vector<std::string> inputs_of(const Arguments& arguments) {
  std::vector<std::string> inputs = {arguments.body, arguments.onto, arguments.points, arguments.binding};
  if (names_pieces(arguments.body))
    for (const std::string& file : files_of(read_piece_list(arguments.body))) inputs.push_back(file);
  return inputs;
}

Plan make_plan(Arguments& arguments, const CommandLine& app) {
  Plan plan;
  plan.options = map_options(arguments.map);
  const bool foreign = !arguments.onto.empty() || !arguments.points.empty();
  if (foreign) plan.options.far = FarVertices::refuse;
  if (!arguments.far.empty()) plan.options.far = far_vertices(arguments.far);
  plan.options.far_distance = arguments.far_distance;
  plan.unit = arguments.unit.empty() ? 0 : length_unit(arguments.unit);
  plan.series = extension(arguments.body) == "pvd";
  plan.in_pieces = names_pieces(arguments.body);
  plan.crack = crack_options(arguments.map);
  check_pieces(arguments, plan, !foreign);
  check_binding(arguments, plan);
  if (arguments.output.empty() && arguments.map.pieces.empty()) arguments.output = std::string("-");
  if (!arguments.onto.empty() && !arguments.points.empty())
    throw InputError("--onto and --points exclude each other: give one of them");
  if (!arguments.edge.empty()) {
    if (arguments.onto.empty())
      throw InputError(
          "--edge is of the mesh of --onto: the body's own is split where it is read, by flexel-voxelize "
          "--edge");
    plan.edge = parse_quantity(arguments.edge, Dimension::length);
    if (!(*plan.edge > 0)) throw InputError("--edge: must be above zero");
  }
  if ((arguments.body == "-") + (arguments.onto == "-") + (arguments.points == "-") > 1)
    throw InputError("only one input can come from stdin");
  if (plan.series && arguments.output == "-")
    throw InputError("a series gives a file for each frame: name it with -o, such as -o bent.stl");
  if (plan.series && arguments.json)
    throw InputError("--json is of one state: give one frame, or --report for a file a frame");
  if (arguments.points.empty() && !arguments.output.empty())
    plan.output = map_output(arguments.map.format, arguments.output, arguments.map.ascii, plan.unit,
                             arguments.map.scale, arguments.map.attributes);
  else if (!arguments.points.empty() &&
           (arguments.map.attributes || arguments.map.ascii || !arguments.map.format.empty()))
    throw InputError("--points: a table comes out; --format, --ascii and --attributes are for surfaces");
  const bool cad = plan.output && is_cad(*plan.output);
  check_cad_output(arguments.map, plan.crack, cad);
  if (cad && foreign)
    throw InputError("--onto: a mesh has no faces that a CAD file could hold: write STL, OBJ, ...");
  if (cad && (!arguments.far.empty() || !arguments.binding.empty()))
    throw InputError(
        "--far and --binding are for vertices, which STEP, IGES and BREP do not have: leave them out");
  check_in_pieces(arguments, plan);
  plan_refinement(arguments, app, plan);
  std::vector<OutputName> outputs = {{arguments.save_binding, true}};
  if (!plan.series) outputs.insert(outputs.end(), {{arguments.map.report}, {arguments.output}});
  if (arguments.json) outputs.push_back({"-"});
  check_outputs(outputs, inputs_of(arguments), arguments.force);
  return plan;
}

// Reads a mesh in the part's frame; a file without a unit is in the part's.
Surface read_onto(const std::string& path, const Body& body, std::optional<double> edge) {
  ImportOptions options;
  options.largest_edge = edge;
  const FileFormat* format = format_named(extension(path));
  if (format != nullptr && !format->carries_unit && !format->is_cad)
    options.unit = default_unit(body.surface);
  return import_surface(path, options);
}

// Maps one state and writes it. `binding` is that of the body's lattice and surface.
class Run {
 public:
  Run(const Arguments& arguments, const Plan& plan, Progress& progress)
      : arguments_(arguments), plan_(plan), progress_(progress) {
    if (!arguments.binding.empty()) advice_ = SplitAdvice::new_binding;
  }

  // Takes what is to be mapped, in place of the body's own surface where the arguments say so.
  void take_surface(Body& body) {
    unit_ = plan_.unit > 0 ? plan_.unit : default_unit(body.surface);
    if (!arguments_.onto.empty()) {
      foreign_ = read_onto(arguments_.onto, body, plan_.edge);
      for (const std::string& line : refinement_notes(*foreign_)) progress_.say(line);
      map_onto(body, *foreign_);
    }
    if (!arguments_.points.empty()) {
      table_ = read_points(arguments_.points, unit_);
      anchors_ = map_points(body, table_->points);
    }
  }

  // Of a table's points, which the body's surface told; nothing: those that the mapping finds.
  [[nodiscard]] const std::optional<VertexAnchors>& anchors() const { return anchors_; }
  // Cells have other numbers now, and what lies under the surface is not known any more.
  void forget_anchors() {
    if (!anchors_) return;
    anchors_.reset();
    progress_.warn(
        "the lattice changes in this series: from here on a point goes with its nearest element, which "
        "beside another "
        "part or wall nearer than a cell may be that one's");
  }
  [[nodiscard]] const Surface* written() const { return foreign_ ? &*foreign_ : nullptr; }
  [[nodiscard]] std::vector<SurfaceFormat> formats() const {
    std::vector<SurfaceFormat> formats;
    if (plan_.output && plan_.output->format) formats.push_back(*plan_.output->format);
    if (!plan_.crack.pieces.empty()) formats.push_back(plan_.crack.pieces_format);
    return formats;
  }
  // From now on this is written in place of the body's surface.
  void write_instead(Surface surface) { foreign_ = std::move(surface); }

  // Splits what is mapped and what is written, of all states alike.
  void split(Body& body, const Refinement& refinement) {
    if (!refinement.changes()) return;
    SplitSurface split =
        split_surface(foreign_ ? *foreign_ : body.surface, refinement, plan_.refine, formats());
    progress_.say(split.line);
    if (!split.surface) {
      advice_ = SplitAdvice::none;
      return;
    }
    split_from_ = triangle_count(body.surface);
    if (foreign_) {
      take_refined(body, refined(body.surface, refinement), refinement);
      foreign_ = std::move(split.surface);
    } else {
      take_refined(body, *std::move(split.surface), refinement);
    }
  }

  // Of a body of which only a part was read.
  void whole_volume(const LatticeVolume& volume) { whole_ = volume; }

  [[nodiscard]] bool foreign() const { return foreign_ || table_; }

  // Says what was found, and writes.
  void finish(const Surface& surface, const Body& body, const MapResult& result, MapReport found,
              const std::string& path) {
    if (split_from_) found.split_from = split_from_;
    if (whole_) {
      found.lattice_volume_before = whole_->before;
      found.lattice_volume_after = whole_->after;
    }
    if (plan_.output && is_cad(*plan_.output)) found.chord.reset();  // its faces are no triangles
    if (found.split_advice == SplitAdvice::length) found.split_advice = advice_;
    progress_.finish();
    if (!table_) say_report(found, arguments_.map, plan_.options, progress_);
    std::string report = arguments_.map.report;
    if (plan_.series && !report.empty()) report = frame_name(report, frame_);
    OutputsTogether outputs({report, path, plan_.crack.pieces});
    try {
      write_report(found, arguments_.map, plan_.options, report);
    } catch (const InvalidMappingError&) {
      outputs.appear();
      print_json(found);
      throw;
    }
    progress_.stage("write");
    if (table_) {
      std::vector<Vec3> displacement = result.displacement;
      for (Vec3& u : displacement) u *= arguments_.map.scale;
      write_text(moved_points(*table_, displacement, unit_), path);
    }
    if (!plan_.crack.pieces.empty())
      write_parts(surface, result.displacement, plan_.crack.pieces_format, unit_, plan_.crack.pieces);
    if (plan_.output) {
      MapOutput output = *plan_.output;
      output.path = path;
      if (is_cad(output))
        write_part(body, found, output, outputs);
      else
        write_mapped(foreign_ ? *foreign_ : surface, body, result, output);
    }
    outputs.appear();
    progress_.finish();
    print_json(found);
    ++frame_;
  }

 private:
  void print_json(const MapReport& found) const {
    if (arguments_.json) write_text(report_json(found, plan_.options), "-");
  }
  // What is not as it should be, with --strict, leaves the report.
  void write_part(const Body& body, const MapReport& found, const MapOutput& output,
                  OutputsTogether& outputs) {
    try {
      for (const CadAnswer& answer :
           write_cad(body, found, arguments_.map, plan_.options, {output}, progress_))
        progress_.say(answer.line);
    } catch (const InvalidMappingError&) {
      outputs.appear();
      print_json(found);
      throw;
    }
  }
  const Arguments& arguments_;
  const Plan& plan_;
  Progress& progress_;
  std::optional<Surface> foreign_;
  std::optional<PointTable> table_;
  std::optional<VertexAnchors> anchors_;   // of its points
  std::optional<std::size_t> split_from_;  // triangles
  std::optional<LatticeVolume> whole_;
  SplitAdvice advice_ = SplitAdvice::length;
  double unit_ = 0;
  std::size_t frame_ = 0;
};

// The binding that the arguments name: read, with its method, or made and saved. Nothing where they name
// none and the anchors are not known either.
std::optional<Binding> own_binding(const Arguments& arguments, const Body& body,
                                   const std::optional<VertexAnchors>& anchors, std::size_t states,
                                   MapOptions& options) {
  std::optional<Binding> binding;
  if (!arguments.binding.empty()) {
    binding = read_binding(arguments.binding, body);
    if (!arguments.map.method.empty() && binding->method != options.method)
      throw InputError(arguments.binding, fmt::format("is a binding of method {}, not {}: leave out --method",
                                                      name_of(binding->method), name_of(options.method)));
    options.method = binding->method;
  } else if (!arguments.save_binding.empty()) {
    binding = anchors ? bind(body, options.method, *anchors) : bind(body, options.method);
    write_binding(*binding, body, arguments.save_binding);
  } else if (anchors) {
    binding = bind(body, options.method, *anchors, states);
  }
  return binding;
}

void map_one(const Arguments& arguments, Plan& plan, Progress& progress) {
  Run run(arguments, plan, progress);
  progress.stage("read");
  Body body;
  if (plan.in_pieces) {
    NearBody near = read_near_surface(arguments.body);
    body = std::move(near.body);
    run.whole_volume(near.volume);
  } else {
    body = read_body(arguments.body);
  }
  if (!arguments.force) keep_source(body, arguments.output);
  run.take_surface(body);
  use_field(body, arguments.map, plan.options);
  progress.stage("map");
  if (plan.refine.mode == RefineOptions::Mode::to_edge)
    run.split(body, refine_to_edge(body.surface, plan.refine.edge));
  const std::optional<Binding> known = own_binding(arguments, body, run.anchors(), 1, plan.options);
  if (plan.refine.mode == RefineOptions::Mode::automatic) {
    MappedPart mapped =
        map_refined(body, plan.options, plan.crack, plan.refine, run.written(), run.formats(), progress);
    const Surface& surface = mapped.surface(body);
    if (!mapped.split_line.empty()) progress.say(mapped.split_line);
    if (run.foreign() && mapped.refined) run.write_instead(*mapped.refined);
    return run.finish(surface, body, mapped.result, mapped.report, arguments.output);
  }
  const MappedPart mapped = map_part(body, plan.options, plan.crack, progress, known ? &*known : nullptr);
  run.finish(mapped.surface(body), body, mapped.result, mapped.report, arguments.output);
}

// Before the first frame is mapped: all have the same triangles.
void split_for_series(const std::vector<std::string>& files, Body& first, const Plan& plan, Run& run,
                      Progress& progress) {
  using Mode = RefineOptions::Mode;
  if (plan.refine.mode == Mode::to_edge) run.split(first, refine_to_edge(first.surface, plan.refine.edge));
  if (plan.refine.mode != Mode::automatic) return;
  const RefinedSeries found =
      refinement_of_series(first, files, plan.options, plan.crack.mode != CrackMode::keep, progress);
  if (!found.line.empty()) progress.say(found.line);
  if (found.refinement) run.split(first, *found.refinement);
}

// Frames share one binding until the lattice changes (something was cut off) or breaks, and the first one's surface.
void map_series(const Arguments& arguments, Plan& plan, Progress& progress) {
  Run run(arguments, plan, progress);
  const std::vector<std::string> files = series_files(arguments.body);
  std::vector<std::string> inputs = inputs_of(arguments);
  inputs.insert(inputs.end(), files.begin(), files.end());
  for (std::size_t f = 0; f < files.size(); ++f) {
    std::vector<OutputName> outputs = {{frame_name(arguments.output, f)}};
    if (!arguments.map.report.empty()) outputs.push_back({frame_name(arguments.map.report, f)});
    check_outputs(outputs, inputs, arguments.force);
  }
  Body body;
  std::optional<Binding> binding;
  for (std::size_t f = 0; f < files.size(); ++f) {
    check_stop();
    progress.stage(fmt::format("frame {} of {}", f + 1, files.size()));
    Body next = f == 0 ? read_body(files[f]) : read_frame(files[f]);
    if (f == 0) {
      run.take_surface(next);
      use_field(next, arguments.map, plan.options);
      split_for_series(files, next, plan, run, progress);
      binding = own_binding(arguments, next, run.anchors(), files.size(), plan.options);
    } else {
      take_surface(next, body, files[f]);
      if (next.cell_elements != body.cell_elements) run.forget_anchors();
      if (!same_lattice(next, body)) binding.reset();
    }
    body = std::move(next);
    if (!run.foreign() && may_be_broken(body)) {  // what breaks is bound anew, for its pieces
      const MappedPart mapped = map_part(body, plan.options, plan.crack, progress);
      run.finish(mapped.surface(body), body, mapped.result, mapped.report, frame_name(arguments.output, f));
      continue;
    }
    if (!binding)
      binding = run.anchors() ? bind(body, plan.options.method, *run.anchors(), files.size() - f)
                              : bind(body, plan.options.method, files.size() - f);
    MapResult result = map_state(*binding, body);
    complete(body, plan.options, result);
    run.finish(body.surface, body, result, report(body, result), frame_name(arguments.output, f));
  }
}

int run(int argc, char** argv) {
  Arguments arguments;
  CommandLine app{"Maps the deformation of a body onto the surface that it was made from.", kProgram};
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  Plan plan = make_plan(arguments, app);
  const ThreadLimit limit(arguments.threads);
  Progress progress(kProgram, arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  plan.series ? map_series(arguments, plan, progress) : map_one(arguments, plan, progress);
  return kExitDone;
}

}  // namespace
}  // namespace flexel::mapping

int main(int argc, char** argv) {
  return flexel::run_program(flexel::mapping::kProgram, [&] { return flexel::mapping::run(argc, argv); });
}
