// flexel study: what accuracy costs in time, for a part and a scene (docs/study.md).
#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "flexel/commands.h"
#include "flexel/study/session.h"
#include "formats/files.h"
#include "formats/program.h"
#include "formats/progress.h"
#include "formats/termination.h"
#include "formats/units.h"
#include "simulate/scene.h"
#include "simulate/simulate.h"

namespace flexel {
namespace {

namespace fs = std::filesystem;

struct StudyArguments {
  std::vector<std::string> parts, references;
  std::string scene, budget = "2 min", output, against, material, unit, heal, edge;
  bool quiet = false;
};

void declare(CLI::App& app, StudyArguments& a) {
  app.add_option("part", a.parts, "STEP, IGES, BREP, STL, OBJ, PLY, OFF, glTF or 3MF files")
      ->required()
      ->type_name("PART");
  app.add_option("--scene", a.scene, "Scene file (TOML; docs/scene.md)")->required()->type_name("FILE");
  app.add_option("-o,--output", a.output, "Folder for study.csv, study.json and study.html")
      ->required()
      ->type_name("FOLDER");
  app.add_option("--budget", a.budget, "What all runs together may take (\"5 min\")")
      ->type_name("TIME")
      ->capture_default_str();
  app.add_option("--reference", a.references,
                 "The true value of a probe or of \"largest displacement\" (\"tip=5.21 mm\"), or the summary "
                 "(JSON) of another run of flexel-simulate; without it the finest runs are extrapolated")
      ->type_name("NAME=VALUE|FILE")
      ->allow_extra_args(false);
  app.add_option("--against", a.against,
                 "calculix: run CalculiX (ccx) on the same scene too, on meshes by gmsh, and draw it beside")
      ->type_name("PROGRAM");
  app.add_option("--material", a.material, "What the parts are made of, where the scene does not say")
      ->type_name("NAME");
  app.add_option("--unit", a.unit, "Unit of files that carry none (default mm)")->type_name("UNIT");
  app.add_option("--heal", a.heal, "Broken surfaces: auto, wrap or none (docs/healing.md)")->type_name("HOW");
  app.add_option("--edge", a.edge, "STEP: longest edge of the mesh")->type_name("LENGTH");
  app.add_flag("--quiet", a.quiet, "Say only warnings and errors");
}

study::Reference given(const std::string& name, const std::string& unit, double value) {
  study::Reference reference;
  reference.name = name;
  reference.unit = unit;
  reference.value = value;
  reference.from = "given";
  return reference;
}

// "tip=5.21 mm", or all that a summary holds.
void add_references(const std::string& text, const study::SceneFacts& facts,
                    std::vector<study::Reference>& references) {
  const std::string ending = facts.timed ? " peak" : "";
  if (const std::size_t equals = text.find('='); equals != std::string::npos) {
    const std::string name = text.substr(0, equals);
    std::vector<std::string> known = facts.probes;
    known.emplace_back("largest displacement");
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw InputError(fmt::format("--reference: the scene has no probe \"{}\"; known: {}{}", name,
                                   fmt::join(known, ", "), did_you_mean(name, known)));
    const double value = parse_quantity(text.substr(equals + 1), Dimension::length);
    references.push_back(given(name == known.back() ? name : name + ending, "m", value));
    return;
  }
  const Bytes bytes = read_all(text);
  const auto json =
      nlohmann::json::parse(reinterpret_cast<const char*>(bytes.data()),
                            reinterpret_cast<const char*>(bytes.data()) + bytes.size(), nullptr, false);
  if (!json.is_object() || !json.contains("probes") || !json.contains("largest_displacement") ||
      !json.contains("elastic_energy"))
    throw InputError(text, "this is no summary of flexel-simulate (--summary); or write NAME=VALUE");
  if (facts.timed)
    throw InputError(text,
                     "a summary holds the end of a timed run only; give the most that a probe moves, "
                     "NAME=VALUE");
  for (const auto& probe : json["probes"]) {
    const auto& u = probe["displacement"];
    references.push_back(
        given(probe["name"], "m", std::hypot(u[0].get<double>(), u[1].get<double>(), u[2].get<double>())));
  }
  references.push_back(given("largest displacement", "m", json["largest_displacement"]));
  references.push_back(given("elastic energy", "J", json["elastic_energy"]));
}

study::Assignment assignment(const StudyArguments& a) {
  study::Assignment result;
  if (std::count(a.parts.begin(), a.parts.end(), "-") > 0 || a.scene == "-")
    throw InputError("flexel study runs the part and the scene many times: give files, not stdin");
  for (const std::string& part : a.parts) {
    if (!fs::is_regular_file(part)) throw InputError(part, "no such file");
    result.study_case.parts.push_back(fs::absolute(part).string());
    result.part_names.push_back(fs::path(part).filename().string());
  }
  const Scene scene = read_scene(a.scene);  // all that is wrong with it is said now
  result.study_case.scene = a.scene;
  result.study_case.scene_text = scene.text;
  const auto pass = [&](const char* option, const std::string& value) {
    if (value.empty()) return;
    result.study_case.voxelize_options.emplace_back(option);
    result.study_case.voxelize_options.push_back(value);
  };
  pass("--material", a.material);
  pass("--unit", a.unit);
  pass("--heal", a.heal);
  pass("--edge", a.edge);
  if (!a.against.empty() && a.against != "calculix")
    throw InputError(fmt::format("--against: no \"{}\"{}; known: calculix", a.against,
                                 did_you_mean(a.against, {"calculix"})));
  result.against_calculix = !a.against.empty();
  result.budget = parse_timeout(a.budget, "--budget");
  const study::SceneFacts facts = study::scene_facts(scene.text, a.scene);
  for (const std::string& text : a.references) add_references(text, facts, result.references);
  if (fs::exists(a.output) && !fs::is_directory(a.output))
    throw InputError(a.output, "is a file; -o names the folder of the study");
  std::error_code error;
  fs::create_directories(a.output, error);
  if (error) throw InputError(a.output, "cannot be made: " + error.message());
  result.output = a.output;
  return result;
}

}  // namespace

int study_command(int argc, char** argv) {
  StudyArguments arguments;
  CLI::App app{
      "Runs a part and a scene at many sizes and with many choices, and writes what each costs and how exact "
      "it is: study.csv, study.json and the page study.html (docs/study.md).",
      "flexel study"};
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const study::Assignment wanted = assignment(arguments);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  const TerminationWaits waits;  // the folder of its runs is removed
  study::Session session(wanted, progress);
  session.run();
  return session.interrupted() ? kExitInterrupted : kExitDone;
}

}  // namespace flexel
