// flexel-simulate: body + scene -> deformed body.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/program/arguments.h"
#include "base/program/brief_output.h"
#include "base/program/program.h"
#include "base/program/termination.h"
#include "formats/exchange/body_name.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/merge.h"
#include "simulate/answer.h"
#include "simulate/effects/rigid.h"
#include "simulate/matter/stress.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/scene/strength.h"
#include "simulate/simulate.h"
#include "simulate/summary.h"
#include "simulate/time/checkpoint.h"

namespace {

using namespace flexel;
using namespace flexel::simulate;

struct Arguments {
  std::string scene;
  std::vector<std::string> bodies;
  std::string output, summary, resume, checkpoint_every;
  std::vector<std::string> live;
  SimulateOptions options;
  bool quiet = false, verbose = false, compress = false, force = false, json = false;
};

// CLI11's ranges let "nan" pass.
std::string is_rate(const std::string& text) {
  double rate = 0;
  return is_number(text, rate) && rate >= 1e-3 && rate <= 1e5
             ? ""
             : fmt::format("\"{}\" is no number from 0.001 to 100000", text);
}

void declare(CommandLine& app, Arguments& arguments) {
  app.add_option("scene", arguments.scene, "Scene file (TOML; docs/reference/scene.md gives every key)");
  app.add_option("body", arguments.bodies,
                 "Body files; none or \"-\": stdin. Several are simulated together");
  app.add_option("-o,--output", arguments.output,
                 "Deformed body (.vtu; in timed runs also .pvd, a series of frames); \"-\": stdout");
  app.add_option("--checkpoint", arguments.options.checkpoint,
                 "Timed runs: write now and then, and when the run is stopped, all that it needs to go on to "
                 "this file (docs/reference/motion.md)");
  app.add_option("--checkpoint-every", arguments.checkpoint_every,
                 "Work between two of them (\"60 s\"); \"10 min\" by itself")
      .type_name("TIME");
  app.add_option(
      "--resume", arguments.resume,
      "Go on from this checkpoint to the same bits; scene, body, -o and --history are those of the "
      "run, and need not be given");
  add_threads_option(app, arguments.options.threads);
  app.add_option("--summary", arguments.summary,
                 "Write the summary as JSON to this file (docs/reference/summary.md)");
  app.add_flag("--json", arguments.json, "Print it to stdout; the body needs a file (-o)");
  app.add_flag("--explain", arguments.options.explain,
               "Say which effects run and why, and the share of time of each");
  app.add_option(
      "--history", arguments.options.history,
      "Timed runs: write energies, momenta and probes over time to this CSV file (docs/reference/motion.md)");
  app.add_option(
         "--live", arguments.live,
         "Timed runs: keep real time, and write frames of positions and of what tools feel to stdout, "
         "or where readers attach: tcp:PORT on this machine, unix:PATH (docs/guide/live.md)")
      .value_may_be_left_out()
      .type_name("[WHERE]");
  app.add_option("--live-rate", arguments.options.live_rate, "Frames a second").check(is_rate).show_default();
  app.add_option("--live-state", arguments.options.live_state,
                 "Every so many frames hold the positions; 0: none does")
      .not_negative()
      .show_default();
  app.add_option("--isa", arguments.options.isa,
                 "Timed runs: instruction set of the kernel (portable, avx2, avx512); the best by itself");
  app.add_flag("!--no-stress", arguments.options.stress, "Leave out the stresses (docs/theory/stress.md)");
  app.add_flag(
      "!--no-estimate", arguments.options.estimate,
      "Leave out the error bars, and the two coarser runs that they come from (docs/theory/error-bars.md)");
  app.add_flag("--quiet", arguments.quiet, "Say nothing but warnings and errors");
  app.add_flag("--verbose", arguments.verbose, "Say all that was found");
  app.add_flag("--compress", arguments.compress, "Compress the arrays of the body file");
  app.add_flag("--force", arguments.force, "Let results replace files that are read");
}

Body read_bodies(std::vector<std::string> paths) {
  if (paths.empty()) paths.emplace_back("-");
  if (std::count(paths.begin(), paths.end(), "-") > 1) throw InputError("\"-\" (stdin) is given twice");
  Body body;
  for (std::size_t p = 0; p < paths.size(); ++p) {
    Body next = read_body(paths[p]);
    erase_stress_columns(next);  // results of an earlier run, which another body may not have
    if (p == 0)
      body = std::move(next);
    else
      append(body, std::move(next));
  }
  return body;
}

std::string failed_name(const std::string& output) {
  if (output == "-") return "";
  const bool ends = extension(output) == "vtu" || extension(output) == "pvd";
  return (ends ? output.substr(0, output.size() - 4) : output) + ".failed.vtu";
}

struct Input {
  Scene scene;
  Body body;
};

// What a checkpoint holds; scene and bodies that are given as well must be the same.
Input resume(Arguments& arguments) {
  Resumed resumed = read_checkpoint(arguments.resume);
  Checkpoint& from = resumed.checkpoint;
  const auto refuse = [&](const std::string& what) { throw InputError(arguments.resume, what); };
  if (!arguments.scene.empty() && read_scene(arguments.scene).text != from.scene)
    refuse(
        fmt::format("is of a run of another scene than {}: leave the scene out, or begin anew without "
                    "--resume",
                    arguments.scene));
  if (!arguments.bodies.empty() && body_fingerprint(read_bodies(arguments.bodies)) != from.input)
    refuse("is of a run of another body: leave the body out, or begin anew without --resume");
  SimulateOptions& options = arguments.options;
  if (arguments.output.empty()) arguments.output = from.output;
  if ((extension(arguments.output) == "pvd" || extension(from.output) == "pvd") &&
      arguments.output != from.output)
    refuse(fmt::format("is of a run with -o {}: frames go on there; leave -o out", from.output));
  if (!options.history.empty() && from.history.empty())
    refuse("is of a run without --history, whose beginning is lost: leave --history out");
  if (options.history.empty()) options.history = from.history;
  if (options.checkpoint.empty()) options.checkpoint = arguments.resume;
  arguments.compress = arguments.compress || from.compress;
  Input input{parse_scene(from.scene, from.scene_name), std::move(resumed.body)};
  options.resume = std::make_shared<const Checkpoint>(std::move(from));
  return input;
}

// stdin and stdout each have one use.
void refuse_shared_streams(const Arguments& arguments, const Scene& scene) {
  const auto& bodies = arguments.bodies;
  const bool body = bodies.empty() || std::count(bodies.begin(), bodies.end(), "-") > 0;
  for (const Manipulator& each : scene.get<RigidParts>().manipulators) {
    if (!each.live) continue;
    if (arguments.scene == "-")
      throw InputError(each.origin, "poses and the scene cannot both come from stdin; give the scene's file");
    if (body)
      throw InputError(each.origin, "poses and the body cannot both come from stdin; give the body's file");
  }
}

// A run that is resumed goes on with its checkpoint.
void check_files(const Arguments& arguments) {
  const SimulateOptions& options = arguments.options;
  std::vector<OutputName> results = {{arguments.output, true},
                                     {arguments.summary},
                                     {options.history},
                                     {options.live == "-" ? "-" : ""},
                                     {arguments.json ? "-" : ""}};
  for (OutputName& each : results) each.literal = true;
  std::vector<OutputName> all = results;
  all.push_back({options.checkpoint, false, true});
  all.push_back({options.failed_output, false, true});
  std::vector<std::string> inputs = arguments.bodies;
  inputs.push_back(arguments.scene);
  check_outputs(all, inputs, arguments.force);
  check_outputs(results, {arguments.resume}, arguments.force);
}

Input read_input(Arguments& arguments) {
  const StopEndsProcess at_once;
  if (arguments.scene == "-" && arguments.bodies.empty())
    throw InputError("scene and body cannot both come from stdin; give the body's file");
  if (!arguments.resume.empty()) return resume(arguments);
  if (arguments.scene.empty())
    throw InputError("a scene is needed, for example scene.toml; --help shows what is accepted");
  Scene scene = read_scene(arguments.scene);  // before the body: a typo is answered at once
  refuse_shared_streams(arguments, scene);
  return {std::move(scene), read_bodies(arguments.bodies)};
}

int run(int argc, char** argv) {
  CommandLine app("Deforms a body as a scene says: loads, fixes and moves, to equilibrium.",
                  "flexel-simulate");
  Arguments arguments;
  declare(app, arguments);
  // Runs in time leave something, and see to it themselves; a time limit, which comes later, leaves the last state.
  const StopEndsProcess nothing_is_left;
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  Progress progress("flexel-simulate", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  const KeptWarnings warnings;  // for the summary
  SimulateOptions& options = arguments.options;
  if (!arguments.checkpoint_every.empty()) {
    if (options.checkpoint.empty() && arguments.resume.empty())
      throw InputError("--checkpoint-every needs --checkpoint FILE");
    options.checkpoint_every = parse_timeout(arguments.checkpoint_every, "--checkpoint-every");
  }
  if (app.has("--live")) {
    options.live = arguments.live.empty() || arguments.live.front().empty() ? "-" : arguments.live.front();
    if (options.live == "-" && (arguments.output.empty() || arguments.output == "-"))
      throw InputError(
          "--live writes frames to stdout: name the body's file with -o, or give --live tcp:PORT");
  }
  if (const std::string line = body_name_warning(arguments.output); !line.empty()) progress.warn(line);
  progress.stage("read");
  auto [scene, body] = read_input(arguments);
  if (arguments.output.empty()) arguments.output = std::string("-");
  options.failed_output = failed_name(arguments.output);
  check_files(arguments);
  options.output = arguments.output;
  options.compress = arguments.compress;
  const bool series = extension(arguments.output) == "pvd";
  if (series) options.series = arguments.output;
  OutputsTogether outputs({series ? "" : arguments.output, options.history, arguments.summary});
  const SimulateResult result = simulate::simulate(body, scene, options, progress);
  const std::vector<Material> materials = known_materials(scene, body);
  const auto summary = [&] { return summary_json(result, body, materials, warnings.lines()); };
  if (arguments.verbose || options.explain)
    for (const std::string& line : summary_lines(result)) progress.say(line);
  progress.stage("write");
  BodyFileOptions file_options;
  file_options.compress = arguments.compress;
  if (!series) write_body(body, arguments.output, file_options);
  if (!arguments.summary.empty()) write_text(summary(), arguments.summary);
  outputs.appear();
  progress.finish();
  for (const std::string& line : answer_lines(result, body, materials)) progress.say(line);
  if (arguments.json) write_text(summary(), "-");
  return kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  return flexel::run_program("flexel-simulate", [&] { return run(argc, argv); });
}
