// Frame after frame: a series is as long as the dump.
#include "flexel/lammps/import_command.h"

#include <fmt/format.h>

#include <optional>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/outputs.h"
#include "base/human.h"
#include "base/program/arguments.h"
#include "base/program/progress.h"
#include "base/program/termination.h"
#include "flexel/lammps/dump.h"
#include "flexel/lammps/imported.h"
#include "formats/exchange/body_name.h"
#include "formats/lattice/body_file.h"
#include "simulate/matter/stress.h"
#include "simulate/time/series.h"

namespace flexel::commands {
namespace {

struct ImportArguments {
  std::string dump, body, output;
  bool compress = false, quiet = false, force = false;
};

void declare_import(CommandLine& app, ImportArguments& arguments) {
  app.add_option("dump", arguments.dump, "What LAMMPS wrote (dump custom)").required().type_name("DUMP");
  app.add_option("body", arguments.body, "The body file (.vtu) that flexel export wrote beside the script")
      .required()
      .type_name("BODY");
  app.add_option("-o,--output", arguments.output,
                 "The last frame as a body file (.vtu; -: stdout), or all of them as a series (.pvd)")
      .type_name("FILE")
      .required();
  app.add_flag("--compress", arguments.compress, "Compress the arrays of the body files");
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
  app.add_flag("--force", arguments.force, "Let results replace files that are read");
}

Body read_start(const std::string& path) {
  Body body = read_body(path);
  if (body.parts.empty() || body.element_count() == 0) throw InputError(path, "the body has no elements");
  simulate::erase_stress_columns(body);  // of where it was
  return body;
}

// Of the first frame. Throws InputError: it is of another run.
std::vector<std::string> first_warnings(const lammps::DumpFrame& frame, const lammps::DumpReader& dump,
                                        const Body& body, const ImportArguments& arguments) {
  std::vector<std::string> warnings;
  const std::string unsure = lammps::unsure_origin(dump.run(), body, arguments.dump);
  if (!unsure.empty()) warnings.push_back(unsure);
  if (frame.step == 0)
    refuse_other_start(frame, body, arguments.dump);
  else if (dump.run().empty() || !unsure.empty())
    warnings.push_back(
        fmt::format("its first frame is of step {}, so whether it began as {} is cannot be told", frame.step,
                    arguments.body));
  if (frame.velocity.empty())
    warnings.push_back("has no vx vy vz: a run that goes on from its bodies begins at rest");
  return warnings;
}

}  // namespace

int import_lammps_command(int argc, char** argv) {
  ImportArguments arguments;
  CommandLine app{"Makes a body, or a series of bodies, of LAMMPS's dump of an exported run.",
                  "flexel import-lammps"};
  declare_import(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  check_outputs({{arguments.output, true}}, {arguments.dump, arguments.body}, arguments.force);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  progress.stage("read");
  if (const std::string line = body_name_warning(arguments.output); !line.empty()) progress.warn(line);
  Body body = read_start(arguments.body);
  lammps::DumpReader dump(arguments.dump, body.element_count());
  std::optional<simulate::Series> series;
  if (extension(arguments.output) == "pvd") series.emplace(arguments.output, arguments.compress);
  std::size_t frames = 0;
  std::optional<std::uint64_t> folded;  // the first step whose matter is inside out
  std::optional<double> time;
  while (const std::optional<lammps::DumpFrame> frame = dump.next()) {
    if (frames == 0)
      for (const std::string& each : first_warnings(*frame, dump, body, arguments))
        progress.warn(fmt::format("{}: {}", arguments.dump, each));
    if (series && (!frame->time || (time && !(*frame->time > *time))))
      throw InputError(arguments.dump, fmt::format("the frame of step {} {}", frame->step,
                                                   frame->time ? "is not later than the one before it"
                                                               : "has no time: dump_modify ID time yes"));
    take_frame(*frame, body);
    if (!folded && lammps::inside_out(body)) folded = frame->step;
    if (series) series->add(body, *frame->time);
    time = frame->time;
    ++frames;
    progress.update(0, counted(frames, "frame"));
  }
  if (frames == 0) throw InputError(arguments.dump, "holds no frame of a dump of LAMMPS");
  if (!series) write_body(body, arguments.output, {.compress = arguments.compress});
  progress.finish();
  progress.say(fmt::format("{} of {} elements{}", counted(frames, "frame"), body.element_count(),
                           time ? fmt::format(", the last at {:.6g} s", *time) : std::string()));
  if (folded)
    progress.warn(
        fmt::format("{}: matter is inside out from the frame of step {} on: LAMMPS goes on where "
                    "flexel-simulate stops, and what follows is not to be trusted",
                    arguments.dump, *folded));
  return kExitDone;
}

}  // namespace flexel::commands
