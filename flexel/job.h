// Options for parts and for their loads and supports, shared by `flexel deform`, `flexel export` and `flexel
// compare` (loads and supports: `flexel study` too).
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/program/arguments.h"
#include "base/program/progress.h"
#include "flexel/actions.h"
#include "flexel/flex/flex.h"
#include "formats/exchange/import.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::commands {

struct JobArguments {
  std::vector<std::string> parts, fixes, pushes, moves, torques, twists, bearings, probes, materials, infills;
  std::string scene, model, gravity, shell, size, heal = "auto", placement = "corner", unit, edge;
  std::optional<std::size_t> count;
  bool force = false;                 // results may replace files that are read
  std::optional<FlexArguments> flex;  // of `flexel flex`, in place of a scene and of what acts
};

// Adds the options of what parts are: --material to --shell.
void declare_matter(CommandLine& app, JobArguments& arguments);
// Adds the options of what happens: --scene to --shell.
void declare_scene(CommandLine& app, JobArguments& arguments);

// Adds --size to --unit; `count` is the help of --count.
void declare_lattice(CommandLine& app, JobArguments& arguments,
                     const std::string& count = "Or: about this many cells");

// Adds all of their options to the program, but for --placement, which not every command has. With
// `arguments.flex` those of `flexel flex`.
void declare_job(CommandLine& app, JobArguments& arguments);

// What they ask for, checked.
struct Job {
  ImportOptions import;
  voxelize::VoxelizeOptions voxelize;
  simulate::Scene scene;
  // Not in the scene before the part is known: add_actions()
  std::vector<Action> pushes, moves, torques, twists;
  std::optional<Flex> flex;
  [[nodiscard]] bool acts_along_faces() const {
    return !(pushes.empty() && moves.empty() && torques.empty() && twists.empty());
  }
};

// What --size to --unit ask for. Throws InputError: see plan_job().
void plan_lattice(const JobArguments& arguments, Job& job);
// The scene of the arguments. Throws InputError: see plan_job().
void plan_scene(const JobArguments& arguments, Job& job);
// What options add to the scene of `job`.
void add_options(const JobArguments& arguments, Job& job);
// Throws InputError where the scene asks for modes or buckling, whose shapes without size are no deformed part.
void refuse_modes(const simulate::Scene& scene);
// Throws InputError where options alone, without a scene's file, name no material or nothing that acts.
void refuse_idle(const JobArguments& arguments);

// Makes a plan of the arguments. Where that throws InputError, a part's file that cannot be read is told of
// first, as far as reading finds its fault in a few seconds: what the options lack is of no use without the
// part.
void plan_after_files(const JobArguments& arguments, const std::function<void()>& plan);

// Reads the scene, not the parts. Throws InputError: wrong or missing arguments, nothing that acts, no
// material, an unknown one.
[[nodiscard]] Job plan_job(const JobArguments& arguments);

// The surfaces of all files as one; warns of sizes that hardly any part has.
[[nodiscard]] Surface read_parts(const std::vector<std::string>& paths, const ImportOptions& options,
                                 Progress& progress);

// Throws InputError: --material or --infill of a part that is not there, a part without a material.
void check_parts(const Job& job, const Surface& surface);

// Adds --push, --move, --torque, --twist and what `flexel flex` asks for to the scene; `body` gives the
// normals.
void add_actions(Job& job, const Body& body);

}  // namespace flexel::commands
