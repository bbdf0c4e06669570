// Results of CalculiX are read from its .frd (block "DISP", displacements of every node: lines of " -1", the
// node in 10 characters and three values of 12 each) and its .dat (total forces of the supports).
#include "flexel/study/runs/calculix.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "base/error.h"
#include "base/files/json.h"
#include "base/program/own_program.h"

namespace flexel::study {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr double kMillimetre = 1e-3;
constexpr int kFirstLook = 2000;

// Node -> m, of the last step that was written.
std::map<long, Vec3> displacements(const fs::path& frd) {
  std::map<long, Vec3> found;
  std::ifstream in(frd);
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(" -4  DISP", 0) == 0) {
      inside = true;
      found.clear();
    } else if (line.rfind(" -3", 0) == 0) {
      inside = false;
    } else if (inside && line.rfind(" -1", 0) == 0 && line.size() >= 49) {
      Vec3 moved;
      for (std::size_t axis = 0; axis < 3; ++axis)
        moved[static_cast<Eigen::Index>(axis)] =
            kMillimetre * std::strtod(line.substr(13 + 12 * axis, 12).c_str(), nullptr);
      found[std::strtol(line.substr(3, 10).c_str(), nullptr, 10)] = moved;
    }
  }
  return found;
}

// Of each set the total force [N]: "total force (fx,fy,fz) for set NAME ...", an empty line, three numbers.
std::map<std::string, Vec3> total_forces(const fs::path& dat) {
  std::map<std::string, Vec3> found;
  std::ifstream in(dat);
  std::string set;
  for (std::string line; std::getline(in, line);) {
    if (line.find("total force") != std::string::npos) {
      const std::size_t name = line.find("for set ");
      set.clear();
      if (name != std::string::npos) std::istringstream(line.substr(name + 8)) >> set;
      continue;
    }
    std::istringstream words(line);
    Vec3 force;
    if (!set.empty() && words >> force.x() >> force.y() >> force.z()) {
      found[set] = force;
      set.clear();
    }
  }
  return found;
}

// What ccx itself calls an error, on one line.
std::string ccx_error(const fs::path& log) {
  std::ifstream in(log);
  std::string found;
  for (std::string line; std::getline(in, line);)
    if (line.find("*ERROR") != std::string::npos) found = line.substr(line.find("*ERROR"));
  return found.substr(0, 200);
}

void take_results(const Json& summary, const fs::path& job, RunResult& result) {
  const std::map<long, Vec3> moved = displacements(job.string() + ".frd");
  const bool numbers =
      std::all_of(moved.begin(), moved.end(), [](const auto& m) { return m.second.allFinite(); });
  if (moved.empty() || !numbers) {
    result.failure = "ccx wrote no displacements that can be used";
    return;
  }
  for (const Json& probe : summary["probes"]) {
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = 0; i < probe["nodes"].size(); ++i)
      if (const auto at = moved.find(probe["nodes"][i].get<long>()); at != moved.end())
        mean += probe["weights"][i].get<double>() * at->second;
    result.quantities.push_back({probe["name"], "m", mean.norm()});
  }
  double largest = 0;
  for (const auto& [node, each] : moved) largest = std::max(largest, each.norm());
  result.quantities.push_back({"largest displacement", "m", largest});
  const std::map<std::string, Vec3> forces = total_forces(job.string() + ".dat");
  for (const Json& support : summary["supports"])
    if (const auto at = forces.find(support["set"]); at != forces.end())
      result.quantities.push_back({"reaction " + support["name"].get<std::string>(), "N", at->second.norm()});
}

// The words of `flexel export` for this part and scene.
std::vector<std::string> export_words(const Case& study, const fs::path& job,
                                      const std::vector<std::string>& more) {
  std::vector<std::string> words = {own_program("flexel"), "export"};
  words.insert(words.end(), study.parts.begin(), study.parts.end());
  words.insert(words.end(), study.voxelize_options.begin(), study.voxelize_options.end());
  words.insert(words.end(), {"--quiet", "--calculix", "--scene", study.scene, "--summary",
                             job.string() + ".json", "-o", job.string() + ".inp"});
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// The first number of what a program says of itself; how it ends says nothing (ccx -v ends with 201).
std::string version_of(const std::string& program, const char* option, const TemporaryFolder& folder) {
  ChildOptions options;
  options.log = folder.path() / "version";
  options.folder = folder.path();
  (void)run_child({program, option}, options);
  std::ifstream in(options.log);
  const std::string said{std::istreambuf_iterator<char>(in), {}};
  std::smatch found;
  return std::regex_search(said, found, std::regex("[0-9]+\\.[0-9.]*[0-9]")) ? found[0].str() : "?";
}

}  // namespace

CalculixLook look_at_calculix(const Case& study, const RunOptions& options) {
  CalculixLook look;
  const std::string ccx = find_program("ccx"), gmsh = find_program("gmsh");
  if (ccx.empty() || gmsh.empty()) {
    look.refused = ccx.empty() ? "the program ccx is not installed (apt-get install calculix-ccx)"
                               : "the program gmsh is not installed (apt-get install gmsh)";
    return look;
  }
  const TemporaryFolder folder(options.folder);
  look.versions = fmt::format("CalculiX {}, gmsh {}", version_of(ccx, "-v", folder),
                              version_of(gmsh, "--version", folder));
  const fs::path job = folder.path() / "look";
  ChildOptions child;
  child.log = folder.path() / "log";
  child.deadline = options.deadline;
  const ChildRun run =
      run_child(export_words(study, job, {"--mesh", "hex", "--count", std::to_string(kFirstLook)}), child);
  if (run.exit_code != 0) {
    look.refused = run.out_of_time ? "the time was up" : error_in_log(child.log);
    return look;
  }
  std::ifstream in(job.string() + ".json");
  const Json summary = load_json(in);
  look.large_deflection = summary["nlgeom"];
  look.why_deflection = summary["why_nlgeom"];
  look.warnings = summary["warnings"].get<std::vector<std::string>>();
  return look;
}

RunResult run_calculix(const Case& study, double size, bool large_deflection, int threads,
                       const RunOptions& options) {
  RunResult result;
  const TemporaryFolder folder(options.folder);
  const fs::path job = fs::absolute(folder.path() / "job");
  ChildOptions child;
  child.log = fs::absolute(folder.path() / "log");
  child.deadline = options.deadline;
  child.environment = {fmt::format("OMP_NUM_THREADS={}", threads)};
  std::size_t programs = 0;
  const auto run = [&](const char* stage, const std::vector<std::string>& words) {
    const ChildRun found = run_child(words, child);
    result.stages.push_back({stage, found.wall});
    result.wall += found.wall;
    result.cpu += found.cpu;
    result.memory = std::max(result.memory, found.memory);
    result.program_memory.at(programs++) = found.memory;
    if (found.exit_code == 0) return true;
    result.exit_code = found.exit_code;
    result.out_of_time = found.out_of_time;
    std::string why = programs == 1 ? error_in_log(child.log) : ccx_error(child.log);
    if (why.empty())
      why =
          fmt::format("{} ended with exit code {}", fs::path(words[0]).filename().string(), found.exit_code);
    result.failure = found.out_of_time ? "stopped: out of time" : why;
    return false;
  };
  if (!run("voxelize", export_words(study, job,
                                    {"--mesh", "tet", "--size", fmt::format("{:.9g} m", size), "--nlgeom",
                                     large_deflection ? "on" : "off", "--threads", std::to_string(threads)})))
    return result;
  std::ifstream in(job.string() + ".json");
  const Json summary = load_json(in);
  result.cells = summary["elements"];
  result.elements = summary["nodes"];
  result.spacing = size;
  result.given_up = options.goes_on && !options.goes_on(result.cells);
  if (result.given_up) return result;
  const std::string ccx = find_program("ccx");
  child.folder = folder.path();  // ccx leaves files where it is
  if (ccx.empty())
    result.failure = "the program ccx is not installed";
  else if (run("solve", {ccx, job.string()}))
    take_results(summary, job, result);
  return result;
}

}  // namespace flexel::study
