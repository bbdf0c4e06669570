// Runs one configuration of a part and a scene: flexel-voxelize, flexel-simulate and flexel-map, one after
// the other, as child processes. Wall time, processor time and peak memory come from the kernel (wait4),
// results from the programs' summaries.
#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/files/temporary_folder.h"
#include "base/math/vec.h"
#include "flexel/process/child.h"
#include "flexel/study/runs/configuration.h"

namespace flexel::study {

// What all runs of a study have in common.
struct Case {
  std::vector<std::string> parts;             // files
  std::vector<std::string> voxelize_options;  // for every run: "--unit", "mm", "--heal", "wrap" ...
  std::string scene;                          // file
  std::string scene_text;                     // what it holds
};

// One figure that a run found.
struct Quantity {
  std::string name;  // "tip", "largest displacement", "reaction bracket/1" ...
  std::string unit;  // SI
  double value = 0;
};

struct Stage {
  std::string name;  // kStages
  double wall = 0;   // s
};

// The stages of a run, in their order: loading the programs; reading the part, the bodies and the scene;
// repairing the surface; the lattice; assembling (forces and their derivatives, loads and supports; of timed
// runs: all of the steps); the linear solver and what is between; error bars; mapping; writing.
inline constexpr const char* kStages[] = {"start", "read",       "heal", "voxelize", "assemble",
                                          "solve", "error bars", "map",  "write"};

struct PartFound {
  std::string name;
  double volume = 0;                    // m^3, of the surface
  std::optional<double> thinnest_wall;  // m
};

struct RunResult {
  std::string failure;                     // "" when all went well, else the program's own line
  int exit_code = 0;                       // of the program that failed
  bool out_of_time = false;                // stopped at the deadline
  bool given_up = false;                   // by RunOptions::goes_on; not a failure
  double wall = 0, cpu = 0;                // s, of the three programs together
  double memory = 0;                       // bytes, the largest of the three
  std::array<double, 3> program_memory{};  // bytes: flexel-voxelize, flexel-simulate, flexel-map
  std::vector<Stage> stages;
  std::size_t elements = 0, cells = 0;  // at centre placement cells are 0: count elements
  double spacing = 0;                   // m, geometric mean over the axes of the first part's lattice
  std::vector<PartFound> parts;
  double thin_matter = 0;  // share of the matter in walls of fewer than two cells
  double area = 0;         // m^2, of the surface at rest
  std::vector<Quantity> quantities;
  int newton_iterations = 0, cg_iterations = 0;
  std::size_t steps = 0;               // timed runs
  double step = 0;                     // s
  double simulate_seconds = 0;         // s, without reading and writing
  std::optional<double> energy_drift;  // timed runs: residual of the energy balance over its largest term

  [[nodiscard]] bool ok() const { return failure.empty() && !given_up; }
  [[nodiscard]] const Quantity* find(const std::string& name) const;
  // Cells, or elements where there are none.
  [[nodiscard]] std::size_t size() const { return cells > 0 ? cells : elements; }
  // Timed runs: millions of element-steps a second.
  [[nodiscard]] double element_steps_per_second() const;
};

struct RunOptions {
  std::filesystem::path folder;   // for temporary files; those are gone when the run has ended
  std::filesystem::path surface;  // where the mapped surface is kept (.ply); "": nowhere
  std::filesystem::path body;     // where the deformed body is kept (.vtu); "": nowhere
  std::filesystem::path history;  // timed runs: file of the energy history (.csv); "": none
  Deadline deadline = kNever;
  // Asked when the lattice is made (of CalculiX the mesh): whether so many cells are to be solved (elements
  // where there are none, tetrahedra). The run ends there otherwise, `given_up`. Empty: they are.
  std::function<bool(std::size_t size)> goes_on;
};

// Runs the configuration. A run that fails is a result with `failure`; throws Interrupted, and InputError
// where a program cannot be started.
[[nodiscard]] RunResult run_configuration(const Case& study, const Configuration& configuration,
                                          const RunOptions& options);

// What the log of one of our programs says after ": error: ", the last time; "" where it says nothing.
[[nodiscard]] std::string error_in_log(const std::filesystem::path& log);

}  // namespace flexel::study
