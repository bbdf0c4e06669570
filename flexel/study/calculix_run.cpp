// What CalculiX found is read from its .frd (displacements of every node, block
// "DISP": lines of " -1", the node in 10 characters and three values in 12
// each) and its .dat (total forces of the supports).
#include "flexel/study/calculix_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/error.h"

namespace flexel::study {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr double kMillimetre = 1e-3;

// (node -> m) of the last step that was written.
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

// Total force [N] of each set, from "total force (fx,fy,fz) for set NAME ..."
// and the line after the next.
std::map<std::string, Vec3> total_forces(const fs::path& dat) {
  std::map<std::string, Vec3> found;
  std::ifstream in(dat);
  std::string set;
  for (std::string line; std::getline(in, line);) {
    if (const std::size_t at = line.find("total force"); at != std::string::npos) {
      const std::size_t name = line.find("for set ", at);
      std::istringstream(line.substr(name == std::string::npos ? at : name + 8)) >> set;
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

// The last line of a log that tells of an error.
std::string last_error(const fs::path& log) {
  std::ifstream in(log);
  std::string found;
  for (std::string line; std::getline(in, line);)
    if (line.find("rror") != std::string::npos || line.find("ERROR") != std::string::npos) found = line;
  return found.substr(0, 200);
}

void take_results(const Json& told, const fs::path& job, RunResult& result) {
  const std::map<long, Vec3> moved = displacements(job.string() + ".frd");
  if (moved.empty()) {
    result.failure = "ccx wrote no displacements";
    return;
  }
  for (const Json& probe : told["probes"]) {
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
  for (const Json& support : told["supports"])
    if (const auto at = forces.find(support["set"]); at != forces.end())
      result.quantities.push_back({"reaction " + support["name"].get<std::string>(), "N", at->second.norm()});
}

}  // namespace

std::string find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const fs::path program = fs::path(folder) / name; access(program.c_str(), X_OK) == 0) return program;
  return "";
}

RunResult run_calculix(const Case& study, double size, const RunOptions& options) {
  RunResult result;
  const std::string ccx = find_program("ccx");
  if (ccx.empty() || find_program("gmsh").empty()) {
    result.failure = ccx.empty() ? "ccx is not installed" : "gmsh is not installed";
    return result;
  }
  const TemporaryFolder folder(options.folder);
  const fs::path job = folder.path() / "job", log = folder.path() / "log";
  std::vector<std::string> words = {own_program("flexel"), "export"};
  words.insert(words.end(), study.parts.begin(), study.parts.end());
  words.insert(words.end(), study.voxelize_options.begin(), study.voxelize_options.end());
  for (const std::string& each :
       {std::string("--scene"), study.scene, std::string("--calculix"), std::string("--mesh"),
        std::string("tet"), std::string("--size"), fmt::format("{:.9g} m", size), std::string("--threads"),
        std::string("1"), std::string("--summary"), job.string() + ".json", std::string("-o"),
        job.string() + ".inp"})
    words.push_back(each);
  const auto take = [&](const char* stage, const ChildRun& child) {
    result.stages.push_back({stage, child.wall});
    result.wall += child.wall;
    result.cpu += child.cpu;
    result.memory = std::max(result.memory, child.memory);
    result.exit_code = child.exit_code;
    result.out_of_time = child.out_of_time;
    if (child.out_of_time)
      result.failure = "stopped: out of time";
    else if (child.exit_code != 0)
      result.failure = fmt::format("exit code {}: {}", child.exit_code, last_error(log));
  };
  take("voxelize", run_child(words, log, options.deadline));
  if (!result.ok()) return result;
  std::ifstream in(job.string() + ".json");
  const Json told = Json::parse(in);
  result.cells = told["elements"];
  result.elements = told["nodes"];
  result.spacing = size;
  take("solve", run_child({"/usr/bin/env", "OMP_NUM_THREADS=1", ccx, job.string()}, log, options.deadline));
  if (result.ok()) take_results(told, job, result);
  return result;
}

}  // namespace flexel::study
