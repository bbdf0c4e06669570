// flexel deform: every stage in one process, on one body in memory. All that can be wrong with the arguments
// is found before the first stage runs, and nothing is written before the last has ended.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "flexel/commands.h"
#include "flexel/job.h"
#include "formats/body_file.h"
#include "formats/files.h"
#include "formats/parallel.h"
#include "mapping/options.h"
#include "mapping/output.h"
#include "simulate/simulate.h"

namespace flexel {
namespace {

struct Arguments {
  JobArguments job;
  std::vector<std::string> outputs;
  std::string summary, body, timeout;
  MapArguments map;
  int threads = 0;
  bool quiet = false, estimate = true;
};

void declare_input(CLI::App& app, JobArguments& arguments) {
  declare_job(app, arguments);
  app.add_option("--placement", arguments.placement,
                 "Elements at the voxels' corner or centre (model \"paper\")")
      ->type_name("WHERE")
      ->capture_default_str();
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
  Job job;
  std::optional<double> timeout;  // s
  MapOptions map;
  CrackOptions crack;
  struct Output {
    std::string path;
    std::optional<MapOutput> surface;  // nothing: the body
  };
  std::vector<Output> outputs;
};

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
  if (!arguments.timeout.empty()) plan.timeout = parse_timeout(arguments.timeout);
  plan.map = map_options(arguments.map);
  plan.crack = crack_options(arguments.map);
  plan_outputs(arguments, plan);
  plan.job = plan_job(arguments.job);
  return plan;
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
  VoxelizeResult voxels =
      voxelize(read_parts(arguments.job.parts, plan.job.import, progress), plan.job.voxelize, progress);
  report(voxels, progress);
  Body& body = voxels.body;
  add_actions(plan.job, body);

  SimulateOptions options;
  options.threads = arguments.threads;
  options.failed_output = failed_name(plan);
  options.timeout = plan.timeout;
  options.estimate = arguments.estimate;
  const SimulateResult simulated = simulate(body, plan.job.scene, options, progress);
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
  declare_input(app, arguments.job);
  declare_output(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  Plan plan = make_plan(arguments);
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  return run_stages(arguments, plan, progress);
}

}  // namespace flexel
