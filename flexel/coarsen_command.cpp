// flexel coarsen: the same body on a lattice of twice the spacing.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files/outputs.h"
#include "base/program/arguments.h"
#include "base/program/progress.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "formats/lattice/body_file.h"
#include "simulate/estimate/coarsen.h"
#include "simulate/paper/merged_elements.h"

namespace flexel::commands {
namespace {

constexpr int kMostTimes = 10;

// Of cells, at rest.
Body coarser_cells(const Body& body) {
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    if (body.position[e] != body.rest[e])
      throw InputError(
          "the body is deformed: a lattice of cells is coarsened at rest (model \"paper\" keeps its state)");
  if (body.element_columns.contains("velocity"))
    throw InputError(
        "the body moves: a lattice of cells is coarsened at rest (model \"paper\" keeps its state)");
  if (body.element_columns.contains("temperature"))
    throw InputError("the body has temperatures, which a coarser one would lose: coarsen it before the run");
  for (const char* note : {"carved", "stuck"})
    if (body.notes.contains(note))
      throw InputError(fmt::format(
          "the body's note \"{}\" names places of its lattice, which a coarser one does not have", note));
  Body coarse = simulate::coarsened(body);
  coarse.surface = body.surface;
  coarse.notes = body.notes;
  return coarse;
}

Body coarser_body(const Body& body, const std::string& path) {
  try {
    return body.parts.front().placement == Placement::centre ? simulate::merged_elements(body)
                                                             : coarser_cells(body);
  } catch (const InputError& error) {
    throw InputError(path, error.what());
  }
}

std::string elements_of(const Body& body) {
  return fmt::format("{} elements of {}", body.element_count(),
                     human_length(body.parts.front().lattice.spacing.mean()));
}

}  // namespace

int coarsen_command(int argc, char** argv) {
  CommandLine app{
      "Writes a body on a lattice of twice the spacing. Of model \"paper\" (centre placement) each 2 x 2 x 2 "
      "elements become "
      "one, with the sum of their masses, moved and moving as they are; a lattice of cells is "
      "coarsened at rest.",
      "flexel coarsen"};
  std::string input = "-", output = "-";
  int times = 1;
  bool compress = false, quiet = false, force = false;
  app.add_option("body", input, "body file (.vtu); - or none: standard input");
  app.add_option("--times", times, "how often, each time from what the last one left");
  app.add_flag("--compress", compress, "compress the arrays of the body file");
  app.add_flag("--quiet", quiet, "say warnings only");
  app.add_flag("--force", force, "let results replace files that are read");
  app.add_option("-o,--output", output, "body file (.vtu); - or none: standard output");
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  if (times < 1 || times > kMostTimes)
    throw InputError(fmt::format("--times: a whole number from 1 to {}", kMostTimes));
  check_outputs({{output, true}}, {input}, force);
  Progress progress("flexel", quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  progress.stage("read");
  Body body = read_body(input);
  if (body.parts.empty() || body.element_count() == 0)
    throw InputError(input == "-" ? "stdin" : input, "the body has no elements");
  const std::string before = elements_of(body);
  progress.stage("coarsen");
  double done = 0;
  for (int n = 0; n < times; ++n) {
    body = coarser_body(body, input == "-" ? "stdin" : input);
    done += (1 - done) * 7 / 8;  // an eighth of the elements is left for the next
    progress.update(done);
  }
  progress.say(fmt::format("{} became {}", before, elements_of(body)));
  progress.stage("write");
  write_body(body, output, {.compress = compress});
  progress.finish();
  return kExitDone;
}

}  // namespace flexel::commands
