// Parts and what happens to them, as the commands that take both spell it (`flexel deform`, `flexel export`).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "flexel/actions.h"
#include "formats/import.h"
#include "formats/program.h"
#include "formats/progress.h"
#include "voxelize/voxelize.h"

namespace flexel {

struct JobArguments {
  std::vector<std::string> parts, fixes, pushes, moves;
  std::string scene, material, size, heal = "auto", placement = "corner", unit, edge;
  std::optional<std::size_t> count;
  bool force = false;  // results may replace files that are read
};

// Adds their options to the program, but for --placement, which not every command has.
void declare_job(CLI::App& app, JobArguments& arguments);

// What they ask for, checked.
struct Job {
  ImportOptions import;
  VoxelizeOptions voxelize;
  Scene scene;
  std::vector<Action> pushes, moves;  // not in the scene before the part is known: add_actions()
};

// Reads the scene, not the parts. Throws InputError: wrong or missing arguments, nothing that acts, no
// material, an unknown one.
[[nodiscard]] Job plan_job(const JobArguments& arguments);

// The surfaces of all files as one; warns of sizes that hardly any part has.
[[nodiscard]] Surface read_parts(const std::vector<std::string>& paths, const ImportOptions& options,
                                 Progress& progress);

// Adds --push and --move to the scene; `body` gives the normals.
void add_actions(Job& job, const Body& body);

}  // namespace flexel
