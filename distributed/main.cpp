// flexel-simulate-mpi: body + scene -> deformed body, on all ranks of an mpirun.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/outputs.h"
#include "base/parallel.h"
#include "base/program/arguments.h"
#include "base/program/brief_output.h"
#include "base/program/program.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "distributed/checkpoint.h"
#include "distributed/petsc.h"
#include "distributed/refusals.h"
#include "distributed/result_in_pieces.h"
#include "distributed/team.h"
#include "formats/lattice/body_file.h"
#include "formats/pieces/join.h"
#include "simulate/answer.h"
#include "simulate/matter/stress.h"
#include "simulate/scene/strength.h"
#include "simulate/simulate.h"
#include "simulate/summary.h"

namespace {

using namespace flexel;
using namespace flexel::simulate;

constexpr const char* kProgram = "flexel-simulate-mpi";

struct Arguments {
  std::string scene, body, output, summary, petsc, resume;
  SimulateOptions options;
  bool quiet = false, verbose = false, compress = false, force = false, json = false;
};

void declare(CommandLine& app, Arguments& arguments) {
  arguments.options.threads = 1;
  app.add_option("scene", arguments.scene, "Scene file (TOML; docs/reference/scene.md gives every key)");
  app.add_option("body", arguments.body,
                 "Body file, which rank 0 cuts, a slab for each rank; or a list of pieces (.pvtu), of which "
                 "each rank has its own where "
                 "docs/guide/mpi.md says so");
  app.add_option("-o,--output", arguments.output, "Deformed body (.vtu), in pieces (.pvtu) where it came so");
  app.add_option("--petsc", arguments.petsc, "Options of PETSc's, for example \"-ksp_view\"");
  app.add_option("--checkpoint", arguments.options.checkpoint,
                 "Write every load step that ends in equilibrium to this file, in place of the one before");
  app.add_option("--resume", arguments.resume,
                 "Go on from the load step in this file, of the same scene and body");
  add_threads_option(app, arguments.options.threads);
  app.add_option("--summary", arguments.summary,
                 "Write the summary as JSON to this file (docs/reference/summary.md)");
  app.add_flag("--json", arguments.json, "Print it to stdout");
  app.add_flag("--explain", arguments.options.explain,
               "Say which effects run and why, and the share of time of each");
  app.add_flag("!--no-stress", arguments.options.stress, "Leave out the stresses (docs/theory/stress.md)");
  app.add_flag(
      "!--no-estimate", arguments.options.estimate,
      "Leave out the error bars, and the two coarser runs that they come from (docs/theory/error-bars.md)");
  app.add_flag("--quiet", arguments.quiet, "Say nothing but warnings and errors");
  app.add_flag("--verbose", arguments.verbose, "Say all that was found");
  app.add_flag("--compress", arguments.compress, "Compress the arrays of the body file");
  app.add_flag("--force", arguments.force, "Let results replace files that are read");
}

void check_files(const Arguments& arguments) {
  if (arguments.scene.empty() || arguments.body.empty())
    throw InputError(
        "a scene and a body are needed, for example mpirun -n 4 flexel-simulate-mpi scene.toml "
        "body.vtu -o out.vtu; --help shows what is accepted");
  if (arguments.output.empty()) throw InputError("-o is needed, for example -o out.vtu");
  if (distributed::is_piece_list(arguments.body) != distributed::is_piece_list(arguments.output))
    throw InputError(arguments.output,
                     "pieces (.pvtu) come out as pieces, and a whole body (.vtu) as a whole one: give -o the "
                     "same ending as the body");
  for (const std::string& name : {arguments.scene, arguments.body, arguments.output})
    if (name == "-") throw InputError("\"-\": ranks have no stdin and stdout of their own; give files");
  check_outputs({{arguments.output, true},
                 {arguments.summary},
                 {arguments.json ? "-" : ""},
                 {arguments.options.failed_output}},
                {arguments.scene, arguments.body, arguments.resume}, arguments.force);
  check_outputs({{arguments.options.checkpoint}, {arguments.output}, {arguments.summary}},
                {arguments.scene, arguments.body}, arguments.force);
}

std::string failed_name(const std::string& output, const char* end = ".failed.vtu") {
  const std::string ending = extension(output);
  const bool known = ending == "vtu" || ending == "pvtu";
  return (known ? output.substr(0, output.size() - 1 - ending.size()) : output) + end;
}

void add_pieces(const PieceFiles& pieces, const std::string& list, std::vector<std::string>& names) {
  names.push_back(shared_surface_path(list));
  for (std::uint32_t p = 0; p < pieces.files.size(); ++p) names.push_back(piece_path(list, p));
}

// What is written before the first of it appears.
std::vector<std::string> names_of_results(const Arguments& arguments,
                                          const std::optional<PieceFiles>& pieces) {
  std::vector<std::string> names = {arguments.output, arguments.summary};
  if (pieces) add_pieces(*pieces, arguments.output, names);
  return names;
}

// Of a run of which no rank has the whole body.
std::string failed_list(const Arguments& arguments) {
  return failed_name(arguments.output, ".failed.pvtu");
}

// Pieces may go by another name than their list.
void check_pieces(const Arguments& arguments, const PieceFiles& pieces) {
  std::vector<OutputName> outputs = {{arguments.options.checkpoint}, {arguments.options.failed_output}};
  std::vector<std::string> names = names_of_results(arguments, pieces);
  names.push_back(failed_list(arguments));
  add_pieces(pieces, names.back(), names);
  for (const std::string& name : names) outputs.push_back({name});
  check_outputs(outputs, files_of(pieces), arguments.force);
}

LoadStepHooks hooks_of(const Arguments& arguments, const Scene& scene, const Body& body,
                       distributed::Leader& leader) {
  LoadStepHooks hooks;
  hooks.make_solver = [&](Mechanics& mechanics) { return leader.make_solver(mechanics); };
  std::string path = arguments.options.checkpoint;
  const auto file = std::make_shared<distributed::LoadStepFile>(scene, body);
  if (!arguments.resume.empty()) {
    hooks.begin = file->read(arguments.resume);
    if (path.empty()) path = arguments.resume;
  }
  if (!path.empty()) hooks.done = [file, path](const LoadStepDone& done) { file->write(done, path); };
  return hooks;
}

void explain_ranks(const distributed::Leader& leader, Progress& progress) {
  const std::vector<distributed::RankUse> uses = leader.uses();
  for (std::size_t r = 0; r < uses.size(); ++r)
    progress.say(fmt::format("rank {}: {} cells, {} at most", r,
                             human_count(static_cast<std::size_t>(uses[r].cells)),
                             human_bytes(uses[r].memory)));
}

// What is said of a result.
struct Told {
  std::string summary;  // empty: nobody asked
  std::vector<std::string> answer;
};

Told told_of(const Arguments& arguments, const SimulateResult& result, const Body& body,
             const std::vector<Material>& materials, const KeptWarnings& warnings, Progress& progress) {
  if (const std::string unused = distributed::Session::unused_options(); !unused.empty())
    progress.warn(fmt::format("--petsc: nothing asked for {}", unused));
  if (arguments.verbose || arguments.options.explain)
    for (const std::string& line : summary_lines(result)) progress.say(line);
  Told told{"", answer_lines(result, body, materials)};
  if (!arguments.summary.empty() || arguments.json)
    told.summary = summary_json(result, body, materials, warnings.lines());
  return told;
}

void end_with(const Told& told, const Arguments& arguments, Progress& progress) {
  progress.finish();
  for (const std::string& line : told.answer) progress.say(line);
  if (arguments.json) write_text(told.summary, "-");
}

// Whether each rank may have its own pieces and none the whole (docs/guide/mpi.md).
bool may_share(const Arguments& arguments, const std::optional<PieceFiles>& pieces) {
  const SimulateOptions& options = arguments.options;
  const auto ranks = static_cast<std::size_t>(distributed::ranks());
  return pieces && ranks > 1 && pieces->files.size() % ranks == 0 && options.checkpoint.empty() &&
         arguments.resume.empty();
}

// Where no rank has the whole body; false: one has to.
bool lead_shared(const Arguments& arguments, const PieceFiles& pieces, const Scene& scene,
                 distributed::Leader& leader, const KeptWarnings& warnings, Progress& progress) {
  distributed::SharedRequest request{pieces, arguments.output, failed_list(arguments), arguments.summary};
  request.stress = arguments.options.stress;
  request.estimate = arguments.options.estimate;
  request.compress = arguments.compress;
  request.threads = arguments.options.threads;
  Told told;
  const std::string why =
      leader.run(request, arguments.options, progress, [&](const SimulateResult& result, const Body& body) {
        told = told_of(arguments, result, body, known_materials(scene, body), warnings, progress);
        if (!arguments.summary.empty()) write_text(told.summary, arguments.summary);
      });
  if (!why.empty()) {
    if (arguments.verbose || arguments.options.explain) progress.say("rank 0 puts the body together: " + why);
    return false;
  }
  if (arguments.options.explain) explain_ranks(leader, progress);
  end_with(told, arguments, progress);
  return true;
}

// What rank 0 does.
void lead(Arguments& arguments, distributed::Leader& leader) {
  SimulateOptions& options = arguments.options;
  Progress progress(kProgram, arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  const KeptWarnings warnings;  // for the summary
  progress.stage("read");
  options.failed_output = arguments.output.empty() ? "" : failed_name(arguments.output);
  check_files(arguments);
  const Scene scene = read_scene(arguments.scene);
  distributed::refuse_unsupported(scene);
  std::optional<PieceFiles> pieces;
  if (distributed::is_piece_list(arguments.body)) pieces = read_piece_list(arguments.body);
  if (pieces) check_pieces(arguments, *pieces);
  leader.give(scene);
  if (may_share(arguments, pieces) && lead_shared(arguments, *pieces, scene, leader, warnings, progress))
    return;
  Body body = pieces ? join_pieces(*pieces) : read_body(arguments.body);
  erase_stress_columns(body);
  distributed::refuse_unsupported(scene, body);
  OutputsTogether outputs(names_of_results(arguments, pieces));
  options.hooks = std::make_shared<const LoadStepHooks>(hooks_of(arguments, scene, body, leader));
  options.checkpoint.clear();  // that of timed runs
  const SimulateResult result = simulate::simulate(body, scene, options, progress);
  options.hooks.reset();
  const std::vector<Material> materials = known_materials(scene, body);
  const Told told = told_of(arguments, result, body, materials, warnings, progress);
  if (options.explain) explain_ranks(leader, progress);
  progress.stage("write");
  BodyFileOptions file_options;
  file_options.compress = arguments.compress;
  if (pieces)
    distributed::write_in_pieces(body, *pieces, arguments.output, arguments.compress);
  else
    write_body(body, arguments.output, file_options);
  if (!arguments.summary.empty()) write_text(told.summary, arguments.summary);
  outputs.appear();
  end_with(told, arguments, progress);
}

// The others say nothing.
void close_stdout() {
  const int nowhere = ::open("/dev/null", O_WRONLY);
  if (nowhere < 0) return;
  std::fflush(stdout);
  ::dup2(nowhere, STDOUT_FILENO);
  ::close(nowhere);
}

int run(int argc, char** argv, distributed::Leader& leader) {
  CommandLine app(
      "Deforms a body as flexel-simulate does, on all ranks of an mpirun: equilibrium of model \"cells\".",
      kProgram);
  Arguments arguments;
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  distributed::Session::check_options(arguments.petsc);
  leader.give_threads(arguments.options.threads);
  lead(arguments, leader);
  return kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  const flexel::distributed::Session session(argc, argv);
  int code = 0;
  if (flexel::distributed::rank() == 0) {
    flexel::distributed::Leader leader;
    code = flexel::run_program(kProgram, [&] { return run(argc, argv, leader); });
    leader.end(code);
  } else {
    close_stdout();
    code = flexel::run_program(kProgram, [] { return flexel::distributed::follow(); });
  }
  // The others wait for this one in the middle of their work.
  if (flexel::distributed::together()) flexel::distributed::Session::abort(code);
  return code;
}
