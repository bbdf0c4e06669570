// flexel study: what accuracy costs in time, for a part and a scene (docs/guide/study.md).
#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/nearest_word.h"
#include "base/program/arguments.h"
#include "base/program/progress.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "flexel/job.h"
#include "flexel/scene_text.h"
#include "flexel/study/runs/scene_edit.h"
#include "flexel/study/session.h"
#include "formats/common/file_formats.h"
#include "simulate/effects/gravity.h"
#include "simulate/quadratic/quadratic_run.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "voxelize/measure_part.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

namespace fs = std::filesystem;

struct StudyArguments {
  JobArguments job;  // parts, and what happens to them
  std::vector<std::string> references;
  std::string budget = "2 min", output, against, heal;
  bool quiet = false, json = false;
};

void declare(CommandLine& app, StudyArguments& a) {
  app.add_option("part", a.job.parts, read_titles() + " files").required().type_name("PART");
  declare_scene(app, a.job);
  app.add_option("-o,--output", a.output, "Folder for study.csv, study.json, study.html and finest.html")
      .required()
      .type_name("FOLDER");
  app.add_option("--budget", a.budget, "What all runs together may take (\"5 min\")")
      .type_name("TIME")
      .show_default();
  app.add_option("--reference", a.references,
                 "The true value of a probe or of \"largest displacement\" (\"tip=5.21 mm\"), or the summary "
                 "(JSON) of another run of flexel-simulate; without it the finest runs are extrapolated")
      .type_name("NAME=VALUE|FILE")
      .one_value_each();
  app.add_option("--against", a.against,
                 "calculix: run CalculiX (ccx) on the same scene too, on meshes by gmsh, and draw it beside")
      .type_name("PROGRAM");
  app.add_option("--unit", a.job.unit, "Unit of files that carry none (default mm)").type_name("UNIT");
  app.add_option("--heal", a.heal, "Broken surfaces: auto, wrap or none (docs/reference/healing.md)")
      .type_name("HOW");
  app.add_option("--edge", a.job.edge, "Split the mesh to this longest edge").type_name("LENGTH");
  app.add_flag("--json", a.json, "Print study.json to stdout too (docs/reference/json.md)");
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
  const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto json = parse_json(content);
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

// What options ask for, as text around that of the scene's file, and the facts of both together.
std::string whole_scene(const JobArguments& given, const simulate::Scene& file) {
  Job added;
  added.scene.materials = file.materials;  // for their names
  add_options(given, added);
  const auto refuse_both = [&](bool both, const char* option, const std::string& key) {
    if (both) throw InputError(given.scene, fmt::format("has {} already: leave {} out", key, option));
  };
  refuse_both(!file.material.empty() && !added.scene.material.empty(), "--material", "material");
  refuse_both(!file.model.empty() && !added.scene.model.empty(), "--model", "model");
  refuse_both(file.infill.share && added.scene.infill.share, "--infill", "infill");
  refuse_both(file.get<simulate::Gravity>().acceleration && added.scene.get<simulate::Gravity>().acceleration,
              "--gravity", "[gravity] acceleration");
  for (const auto& [name, part] : added.scene.parts)
    refuse_both(file.parts.count(name) > 0, part.origin.c_str(), fmt::format("[parts.\"{}\"]", name));
  if (added.acts_along_faces()) {
    ImportOptions import;
    if (!given.unit.empty()) import.unit = length_unit(given.unit);
    Progress silent("", Progress::Mode::silent);
    Body body;
    body.surface = read_parts(given.parts, import, silent);
    (void)voxelize::heal_and_measure(body.surface);  // outward, as every run of the study has it
    body.parts.resize(body.surface.parts.size());
    for (std::size_t p = 0; p < body.parts.size(); ++p) body.parts[p].name = body.surface.parts[p].name;
    add_actions(added, body);
  }
  const SceneText text = scene_text(added.scene);
  return text.keys + file.text + text.tables;
}

void make_folder(const std::string& output) {
  if (fs::exists(output) && !fs::is_directory(output))
    throw InputError(output, "is a file; -o names the folder of the study");
  std::error_code error;
  fs::create_directories(output, error);
  if (error) throw InputError(output, "cannot be made: " + error.message());
}

// The scene's file, or, where options add to it or stand for it, one to be written in the study's folder.
void read_scenes(const StudyArguments& a, study::Case& study_case) {
  const simulate::Scene file = a.job.scene.empty() ? simulate::Scene{} : simulate::read_scene(a.job.scene);
  if (a.job.scene.empty()) refuse_idle(a.job);
  refuse_modes(file);
  if (a.job.model == "quadratic" || simulate::asks_for_quadratic(file))
    throw InputError(
        "flexel study does not run model \"quadratic\": compare sizes with flexel deform --model quadratic "
        "--size, whose error bars say what a finer one would change");
  study_case.scene = a.job.scene;
  study_case.scene_text = whole_scene(a.job, file);
  if (study_case.scene_text == file.text) return;
  study_case.scene = (fs::path(a.output) / study::kOwnScene).string();
  std::error_code none;
  if (fs::equivalent(a.job.scene, study_case.scene, none))
    throw InputError(a.job.scene, "is where the study writes its own scene: use another name");
  const fs::path folder = a.job.scene.empty() ? fs::current_path() : fs::absolute(a.job.scene).parent_path();
  study_case.scene_text = study::edited_scene(study_case.scene_text, study_case.scene, folder, {}, {});
  (void)simulate::parse_scene(study_case.scene_text,
                              study_case.scene);  // all that is wrong with it is said now
}

study::Assignment assignment(const StudyArguments& a) {
  study::Assignment result;
  const JobArguments& job = a.job;
  if (std::count(job.parts.begin(), job.parts.end(), "-") > 0 || job.scene == "-")
    throw InputError("flexel study runs the part and the scene many times: give files, not stdin");
  for (const std::string& part : job.parts) {
    if (!fs::is_regular_file(part)) throw InputError(part, "no such file");
    result.study_case.parts.push_back(fs::absolute(part).string());
    result.part_names.push_back(fs::path(part).filename().string());
  }
  plan_after_files(job, [&] { read_scenes(a, result.study_case); });
  const auto pass = [&](const char* option, const std::string& value) {
    if (value.empty()) return;
    result.study_case.voxelize_options.emplace_back(option);
    result.study_case.voxelize_options.push_back(value);
  };
  pass("--unit", job.unit);
  pass("--heal", a.heal);
  pass("--edge", job.edge);
  if (!a.against.empty() && a.against != "calculix")
    throw InputError(fmt::format("--against: no \"{}\"{}; known: calculix", a.against,
                                 did_you_mean(a.against, {"calculix"})));
  result.against_calculix = !a.against.empty();
  result.budget = simulate::parse_timeout(a.budget, "--budget");
  const study::SceneFacts facts = study::scene_facts(result.study_case.scene_text, result.study_case.scene);
  for (const std::string& text : a.references) add_references(text, facts, result.references);
  make_folder(a.output);
  result.writes_scene = result.study_case.scene != job.scene;
  result.output = a.output;
  return result;
}

}  // namespace

int study_command(int argc, char** argv) {
  StudyArguments arguments;
  CommandLine app{
      "Runs a part and a scene at many sizes and with many choices, and writes what each costs and how exact "
      "it is: study.csv, study.json and the page study.html (docs/guide/study.md).",
      "flexel study"};
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const study::Assignment wanted = assignment(arguments);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  const TerminationWaits waits;  // the folder of its runs is removed
  study::Session session(wanted, progress);
  session.run();
  if (arguments.json) {
    const Bytes written = read_all((fs::path(arguments.output) / "study.json").string());
    write_text({reinterpret_cast<const char*>(written.data()), written.size()}, "-");
  }
  return session.interrupted() ? kExitInterrupted : kExitDone;
}

}  // namespace flexel::commands
