// Runs the three programs in order, then reads their summaries and the stage times in their logs
// ("flexel-map: write: 0.012 s").
#include "flexel/study/runs/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <regex>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/program/own_program.h"
#include "flexel/study/runs/history_csv.h"
#include "flexel/study/runs/scene_edit.h"
#include "formats/lattice/body_file.h"
#include "simulate/estimate/coarsen.h"

namespace flexel::study {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

struct Log {
  std::map<std::string, double> stages;  // s, by the program's own name of the stage
  std::string error;                     // without the program's name
};

Log read_log(const fs::path& path) {
  static const std::regex stage("[a-z-]+: ([a-z ]+): ([0-9.]+) s");
  Log log;
  log.error = error_in_log(path);
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::smatch found;
    if (std::regex_match(line, found, stage)) log.stages[found[1]] += std::stod(found[2]);
  }
  return log;
}

Json read_json(const fs::path& path) {
  std::ifstream in(path);
  return load_json(in);
}

constexpr double kThinWall = 2;  // cells

double length(const Json& vector) {
  return std::hypot(vector[0].get<double>(), vector[1].get<double>(), vector[2].get<double>());
}

// One run in the making.
class Run {
 public:
  Run(const Case& study, const Configuration& configuration, const RunOptions& options)
      : case_(study), wanted_(configuration), options_(options), folder_(options.folder) {}

  RunResult result() {
    for (const char* stage : kStages) result_.stages.push_back({stage, 0});
    try {
      if (!voxelize()) return std::move(result_);
      result_.given_up = options_.goes_on && !options_.goes_on(result_.size());
      if (!result_.given_up && simulate()) map();
    } catch (const Json::exception& error) {
      result_.failure = fmt::format("a summary cannot be read, is the disk full? {}", error.what());
    }
    return std::move(result_);
  }

 private:
  [[nodiscard]] std::string file(const char* name) const { return (folder_.path() / name).string(); }

  void add(const std::string& stage, double seconds) {
    for (Stage& each : result_.stages)
      if (each.name == stage) each.wall += std::max(0.0, seconds);
  }

  // Runs one of the programs; false when it failed.
  bool run(const std::string& program, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), own_program(program));
    if (wanted_.threads > 0)
      arguments.insert(arguments.end(), {"--threads", std::to_string(wanted_.threads)});
    ChildOptions options;
    options.log = file("log");
    options.deadline = options_.deadline;
    const ChildRun child = run_child(arguments, options);
    result_.wall += child.wall;
    result_.cpu += child.cpu;
    result_.memory = std::max(result_.memory, child.memory);
    result_.program_memory.at(programs_++) = child.memory;
    log_ = read_log(file("log"));
    double in_stages = 0;
    for (const auto& [stage, seconds] : log_.stages) in_stages += seconds;
    add("start", child.wall - in_stages);
    if (child.exit_code == 0) return true;
    result_.exit_code = child.exit_code;
    result_.out_of_time = child.out_of_time;
    result_.failure = child.out_of_time ? "stopped: out of time"
                      : !log_.error.empty()
                          ? program + ": " + log_.error
                          : fmt::format("{} ended with exit code {}", program, child.exit_code);
    return false;
  }

  bool voxelize() {
    std::vector<std::string> arguments = case_.parts;
    arguments.insert(arguments.end(), case_.voxelize_options.begin(), case_.voxelize_options.end());
    arguments.insert(arguments.end(), {"--size", fmt::format("{:.9g} m", wanted_.size), "--summary",
                                       file("voxelize.json"), "-o", file("rest.vtu")});
    // springs and paper need cubic cells
    if (wanted_.model == "springs" || wanted_.model == "paper")
      arguments.insert(arguments.end(), {"--align", "none"});
    if (wanted_.centre_placement()) arguments.insert(arguments.end(), {"--placement", "centre"});
    if (!run("flexel-voxelize", arguments)) return false;
    add("read", log_.stages["import"]);
    add("heal", log_.stages["heal"]);
    add("voxelize", log_.stages["voxelize"]);
    add("write", log_.stages["write"]);
    const Json found_parts = read_json(file("voxelize.json"));
    double samples = 0,
           thin = 0;  // places where walls were measured, and where they are thinner than two cells
    for (const Json& part : found_parts["parts"]) {
      PartFound found{part["name"], part["surface_volume"], std::nullopt};
      if (!part["thinnest_wall"].is_null()) found.thinnest_wall = part["thinnest_wall"]["thickness"];
      result_.parts.push_back(found);
      result_.elements += part["elements"].get<std::size_t>();
      result_.cells += part["cells"].get<std::size_t>();
      samples += part["wall_samples"].get<double>();
      thin += part["thin_walls"].get<double>();
    }
    // Where no wall is thin there is no need to look at the matter. Centre placement has no cells to ask.
    if (thin > 0)
      result_.thin_matter = result_.cells == 0
                                ? thin / samples
                                : simulate::share_of_thin_walls(read_body(file("rest.vtu")), kThinWall);
    return true;
  }

  bool simulate() {
    std::vector<std::string> names;
    for (const PartFound& part : result_.parts) names.push_back(part.name);
    const fs::path scene_folder = fs::absolute(case_.scene).parent_path();
    write_text(edited_scene(case_.scene_text, case_.scene, scene_folder, names, wanted_), file("scene.toml"));
    std::vector<std::string> arguments = {
        file("scene.toml"), file("rest.vtu"), "--summary", file("simulate.json"), "-o", file("bent.vtu")};
    if (!wanted_.error_bars) arguments.emplace_back("--no-estimate");
    if (!wanted_.stress) arguments.emplace_back("--no-stress");
    const bool timed = scene_facts(case_.scene_text, case_.scene).timed;
    const std::string history = options_.history.empty() ? file("history.csv") : options_.history.string();
    if (timed) arguments.insert(arguments.end(), {"--history", history});
    const bool done = run("flexel-simulate", arguments);
    // The scene was written by us: its name and lines say nothing to the user.
    static const std::regex own("[^ ]*/scene\\.toml(:[0-9]+)?");
    result_.failure = std::regex_replace(result_.failure, own, case_.scene);
    if (!done) return false;
    const Json found = read_json(file("simulate.json"));
    take_times(found);
    take_results(found);
    if (timed) take_history(history);
    return true;
  }

  void take_times(const Json& found) {
    double assemble = 0;
    for (const Json& pass : found["time"]) assemble += pass["seconds"].get<double>();
    assemble = std::min(assemble, log_.stages["simulate"]);
    add("read", log_.stages["read"]);
    add("assemble", assemble);
    add("solve", log_.stages["simulate"] - assemble);
    add("error bars", log_.stages["error bars"]);
    add("write", log_.stages["write"]);
  }

  void take_results(const Json& found) {
    const Json& spacing = found["parts"][0]["spacing"];
    result_.spacing =
        std::cbrt(spacing[0].get<double>() * spacing[1].get<double>() * spacing[2].get<double>());
    result_.elements = found["elements"];
    result_.cells = found["cells"];
    result_.simulate_seconds = found["seconds"];
    for (const Json& probe : found["probes"])
      result_.quantities.push_back({probe["name"], "m", length(probe["displacement"])});
    result_.quantities.push_back({"largest displacement", "m", found["largest_displacement"]});
    result_.quantities.push_back({"elastic energy", "J", found["elastic_energy"]});
    for (const Json& reaction : found["reactions"])
      result_.quantities.push_back(
          {"reaction " + reaction["name"].get<std::string>(), "N", length(reaction["force"])});
    if (found.contains("timed")) {
      result_.steps = found["timed"]["steps"];
      result_.step = found["timed"]["step"];
      const Json books = found["timed"].value("books", Json::object());
      if (books.value("largest_term", 0.0) > 0)
        result_.energy_drift = books["worst_residual"].get<double>() / books["largest_term"].get<double>();
    } else {
      result_.newton_iterations = found["newton_iterations"];
      result_.cg_iterations = found["cg_iterations"];
    }
  }

  // The largest that each probe moved over the run: the end alone is a matter of the phase.
  void take_history(const std::string& path) {
    const History history = read_history(path);
    for (const std::string& probe : scene_facts(case_.scene_text, case_.scene).probes) {
      if (const std::optional<double> most = peak(probe_motion(history, probe)))
        result_.quantities.push_back({probe + " peak", "m", *most});
    }
  }

  void map() {
    const std::string surface = options_.surface.empty() ? file("surface.ply") : options_.surface.string();
    if (!run("flexel-map", {file("bent.vtu"), "--method", wanted_.method, "--unit", "mm", "--report",
                            file("map.json"), "-o", surface}))
      return;
    add("read", log_.stages["read"]);
    add("map", log_.stages["map"]);
    add("write", log_.stages["write"]);
    const Json found = read_json(file("map.json"));
    result_.area = found["area_before"];
    if (!found["volume_after"].is_null())
      result_.quantities.push_back({"volume", "m3", found["volume_after"]});
    if (!options_.body.empty()) std::filesystem::rename(file("bent.vtu"), options_.body);
  }

  const Case& case_;
  const Configuration& wanted_;
  const RunOptions& options_;
  const TemporaryFolder folder_;
  Log log_;
  std::size_t programs_ = 0;  // that have run
  RunResult result_;
};

}  // namespace

const Quantity* RunResult::find(const std::string& name) const {
  const auto found =
      std::find_if(quantities.begin(), quantities.end(), [&](const Quantity& q) { return q.name == name; });
  return found == quantities.end() ? nullptr : &*found;
}

double RunResult::element_steps_per_second() const {
  return simulate_seconds > 0 ? static_cast<double>(elements) * static_cast<double>(steps) / simulate_seconds
                              : 0;
}

std::string error_in_log(const fs::path& log) {
  static const std::string mark = ": error: ";
  std::ifstream in(log);
  std::string found;
  for (std::string line; std::getline(in, line);)
    if (const std::size_t at = line.find(mark); at != std::string::npos)
      found = line.substr(at + mark.size());
  return found;
}

RunResult run_configuration(const Case& study, const Configuration& configuration,
                            const RunOptions& options) {
  return Run(study, configuration, options).result();
}

}  // namespace flexel::study
