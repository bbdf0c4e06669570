// The options of a job, checked before any stage runs.
#include "flexel/job.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/common/file_formats.h"
#include "formats/exchange/import_parts.h"
#include "formats/exchange/size_warning.h"
#include "simulate/quadratic/quadratic_run.h"

namespace flexel::commands {
void declare_lattice(CommandLine& app, JobArguments& arguments, const std::string& count) {
  app.add_option("--size", arguments.size, "Spacing of the lattice (\"2 mm\")").type_name("LENGTH");
  app.add_option("--count", arguments.count, count).type_name("N");
  app.add_option("--heal", arguments.heal, "Broken surfaces: auto, wrap or none (docs/reference/healing.md)")
      .type_name("HOW")
      .show_default();
  app.add_option("--unit", arguments.unit, "Unit of files that carry none (default mm)").type_name("UNIT");
}

void declare_job(CommandLine& app, JobArguments& arguments) {
  app.add_option("part", arguments.parts, read_titles() + " files; -: stdin").required().type_name("PART");
  if (arguments.flex) {
    declare_flex(app, *arguments.flex);
    declare_matter(app, arguments);
  } else {
    declare_scene(app, arguments);
  }
  declare_lattice(app, arguments);
  app.add_option(
         "--edge", arguments.edge,
         "Split the mesh to this longest edge (default: STEP a 64th of the file's diagonal, meshes not)")
      .type_name("LENGTH");
  app.add_flag("--force", arguments.force, "Let results replace files that are read");
}

void plan_lattice(const JobArguments& arguments, Job& job) {
  if (!arguments.unit.empty()) job.import.unit = length_unit(arguments.unit);
  if (!arguments.size.empty() && arguments.count) throw InputError("give --size or --count, not both");
  if (!arguments.size.empty()) {
    job.voxelize.size = parse_quantity(arguments.size, Dimension::length);
    if (!(*job.voxelize.size > 0)) throw InputError("--size: must be above zero");
  }
  // what is below zero is a huge number here
  if (arguments.count && static_cast<std::int64_t>(*arguments.count) <= 0)
    throw InputError("--count: must be above zero");
  job.voxelize.count = arguments.count;
  job.voxelize.heal = voxelize::heal_choice(arguments.heal);
}

namespace {

// Its cells are cubes.
bool asks_for_springs(const simulate::Scene& scene) {
  return scene.model == "springs" ||
         std::any_of(scene.parts.begin(), scene.parts.end(),
                     [](const auto& part) { return part.second.model == "springs"; });
}

}  // namespace

Job plan_job(const JobArguments& arguments) {
  Job job;
  if (std::count(arguments.parts.begin(), arguments.parts.end(), "-") + (arguments.scene == "-") > 1)
    throw InputError("only one input can come from stdin");
  plan_lattice(arguments, job);
  if (!arguments.edge.empty()) {
    job.import.largest_edge = parse_quantity(arguments.edge, Dimension::length);
    if (!(*job.import.largest_edge > 0)) throw InputError("--edge: must be above zero");
  }
  job.voxelize.placement = voxelize::placement_choice(arguments.placement);
  plan_scene(arguments, job);
  job.voxelize.moments = simulate::asks_for_quadratic(job.scene);
  job.voxelize.cubic = asks_for_springs(job.scene);
  return job;
}

void plan_after_files(const JobArguments& arguments, const std::function<void()>& plan) {
  constexpr double kPatience = 3;  // s
  try {
    plan();
  } catch (const InputError&) {
    const StopAfter limit(kPatience, "reading");
    try {
      for (const std::string& path : arguments.parts)
        if (path != "-") (void)import_surface(path);  // in whatever unit: the options may be what is wrong
    } catch (const TimeoutError&) {
      if (!limit.passed()) throw;
    }
    throw;
  }
}

Surface read_parts(const std::vector<std::string>& paths, const ImportOptions& options, Progress& progress) {
  ImportOptions with_warnings = options;
  with_warnings.warn = [&](const std::string& line) { progress.warn(line); };
  Surface surface = import_parts(paths, with_warnings, progress);
  for (const std::string& line : size_warnings(surface)) progress.warn(line);
  for (const std::string& line : refinement_notes(surface)) progress.say(line);
  return surface;
}

}  // namespace flexel::commands
