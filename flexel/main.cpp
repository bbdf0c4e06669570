// The program flexel: `flexel COMMAND ...`.
#include <fmt/format.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <iterator>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/nearest_word.h"
#include "base/program/program.h"
#include "base/version.h"
#include "flexel/commands.h"
#include "flexel/lammps/import_command.h"
#include "formats/common/file_formats.h"

namespace flexel::commands {
namespace {

constexpr const char* kHelp =
    "flexel deforms CAD parts.\n"
    "\n"
    "  flexel deform PART... --fix WHERE --push \"WHERE: 0 0 -50 N\" --material NAME -o OUT\n"
    "                        the part, deformed as its material would be ({}; .vtu for "
    "the body,\n"
    "                        .png for a picture)\n"
    "  flexel flex PART --bend \"90 deg\" --material NAME -o OUT\n"
    "                        bent to an arc of this angle, or twisted (--twist), as its material would be\n"
    "  flexel compensate PART... --scene FILE -o OUT\n"
    "                        the part to be made so that the scene bends it into the shape of PART\n"
    "  flexel compare PART PART... --scene FILE\n"
    "                        which is stiffer: mass, displacement, stiffness and stress in one table\n"
    "  flexel export PART... --scene FILE --calculix -o OUT.inp\n"
    "                        mesh, sets, material, supports and loads for detailed analysis by CalculiX\n"
    "  flexel export PART... --scene FILE --lammps -o OUT.in\n"
    "                        elements as atoms and springs as bonds, for a timed run by LAMMPS\n"
    "  flexel import-lammps DUMP BODY -o OUT\n"
    "                        what LAMMPS made of it, as a body (.vtu) or a series (.pvd)\n"
    "  flexel info PART...   solids, faces, unit, size, volume, closedness, thinnest wall: what a scene can "
    "name\n"
    "  flexel picture FILE... -o OUT.png\n"
    "                        a picture of parts and bodies, deformed and coloured, without a display\n"
    "  flexel view FILE...   parts, bodies and series in the browser; --html OUT.html writes the page\n"
    "  flexel clay PART      pull at a part in the browser, and save it bent\n"
    "  flexel materials      the materials that --material and scenes know, with their sources\n"
    "  flexel scene-keys     the keys of scenes: where each may stand, what it takes, its default\n"
    "  flexel measure --model NAME --size LENGTH\n"
    "                        what the lattice makes of a material: E, nu and G by direction and resolution\n"
    "  flexel coarsen BODY -o OUT.vtu\n"
    "                        the same body with each 2 x 2 x 2 elements as one\n"
    "  flexel study PART... --scene FILE -o FOLDER\n"
    "                        what accuracy costs in time: a page with plots and the size to use\n"
    "  flexel doctor         what is installed, and a short run whose answer is known\n"
    "  flexel voxelize ...   part -> lattice of elements      (the program flexel-voxelize)\n"
    "  flexel simulate ...   lattice + scene -> deformed      (flexel-simulate)\n"
    "  flexel map ...        deformed lattice -> the part     (flexel-map)\n"
    "\n"
    "`flexel COMMAND --help` lists the options of a command; `flexel --version` prints the version.\n";

std::string help_text() {
  return fmt::format(kHelp, written_titles([](const FileFormat&) { return true; }, "or"));
}

void print(const std::string& text) {
  OutputFile out("-", false);
  out.write(text);
  out.commit();
}

// The commands that this program runs itself; `help` and the stage programs beside them.
struct Command {
  const char* name;
  int (*run)(int argc, char** argv);
};
constexpr Command kCommands[] = {{"deform", deform_command},
                                 {"compare", compare_command},
                                 {"compensate", compensate_command},
                                 {"export", export_command},
                                 {"import-lammps", import_lammps_command},
                                 {"flex", flex_command},
                                 {"info", info_command},
                                 {"picture", picture_command},
                                 {"view", view_command},
                                 {"clay", clay_command},
                                 {"materials", materials_command},
                                 {"scene-keys", scene_keys_command},
                                 {"measure", measure_command},
                                 {"coarsen", coarsen_command},
                                 {"study", study_command},
                                 {"doctor", doctor_command}};
constexpr const char* kStages[] = {"voxelize", "simulate", "map"};

std::vector<std::string> command_names() {
  std::vector<std::string> names;
  for (const Command& command : kCommands) names.emplace_back(command.name);
  names.insert(names.end(), std::begin(kStages), std::end(kStages));
  return names;
}

// Runs the command argv[0].
int run_command(int argc, char** argv) {
  const std::string name = argv[0];
  for (const Command& command : kCommands)
    if (name == command.name) return command.run(argc, argv);
  for (const char* stage : kStages)
    if (name == stage) run_stage_program(stage, argv);
  std::vector<std::string> names = command_names();
  names.emplace_back("help");
  throw InputError(fmt::format("unknown command \"{}\"; the commands are {}{}", name, fmt::join(names, ", "),
                               did_you_mean(name, names)));
}

int help(int argc, char** argv) {
  if (argc < 2) {
    print(help_text());
    return kExitDone;
  }
  std::string option = "--help";
  char* arguments[] = {argv[1], option.data(), nullptr};
  return run_command(2, arguments);
}

int run(int argc, char** argv) {
  if (argc < 2) {
    const std::vector<std::string> names = command_names();
    throw InputError(fmt::format("a command is missing: {} or {} (`flexel help`)",
                                 fmt::join(names.begin(), names.end() - 1, ", "), names.back()));
  }
  const std::string command = argv[1];
  if (command == "--version") {
    print(fmt::format("flexel {}\n", version()));
    return kExitDone;
  }
  if (command == "--describe-arguments") {  // as every command does with its own (base/program/arguments.h)
    for (const std::string& name : command_names()) print(fmt::format("subcommand\t{}\n", name));
    return kExitDone;
  }
  if (command == "help" || command == "--help" || command == "-h") return help(argc - 1, argv + 1);
  return run_command(argc - 1, argv + 1);
}

}  // namespace
}  // namespace flexel::commands

int main(int argc, char** argv) {
#ifdef __GLIBC__
  // Blocks above this go back to the system when they are freed. The library would raise its bound to 32 MB as
  // it meets such, and the matrices of one Newton step would leave holes that those of the next do not fit.
  mallopt(M_MMAP_THRESHOLD, 16 * 1024 * 1024);
#endif
  return flexel::run_program("flexel", [&] { return flexel::commands::run(argc, argv); });
}
