// The program flexel: `flexel COMMAND ...`.
#include <fmt/format.h>

#include <string>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/nearest_word.h"
#include "base/program/program.h"
#include "base/version.h"
#include "flexel/commands.h"
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
    "  flexel compare PART PART... --scene FILE\n"
    "                        which is stiffer: mass, displacement, stiffness and stress in one table\n"
    "  flexel export PART... --scene FILE --calculix -o OUT.inp\n"
    "                        mesh, sets, material, supports and loads for detailed analysis by CalculiX\n"
    "  flexel info PART...   solids, faces, unit, size, volume, closedness, thinnest wall: what a scene can "
    "name\n"
    "  flexel picture FILE... -o OUT.png\n"
    "                        a picture of parts and bodies, deformed and coloured, without a display\n"
    "  flexel view FILE...   parts, bodies and series in the browser; --html OUT.html writes the page\n"
    "  flexel materials      the materials that --material and scenes know, with their sources\n"
    "  flexel scene-keys     the keys of scenes: where each may stand, what it takes, its default\n"
    "  flexel measure --model NAME --size LENGTH\n"
    "                        what the lattice makes of a material: E, nu and G by direction and resolution\n"
    "  flexel study PART... --scene FILE -o FOLDER\n"
    "                        what accuracy costs in time: a page with plots and the size to use\n"
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

bool is_stage(const std::string& command) {
  return command == "voxelize" || command == "simulate" || command == "map";
}

[[noreturn]] void unknown_command(const std::string& command) {
  const std::vector<std::string> commands = {"deform",   "compare",   "export",     "info",    "picture",
                                             "view",     "materials", "scene-keys", "measure", "study",
                                             "voxelize", "simulate",  "map",        "help"};
  throw InputError(fmt::format("unknown command \"{}\"; the commands are {}{}", command,
                               fmt::join(commands, ", "), did_you_mean(command, commands)));
}

int help(int argc, char** argv) {
  if (argc < 2) {
    print(help_text());
    return kExitDone;
  }
  std::string option = "--help";
  char* arguments[] = {argv[1], option.data(), nullptr};
  const std::string command = argv[1];
  if (command == "deform") return deform_command(2, arguments);
  if (command == "compare") return compare_command(2, arguments);
  if (command == "export") return export_command(2, arguments);
  if (command == "materials") return materials_command(2, arguments);
  if (command == "scene-keys") return scene_keys_command(2, arguments);
  if (command == "measure") return measure_command(2, arguments);
  if (command == "study") return study_command(2, arguments);
  if (command == "info") return info_command(2, arguments);
  if (command == "picture") return picture_command(2, arguments);
  if (command == "view") return view_command(2, arguments);
  if (is_stage(command)) run_stage_program(argv[1], arguments);
  unknown_command(command);
}

int run(int argc, char** argv) {
  if (argc < 2)
    throw InputError(
        "a command is missing: deform, compare, export, info, picture, view, materials, scene-keys, measure, "
        "study, voxelize, simulate or map (`flexel help`)");
  const std::string command = argv[1];
  if (command == "--version") {
    print(fmt::format("flexel {}\n", version()));
    return kExitDone;
  }
  if (command == "help" || command == "--help" || command == "-h") return help(argc - 1, argv + 1);
  if (command == "deform") return deform_command(argc - 1, argv + 1);
  if (command == "compare") return compare_command(argc - 1, argv + 1);
  if (command == "materials") return materials_command(argc - 1, argv + 1);
  if (command == "scene-keys") return scene_keys_command(argc - 1, argv + 1);
  if (command == "measure") return measure_command(argc - 1, argv + 1);
  if (command == "export") return export_command(argc - 1, argv + 1);
  if (command == "study") return study_command(argc - 1, argv + 1);
  if (command == "info") return info_command(argc - 1, argv + 1);
  if (command == "picture") return picture_command(argc - 1, argv + 1);
  if (command == "view") return view_command(argc - 1, argv + 1);
  if (is_stage(command)) run_stage_program(argv[1], argv + 1);
  unknown_command(command);
}

}  // namespace
}  // namespace flexel::commands

int main(int argc, char** argv) {
  return flexel::run_program("flexel", [&] { return flexel::commands::run(argc, argv); });
}
