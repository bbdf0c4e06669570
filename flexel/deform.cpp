// flexel deform: every stage in one process, on one body in memory. All that can be wrong with the arguments
// is found before the first stage runs, and nothing is written before the last has ended.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "flexel/actions.h"
#include "flexel/commands.h"
#include "formats/body_file.h"
#include "formats/files.h"
#include "formats/import.h"
#include "formats/parallel.h"
#include "formats/program.h"
#include "formats/size_warning.h"
#include "formats/units.h"
#include "mapping/options.h"
#include "mapping/output.h"
#include "simulate/simulate.h"
#include "voxelize/voxelize.h"

namespace flexel {
namespace {

struct Arguments {
  std::vector<std::string> parts, fixes, pushes, moves, outputs;
  std::string scene, material, size, heal = "auto", placement = "corner", unit, edge, summary, body, timeout;
  std::optional<std::size_t> count;
  MapArguments map;
  int threads = 0;
  bool quiet = false, estimate = true;
};

void declare_input(CLI::App& app, Arguments& arguments) {
  app.add_option("part", arguments.parts, "STEP, IGES, BREP, STL, OBJ, PLY, OFF, glTF or 3MF files; -: stdin")
      ->required()
      ->type_name("PART");
  app.add_option("--scene", arguments.scene, "Scene file (TOML; docs/scene.md)")->type_name("FILE");
  app.add_option("--fix", arguments.fixes,
                 "Hold this surface: \"xmin\", \"part/3\" (`flexel info` lists faces)")
      ->type_name("WHERE")
      ->allow_extra_args(false);
  app.add_option("--push", arguments.pushes,
                 "Push a surface: \"xmax: 0 0 -50 N\", \"part/3: 50 N\" (inwards), \"part/3: 2 MPa\"")
      ->type_name("WHERE:FORCE")
      ->allow_extra_args(false);
  app.add_option("--move", arguments.moves, "Move a surface: \"xmax: 0 0 -2 mm\", \"part/3: 2 mm\" (inwards)")
      ->type_name("WHERE:LENGTH")
      ->allow_extra_args(false);
  app.add_option("--material", arguments.material,
                 "What the parts are made of: steel, PLA, ... (docs/scene.md)")
      ->type_name("NAME");
  app.add_option("--size", arguments.size, "Spacing of the lattice (\"2 mm\")")->type_name("LENGTH");
  app.add_option("--count", arguments.count, "Or: about this many cells (default 20000)")->type_name("N");
  app.add_option("--placement", arguments.placement,
                 "Elements at the voxels' corner or centre (model \"paper\")")
      ->type_name("WHERE")
      ->capture_default_str();
  app.add_option("--heal", arguments.heal, "Broken surfaces: auto, wrap or none (docs/healing.md)")
      ->type_name("HOW")
      ->capture_default_str();
  app.add_option("--unit", arguments.unit, "Unit of files that carry none (default mm)")->type_name("UNIT");
  app.add_option("--edge", arguments.edge,
                 "STEP: longest edge of the mesh (default a 64th of the solid's diagonal)")
      ->type_name("LENGTH");
}

void declare_output(CLI::App& app, Arguments& arguments) {
  app.add_option("-o,--output", arguments.outputs,
                 "The deformed part (.stl, .obj) or body (.vtu); again for more; -: stdout")
      ->type_name("FILE")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--body", arguments.body, "Write the deformed body (.vtu) too")->type_name("FILE");
  declare_map_options(app, arguments.map);
  app.add_option("--summary", arguments.summary, "Write the summary of all stages (JSON; docs/deform.md)")
      ->type_name("FILE");
  app.add_option("--threads", arguments.threads, "Threads; 0 is every core")->check(CLI::NonNegativeNumber);
  app.add_option("--timeout", arguments.timeout,
                 "Stop the simulation after this time (\"90 s\"): exit 5, the last good state in "
                 "OUTPUT.failed.vtu")
      ->type_name("TIME");
  app.add_flag("!--no-estimate", arguments.estimate, "Leave out the error bars (docs/error-bars.md)");
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
}

// What the arguments ask for, checked.
struct Plan {
  ImportOptions import;
  VoxelizeOptions voxelize;
  Scene scene;
  std::vector<Action> pushes, moves;
  std::optional<double> timeout;  // s
  MapOptions map;
  CrackOptions crack;
  struct Output {
    std::string path;
    std::optional<MapOutput> surface;  // nothing: the body
  };
  std::vector<Output> outputs;
};

// The material must be known before the work begins: without one there is no resistance to compute.
void check_material(const Arguments& arguments, const Scene& scene) {
  std::vector<std::string> known;
  for (const auto& [name, material] : scene.materials) known.push_back(name);
  for (const Material& material : material_library()) known.push_back(material.name);
  if (arguments.material.empty() && arguments.scene.empty())
    throw InputError(
        fmt::format("no material: add --material NAME; the library has {}", fmt::join(known, ", ")));
  if (arguments.material.empty() || scene.materials.count(arguments.material) ||
      library_material(arguments.material))
    return;
  const std::string hint = did_you_mean(arguments.material, known);
  throw InputError(
      fmt::format("--material: no material \"{}\"{}", arguments.material,
                  hint.empty() ? fmt::format("; the library has {}", fmt::join(known, ", ")) : hint));
}

void plan_scene(const Arguments& arguments, Plan& plan) {
  if (!arguments.scene.empty())
    plan.scene = read_scene(arguments.scene);
  else
    plan.scene.name = "flexel deform";
  check_material(arguments, plan.scene);
  if (!arguments.material.empty()) plan.scene.material = arguments.material;
  for (const std::string& where : arguments.fixes)
    plan.scene.get<Ties>().ties.push_back(make_fix(parse_where(where, "--fix")));
  for (const std::string& text : arguments.pushes) plan.pushes.push_back(parse_push(text));
  for (const std::string& text : arguments.moves) plan.moves.push_back(parse_move(text));
  if (arguments.scene.empty() && plan.pushes.empty() && plan.moves.empty())
    throw InputError(
        "nothing acts on the part: add --push \"WHERE: 0 0 -50 N\", --move \"WHERE: 0 0 -2 mm\" or --scene "
        "FILE");
}

void plan_outputs(const Arguments& arguments, Plan& plan) {
  for (const std::string& path : arguments.outputs)
    if (extension(path) == "vtu")
      plan.outputs.push_back({path, std::nullopt});
    else
      plan.outputs.push_back(
          {path, map_output(path == "-" ? arguments.map.format : "", path, arguments.map.ascii, 0,
                            arguments.map.scale, arguments.map.attributes)});
  if (!arguments.body.empty()) plan.outputs.push_back({arguments.body, std::nullopt});
  std::vector<std::string> paths{arguments.map.report, arguments.summary};
  for (const Plan::Output& output : plan.outputs) paths.push_back(output.path);
  std::sort(paths.begin(), paths.end());
  for (std::size_t i = 1; i < paths.size(); ++i)
    if (!paths[i].empty() && paths[i] == paths[i - 1])
      throw InputError("two results would go to \"" + paths[i] + "\"");
}

Plan make_plan(const Arguments& arguments) {
  Plan plan;
  if (std::count(arguments.parts.begin(), arguments.parts.end(), "-") + (arguments.scene == "-") > 1)
    throw InputError("only one input can come from stdin");
  if (!arguments.unit.empty()) plan.import.unit = length_unit(arguments.unit);
  if (!arguments.edge.empty()) {
    plan.import.largest_edge = parse_quantity(arguments.edge, Dimension::length);
    if (!(*plan.import.largest_edge > 0)) throw InputError("--edge: must be above zero");
  }
  if (!arguments.size.empty() && arguments.count) throw InputError("give --size or --count, not both");
  if (!arguments.size.empty()) {
    plan.voxelize.size = parse_quantity(arguments.size, Dimension::length);
    if (!(*plan.voxelize.size > 0)) throw InputError("--size: must be above zero");
  }
  if (arguments.count && *arguments.count == 0) throw InputError("--count: must be above zero");
  plan.voxelize.count = arguments.count;
  if (!arguments.timeout.empty()) plan.timeout = parse_timeout(arguments.timeout);
  plan.voxelize.heal = heal_choice(arguments.heal);
  plan.voxelize.placement = placement_choice(arguments.placement);
  plan.map = map_options(arguments.map);
  plan.crack = crack_options(arguments.map);
  plan_outputs(arguments, plan);
  plan_scene(arguments, plan);
  return plan;
}

Surface import_parts(const std::vector<std::string>& paths, const ImportOptions& options) {
  Surface surface = import_surface(paths.front(), options);
  for (std::size_t p = 1; p < paths.size(); ++p) append(surface, import_surface(paths[p], options));
  return surface;
}

// Where the last good state goes when the simulation diverges: beside the first file that is written.
std::string failed_name(const Plan& plan) {
  for (const Plan::Output& output : plan.outputs) {
    if (output.path == "-") continue;
    const std::string ending = "." + extension(output.path);
    return output.path.substr(0, output.path.size() - ending.size()) + ".failed.vtu";
  }
  return "";
}

void write_outputs(const Plan& plan, const Body& body, const MappedPart& mapped, Progress& progress) {
  progress.stage("write");
  if (!plan.crack.pieces.empty())
    write_parts(mapped.surface(body), mapped.result.displacement, plan.crack.pieces_format,
                default_unit(body.surface), plan.crack.pieces);
  for (const Plan::Output& output : plan.outputs)
    if (output.surface)
      write_mapped(mapped.surface(body), body, mapped.result, *output.surface);
    else
      write_body(body, output.path);
}

int run_stages(const Arguments& arguments, Plan& plan, Progress& progress) {
  progress.stage("import");
  Surface surface = import_parts(arguments.parts, plan.import);
  for (const std::string& line : size_warnings(surface)) progress.warn(line);
  VoxelizeResult voxels = voxelize(std::move(surface), plan.voxelize, progress);
  report(voxels, progress);
  Body& body = voxels.body;
  for (const Action& push : plan.pushes) add_push(plan.scene, push, body);
  for (const Action& move : plan.moves) add_move(plan.scene, move, body);

  SimulateOptions options;
  options.threads = arguments.threads;
  options.failed_output = failed_name(plan);
  options.timeout = plan.timeout;
  options.estimate = arguments.estimate;
  const SimulateResult simulated = simulate(body, plan.scene, options, progress);
  for (const std::string& line : summary_lines(simulated)) progress.say(line);

  progress.stage("map");
  const MappedPart mapped = map_part(body, plan.map, plan.crack, progress);
  const MapReport& found = mapped.report;
  progress.finish();
  say_report(found, arguments.map, plan.map, progress);
  write_report(found, arguments.map, plan.map, arguments.map.report);
  write_outputs(plan, body, mapped, progress);
  if (!arguments.summary.empty()) {
    nlohmann::ordered_json summary;
    summary["voxelize"] = nlohmann::ordered_json::parse(summary_json(voxels));
    summary["simulate"] = nlohmann::ordered_json::parse(summary_json(simulated, body));
    summary["map"] = nlohmann::ordered_json::parse(report_json(found, plan.map));
    write_text(summary.dump(2) + "\n", arguments.summary);
  }
  progress.finish();
  return kExitDone;
}

}  // namespace

int deform_command(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Deforms a part as its material would be: import, lattice, simulation and mapping in one run.",
               "flexel deform"};
  declare_input(app, arguments);
  declare_output(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  Plan plan = make_plan(arguments);
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  return run_stages(arguments, plan, progress);
}

}  // namespace flexel
